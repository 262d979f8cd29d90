# SPDX-License-Identifier: Apache-2.0
"""What is said of an ADC that loses its registers, tells of errors, or gives nothing."""

import dataclasses

import pytest
from towtank_daq.adc_watch import AdcWatch
from towtank_daq.protocol_records import HealthFrame

RESTART = 0x10
PERIOD_NS = 10_000_000


class Stream:
    """Scans at 100 Hz, and what was said of them, by number."""

    def __init__(self, protocol) -> None:
        self.watch = AdcWatch(protocol)
        self.number = 0
        self.said: list[tuple[int, str]] = []

    def scans(self, count: int, flags: int = 0, mask: int = 0x3F) -> None:
        for _ in range(count):
            texts = self.watch.scan(flags, mask, self.number * PERIOD_NS)
            self.said += [(self.number, text) for text in texts]
            self.number += 1


@pytest.fixture
def stream(protocol) -> Stream:
    stream = Stream(protocol)
    stream.scans(100)
    return stream


def test_a_set_up_is_told_once_when_it_is_over(stream):
    stream.scans(2, mask=0)
    stream.scans(1, RESTART, mask=0)
    stream.scans(100)
    ((number, text),) = stream.said
    assert number == 103
    assert "set up anew: 3 scans have no channel" in text


def test_an_outage_is_told_after_a_second_and_when_it_is_over(stream):
    stream.scans(2, mask=0)
    stream.scans(298, RESTART, mask=0)
    stream.scans(100)
    (first, dead), (then, back) = stream.said
    assert (first, then) == (200, 400)
    assert dead.startswith("the ADC has given nothing for 1 s: check its 3.3 V supply")
    assert "300 scans have no channel" in back


def test_outages_that_come_thick_and_fast_are_told_together(stream):
    for _ in range(20):
        stream.scans(1, RESTART, mask=0)
        stream.scans(49)
    assert len(stream.said) == 2  # 10 s of them, told 5 s apart at least
    assert "set up anew: 1 scans" in stream.said[0][1]
    assert "set up anew: 10 scans" in stream.said[1][1]


def test_scans_without_a_channel_that_the_board_knows_no_reason_for_are_no_set_up(stream):
    stream.scans(1, mask=0)
    stream.scans(1)
    assert stream.said == []


def test_each_new_kind_of_error_is_told_once(protocol):
    watch = AdcWatch(protocol)
    health = HealthFrame(*[0] * 19)

    def told(bits: int) -> list[str]:
        return list(watch.health(dataclasses.replace(health, adc_error_bits=bits)))

    assert told(0x04) == []  # of another run
    (text,) = told(0x06)
    assert text.startswith("the ADC tells of register checksum: keep what sparks away")
    assert told(0x06) == []
    watch.reset()  # another stream of the same board
    assert told(0x06) == []
    (text,) = told(0x800806)
    assert text.startswith("the ADC tells of power on + 0x000800: check its 3.3 V supply")
    watch.board_was_reset()  # what it tells of now is of this life
    (text,) = told(0x02)
    assert text.startswith("the ADC tells of register checksum")
