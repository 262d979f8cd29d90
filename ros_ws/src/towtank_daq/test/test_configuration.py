# SPDX-License-Identifier: Apache-2.0
"""Configurations that the board can have, and the refusal of others."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from towtank_daq.configuration import (
    Configuration,
    ConfigurationError,
    configuration_at,
    configuration_of,
)
from towtank_daq.protocol_records import ConfigureArguments


@pytest.fixture
def standard(description) -> Configuration:
    return configuration_at(description, 100)


@pytest.mark.parametrize(("rate_hz", "fs"), [(10, 6), (100, 6), (200, 3)])
def test_filter_word_fits_the_period(description, rate_hz, fs):
    """Hand values at 200 Hz: six conversions take 3.74 ms with 3 and 4.68 ms with 4; the limit is
    5 ms * 0.9 / 1.05 = 4.29 ms."""
    assert configuration_at(description, rate_hz).filter_fs == fs


def test_arguments(standard, description):
    changed = replace(standard, filter_type="sinc4", order=("accel_z", "excitation"))
    assert changed.arguments(description) == ConfigureArguments(
        rate_hz=100,
        filter_type=0,
        filter_fs=6,
        gains=(1, 1, 1, 1, 1, 1),
        order=(4, 5, 255, 255, 255, 255),
    )
    assert changed.configured_mask(description) == 0b110000


def test_channel_delays(standard, description):
    """Hand values: T = (3*32*6 + 95)/614.4 kHz = 1.09212 ms; poles 40.7 Hz and 14.47 Hz."""
    delays = standard.channel_delays_ns(description)
    assert delays[0] == pytest.approx(0.54606e6 - 3.91044e6, abs=50)
    assert delays[1] - delays[0] == pytest.approx(1.09212e6, abs=5)
    assert delays[2] == pytest.approx(2.73031e6 - 10.99899e6, abs=50)


def test_channel_delays_follow_order_and_filter(standard, description):
    """T = (4*32*6 + 95)/614.4 kHz = 1.40462 ms; accel_x first, then the excitation."""
    changed = replace(standard, filter_type="sinc4", order=("accel_x", "excitation"))
    delays = changed.channel_delays_ns(description)
    assert delays[2] == pytest.approx(0.70231e6 - 10.99899e6, abs=50)
    assert delays[5] == pytest.approx(2.10693e6 - 3.91044e6, abs=50)
    assert delays[0] == delays[1] == delays[3] == delays[4] == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rate_hz": 9}, "scan rate 9 Hz: the board takes 10 to 200 Hz"),
        ({"filter_type": "sinc5"}, "filter 'sinc5': the board has sinc4 and sinc3"),
        ({"filter_fs": 2}, "filter word 2: the board takes 3 to 2047"),
        ({"gains": (1, 1)}, "2 gains: give one for each of the 6 channels"),
        ({"gains": (1, 1, 1, 3, 1, 1)}, "gain 3 of accel_y: the ADC has 1, 2, 4, 8, 16, 32"),
        ({"order": ("accel_x", "depth")}, "channel 'depth': the board has fish_pressure, "),
        ({"order": ("accel_x", "accel_x")}, "channel 'accel_x' stands twice"),
        ({"order": ()}, "no channel is scanned: name at least one"),
        ({"rate_hz": 200}, r"6 channels at 200 Hz .* may take 7.08 ms of 5.00 ms; lower the rate"),
    ],
)
def test_refusals_name_the_mend(standard, description, change, message):
    with pytest.raises(ConfigurationError, match=message):
        replace(standard, **change).arguments(description)


@given(st.integers(10, 200), st.permutations(range(6)), st.integers(1, 6))
def test_what_the_board_says_comes_back(description, rate_hz, order, count):
    names = tuple(description.channel_names[i] for i in order[:count])
    configuration = replace(configuration_at(description, rate_hz), order=names)
    assert configuration_of(configuration.arguments(description), description) == configuration
