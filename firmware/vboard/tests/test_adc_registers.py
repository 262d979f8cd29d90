# SPDX-License-Identifier: GPL-3.0-or-later
"""The AD7124-8's registers and SPI transactions, driven by real SPI code on the microcontroller."""

from __future__ import annotations

import pytest
from probe_link import (
    ADC_CONTROL,
    ERROR,
    ERROR_EN,
    ID,
    MILLISECOND,
    STATUS,
    channel,
    config,
    crc8,
    filter_,
)

ERROR_SPI_CRC = 0x04
STATUS_POR = 0x10
STATUS_ERROR = 0x40


@pytest.fixture
def probe(open_probe):
    """A probe whose ADC is ready for SPI."""
    probe = open_probe()
    probe.board.run_until(6 * MILLISECOND)
    return probe


def test_crc8_of_the_check_string():
    # The catalogue's check value of CRC-8/SMBUS, the same polynomial and initial value.
    assert crc8(b"123456789") == 0xF4


def test_registers_hold_their_reset_values(probe):
    assert probe.read(ID) == 0x14
    assert probe.read(ERROR_EN) == 0x000040
    assert probe.read(ADC_CONTROL) == 0
    assert [probe.read(channel(i)) for i in (0, 1, 15)] == [0x8001, 0x0001, 0x0001]
    assert probe.read(config(7)) == 0x0860
    assert probe.read(filter_(0)) == 0x060180


def test_power_on_flag_shows_until_status_is_read(probe):
    assert probe.read(STATUS) & STATUS_POR
    assert not probe.read(STATUS) & STATUS_POR


def test_written_registers_read_back_with_and_without_crc(probe):
    probe.write(filter_(3), 0x4003C0)
    assert probe.read(filter_(3)) == 0x4003C0
    probe.turn_crc_on()
    probe.write(config(5), 0x09E3)
    assert probe.read(config(5)) == 0x09E3
    assert probe.read(filter_(3)) == 0x4003C0


def test_a_write_with_a_wrong_crc_is_ignored_and_reported(probe):
    probe.turn_crc_on()
    data = bytes([config(2)[0], 0x01, 0x23])
    probe.spi(data + bytes([crc8(data) ^ 0x01]))
    assert probe.read(config(2)) == 0x0860
    assert probe.read(STATUS) & STATUS_ERROR
    assert probe.read(ERROR) == ERROR_SPI_CRC
    assert probe.read(ERROR) == 0  # reading clears
    assert not probe.read(STATUS) & STATUS_ERROR


MAP_CRC = 0x02
ALL_WRITABLE = sorted(set(range(0x39)) - {0x00, 0x02, 0x05, 0x06, 0x08})


def test_a_flipped_bit_of_any_register_is_found_where_that_is_asked_for(probe):
    for address in ALL_WRITABLE:
        probe.write(ERROR_EN, 0x000042)
        probe.board.flip_adc_bit(address, 6 if address == ERROR_EN[0] else 0)
        probe.board.run_until(probe.board.now_ns + MILLISECOND)  # it looks 2400 times a second
        assert probe.read(STATUS) & STATUS_ERROR, hex(address)
        assert probe.read(ERROR) == MAP_CRC
        assert probe.read(ERROR) == MAP_CRC  # as long as the bit is wrong
        probe.write(ERROR_EN, 0x000040)  # a write takes what is there for right
        probe.read(ERROR)
        assert probe.read(ERROR) == 0


def test_a_write_makes_the_chip_take_what_is_there_for_right(probe):
    probe.write(ERROR_EN, 0x000042)
    probe.board.flip_adc_bit(config(2)[0], 0)
    probe.write(filter_(1), 0x060180)  # within the 0.4 ms
    probe.board.run_until(probe.board.now_ns + MILLISECOND)
    assert not probe.read(STATUS) & STATUS_ERROR


def test_only_what_is_there_can_flip(probe):
    for address, bit in ((0x05, 0), (0x39, 0), (config(0)[0], 16)):
        with pytest.raises(ValueError, match="no bit"):
            probe.board.flip_adc_bit(address, bit)


def test_a_dip_of_the_supply_resets_the_adc_alone(probe):
    probe.read(STATUS)
    probe.write(config(0), 0x0123)
    resets = probe.board.counters()["resets"]
    probe.board.dip_adc_supply()
    probe.board.run_until(probe.board.now_ns + 5 * MILLISECOND)
    assert probe.read(config(0)) == 0x0860
    assert probe.read(STATUS) & STATUS_POR
    assert probe.board.counters()["resets"] == resets


def test_read_only_registers_keep_their_value(probe):
    probe.write(ID, 0x00)
    assert probe.read(ID) == 0x14


def test_64_ones_reset_the_chip_which_then_needs_4_ms(probe):
    probe.turn_crc_on()
    probe.write(config(0), 0x0123)
    probe.spi(b"\xff" * 8)
    probe.crc = False
    assert probe.read(ID) != 0x14  # too early: the whole exchange takes a millisecond
    probe.board.run_until(probe.board.now_ns + 5 * MILLISECOND)
    assert probe.read(ID) == 0x14
    assert probe.read(config(0)) == 0x0860


def test_rising_cs_ends_a_transaction(probe):
    probe.spi(bytes([filter_(0)[0], 0x11]))  # cut short
    assert probe.read(ID) == 0x14
    assert probe.read(filter_(0)) == 0x060180


def test_several_transactions_fit_under_one_low_cs(probe):
    answer = probe.spi(bytes([0x45, 0x00, 0x47, 0x00, 0x00, 0x00]))
    assert answer[1] == 0x14
    assert answer[3:] == b"\x00\x00\x40"


def test_cs_high_leaves_the_bus_pulled_up(probe):
    assert probe.ask(b"x\x02\x45\x00", 2) == b"\xff\xff"


def test_correct_use_counts_no_misuse(probe):
    probe.turn_crc_on()
    probe.read(ID)
    assert probe.board.counters()["spi_misuse"] == 0
