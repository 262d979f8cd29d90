# SPDX-License-Identifier: Apache-2.0
"""The front ends' decks against values by hand, board.yaml, and the rig's limits."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from towtank_rig import load_rig

ROOT = Path(__file__).resolve().parents[3]
sys.path += [str(ROOT / "hardware/board/spice"), str(ROOT / "firmware/protocol")]

import figures  # noqa: E402
from front_ends import (  # noqa: E402
    CHANNELS,
    SpiceError,
    conversion_noise,
    deck_parameters,
    run_deck,
    sinc_response,
    spice_number,
    worst_case,
)
from schema_hash import load_board  # noqa: E402

BOARD = load_board(ROOT / "firmware/protocol/board.yaml")
CHANNEL = {channel["name"]: channel for channel in BOARD["channels"]}
KT4 = 1.6576e-20  # 4kT at 27 degC, J
SINC_RATE_HZ = BOARD["adc"]["master_clock_hz"] / (32 * BOARD["adc"]["filter"]["fs"]["default"])


def test_every_channel_has_a_deck():
    assert sorted(name for names in CHANNELS.values() for name in names) == sorted(CHANNEL)


@pytest.mark.parametrize(
    ("deck", "name"), [(deck, name) for deck, names in CHANNELS.items() for name in names]
)
def test_gain_and_pole_are_those_that_the_host_converts_with(deck, name):
    measured = run_deck(deck).measured
    # board.yaml states four figures of the gain (1.2e-4 is half of the last, twice the load of the
    # bias resistors) and, of the accelerometer, leaves out the ADC's 1 Gohm on 111 kohm.
    assert measured["gain"] == pytest.approx(CHANNEL[name]["gain"], rel=1.2e-4)
    # Half of the last figure of 40.7 Hz.
    assert measured["pole_hz"] == pytest.approx(CHANNEL[name]["pole_hz"], abs=0.05)
    # One pole is all that the conversion knows of the delay: within 0.01 degrees, the input
    # filter's share included.
    lag = math.atan(0.5 / CHANNEL[name]["pole_hz"])
    assert -measured["phase_rad"] == pytest.approx(lag, abs=math.radians(0.01))
    assert measured["attenuation"] == pytest.approx(lag**2 / 2, rel=0.01)


def test_bridge_gain_by_hand():
    measured = run_deck("bridge").measured
    assert measured["gain"] == pytest.approx((1 + 50e3 / 1430) * (1 - 499 / 10e6), rel=1e-5)
    assert measured["full_v"] == pytest.approx(0.04 * 35.96, rel=3e-4)  # bias resistors' load
    assert abs(measured["curvature"]) < 1e-6  # the amplifier is nowhere near its limits
    # The zero is the common mode of 5 V through a rejection of 120 dB; ngspice finds a node's volts
    # to 1 µV, here at two inputs of the amplifier.
    assert measured["zero_v"] == pytest.approx(35.96 * 5e-6, abs=2 * 35.96 * 1e-6)


# The MPX2050 at its limits, V at 10 V: span 41.5 mV; offset, its stability, its hysteresis and its
# change from 25 to 85 degC or 0 degC.
LARGEST_SPAN, LARGEST_ZERO = 41.5e-3, 1.0e-3 + 0.2e-3 + 0.2e-3 + 1.0e-3
# The excitation (power.py: reference 1 %, resistors 0.1 %) with REF, which follows it; 11.4 V at
# the terminals less fuse and FET.
EXCITATION = {-1: 10.033 * 0.988, 1: 10.033 * 1.012}
REF_SHARE = 10 / 66.2
AMPLIFIER = {"gain_error": 0.006, "v12": 11.3}


def at_limits(sign: int, zero: float, ref_share: float = REF_SHARE) -> dict[str, float]:
    """The bridge's deck with everything at the end that `sign` says; measured values."""
    excitation = EXCITATION[sign]
    # Of the divider's two resistors 0.1 % each, less than 0.2 % of REF.
    ref = excitation * ref_share * (1 + 0.002 * sign)
    changed = {"span": LARGEST_SPAN, "zero": zero, "vexc": excitation, "vref": ref}
    return run_deck("bridge", {**changed, **AMPLIFIER, "offset": 66e-6 * sign}).measured


def test_zero_pressure_stays_within_the_guaranteed_swing():
    # No dead zone: zero, half and full scale lie on a line, whatever the tolerances.
    lowest = at_limits(-1, -LARGEST_ZERO)
    assert abs(lowest["curvature"]) < 1e-5
    assert lowest["amplifier_zero_v"] > 1.4


def test_swing_of_a_lower_ref_is_seen():
    # REF of 1.25 V: the output ends 0.15 V above it, 4 mV at the terminals or half a metre.
    found = run_deck("bridge", {"vref": 1.25}).measured
    assert found["zero_v"] == pytest.approx(1.4 - 1.25, abs=1e-3)
    assert found["curvature"] < -0.03


def test_full_scale_stays_within_amplifier_and_adc():
    largest = at_limits(1, LARGEST_ZERO)
    assert abs(largest["curvature"]) < 1e-5
    # The ADC's buffers end 0.1 V below its supply: 3.3 V less 1.2 %.
    assert largest["amplifier_full_v"] < 3.3 * 0.988 - 0.1
    assert largest["full_v"] < EXCITATION[1] / 4  # REFIN1 at unity gain


@pytest.mark.parametrize("sign", [-1, 1])
def test_common_mode_of_the_excitation_is_within_the_amplifiers_range(sign):
    # Half the excitation and the bridge's own asymmetry of 0.1 V; the input amplifiers' outputs lie
    # half the output's span to both sides of it.
    found = run_deck("bridge", {"vexc": EXCITATION[sign] + 0.2 * sign, "v12": 11.3}).measured
    assert abs(found["curvature"]) < 1e-5


def test_common_mode_beyond_the_amplifiers_range_distorts():
    # A supply of 8 V: half of 13 V of excitation is above (V+) - 2 V.
    found = run_deck("bridge", {"vexc": 13.0, "v12": 8.0}).measured
    assert found["full_v"] < 0.1 * 0.04 * 35.96


def test_output_is_limited_by_its_supply():
    # 400 mV would ask for 16 V: the output stops 1.4 V below the supply.
    assert run_deck("bridge", {"span": 0.4}).measured["amplifier_full_v"] == pytest.approx(
        11.8 - 1.4, abs=0.01
    )


def test_accelerometer_by_hand():
    measured = run_deck("accelerometer").measured
    assert measured["zero_v"] == pytest.approx(3.3 / 2, rel=2e-4)
    assert measured["sensitivity_v_per_g"] == pytest.approx(3.3 / 5, rel=2e-4)
    assert measured["pole_hz"] == pytest.approx(1 / (2 * math.pi * 110e3 * 100e-9), rel=1e-3)


@settings(max_examples=15)
@given(
    resistance=st.floats(1e3, 1e4),
    capacitance=st.floats(2e-7, 5e-6),
    gain_resistance=st.floats(500.0, 5e3),
)
def test_pole_and_gain_follow_their_parts(resistance, capacitance, gain_resistance):
    parts = {"R_fil": resistance, "C_fil": capacitance, "R_rg": gain_resistance, "span": 0.01}
    measured = run_deck("bridge", parts).measured
    assert measured["gain"] == pytest.approx(1 + 50e3 / gain_resistance, rel=1e-4)
    pole = 1 / (2 * math.pi * resistance * (capacitance + 2.2e-9))
    # The input filter at 4 kHz lowers a pole f by up to (f/4000)^2; the sweep's points lie 2.3 %
    # apart and are joined by lines.
    assert measured["pole_hz"] == pytest.approx(pole, rel=2e-3 + (pole / 4000) ** 2)


def test_bridge_noise_by_hand():
    run = run_deck("bridge")
    thermal = KT4 * (2200 + 2 * 499 + 1430)
    white = 8e-9**2 + (110e-9 / 35.96) ** 2 + thermal
    flicker = 8e-9**2 * 5.6
    at_10_hz = np.interp(10.0, run.frequency_hz, run.density)
    expected = 35.96 * math.sqrt(white + flicker / 10) / math.hypot(1, 10 / 40.7)
    assert at_10_hz == pytest.approx(expected, rel=0.01)
    # Over one pole of 40.7 Hz: white noise in pi/2 of it, 1/f noise from 0.01 Hz up to it. The sinc
    # filter at 3.2 kHz takes the white noise's upper tail, (2/pi)·40.7/(0.26·3200) = 3 % of it.
    white *= 1 - 0.03
    total = 35.96 * math.sqrt(white * 40.7 * math.pi / 2 + flicker * math.log(40.7 / 0.01))
    assert figures.front_end_noise(BOARD, "bridge") == pytest.approx(total, rel=0.01)


def test_noise_of_a_conversion_stays_within_the_board_file():
    for deck in ("bridge", "excitation"):
        stated = CHANNEL[CHANNELS[deck][0]]["noise_volts"]
        # The figure holds the ADC's own noise, too: the front end may use up a quarter of it, 6 %
        # of the power. (It rises by 2 % at a bridge of 3 kohm.)
        assert figures.front_end_noise(BOARD, deck) < stated / 4


def test_accelerometer_noise_is_the_rigs():
    expected = 50e-6 * 3.3 / 5 * math.sqrt(math.pi / 2 * 14.47)
    noise = figures.front_end_noise(BOARD, "accelerometer")
    assert noise == pytest.approx(expected, rel=0.01)
    rig = load_rig(ROOT / "hardware/rigs/nit_calicut_2012.yaml")
    # The rig file gives two figures.
    assert noise == pytest.approx(rig.sensors.accelerometer.errors.noise.value, rel=0.03)


def test_worst_case_spread():
    spread = worst_case("bridge")
    slope = 0.001 * (50e3 / 1430) / 35.96  # of the gain by RG, at 0.1 %
    for bound, sign in zip(spread["gain"], (-1, 1), strict=True):
        assert bound / 35.963 - 1 == pytest.approx(sign * (0.005 + slope), rel=0.01)
    # Both kinds at their limits; 2 % more for what is not first order.
    assert spread["pole_hz"][0] == pytest.approx(40.71 / 1.01 / 1.05, rel=2e-3)
    assert spread["pole_hz"][1] == pytest.approx(40.71 / 0.99 / 0.95, rel=2e-3)
    # The rigs state the sum as their limit, to its two figures.
    worst = max(abs(bound / 35.963 - 1) for bound in spread["gain"])
    for name in ("nit_calicut_2012", "wu_chwang_2001"):
        sensors = load_rig(ROOT / f"hardware/rigs/{name}.yaml").sensors
        for sensor in (sensors.fish_pressure, sensors.depressor_pressure):
            assert sensor.errors.amplifier_gain.value == pytest.approx(worst, rel=0.01)
    # Divider: (1 - 0.2)·2·0.1 %.
    low, high = worst_case("excitation")["gain"]
    assert high / low - 1 == pytest.approx(2 * 0.0016, rel=0.01)


def test_sinc_filter_is_half_power_where_sinc_is():
    # The AD7124's data sheet says 0.272 (sinc3) and 0.230 (sinc4) of the output rate; (sin x/x)^N
    # itself is at half its power at 0.2620 and 0.2276, up to 4 % below.
    for order, share, stated in ((3, 0.2620, 0.272), (4, 0.2276, 0.230)):
        (response,) = sinc_response(np.array([share * SINC_RATE_HZ]), order, SINC_RATE_HZ)
        assert response == pytest.approx(math.sqrt(0.5), rel=1e-3)
        assert share == pytest.approx(stated, rel=0.04)


def test_white_noise_through_the_sinc_filter_alone():
    run = run_deck("bridge")
    flat = type(run)({}, run.frequency_hz, np.full_like(run.frequency_hz, 1e-6))
    low = type(run)({}, np.geomspace(0.01, 3200, 2000), np.full(2000, 1e-6))
    # Integral of sinc^6 over all frequencies: 11/20 of the rate, one-sided 11/40.
    expected = 1e-6 * math.sqrt(SINC_RATE_HZ * 11 / 40)
    assert conversion_noise(low, 3, SINC_RATE_HZ, 0.01) == pytest.approx(expected, rel=2e-3)
    # The decks' own grid, 40 points a decade.
    assert conversion_noise(flat, 3, SINC_RATE_HZ, 0.01) == pytest.approx(expected, rel=0.01)


def test_unknown_parameter_and_broken_deck_are_told():
    with pytest.raises(SpiceError, match=r"bridge\.cir has no parameter R_gain"):
        run_deck("bridge", {"R_gain": 1.0})
    with pytest.raises(SpiceError, match="ngspice did not carry excitation"):
        run_deck("excitation", {"R_fil": math.nan})
    with pytest.raises(SpiceError, match="is not a number of SPICE"):
        spice_number("3k9")


def test_parameters_are_read_with_their_suffixes():
    parts = deck_parameters("bridge")
    assert parts["R_rg"] == 1430.0
    assert parts["R_bias"] == 1e7
    assert parts["C_fcm"] == pytest.approx(2.2e-9)


def test_readme_states_what_the_command_prints():
    assert figures.tables() in (ROOT / "hardware/board/README.md").read_text(encoding="utf-8")
