# SPDX-License-Identifier: Apache-2.0
"""Faults of sensors and wires upon the volts of the terminals."""

import math
from pathlib import Path

import numpy as np
import pytest
from towtank_rig import load_rig
from towtank_sim.protocol_records import CHANNELS
from towtank_sim.terminal_faults import FaultError, TerminalFault, TerminalFaults, parse_faults

RIG = load_rig(Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
TIME = np.arange(0.0, 10.0, 0.01)


def with_faults(text, time=TIME, volts=None):
    """Volts of six channels that rise by 1 V a second from their number on, with faults."""
    if volts is None:
        volts = np.add.outer(time, np.arange(6.0))
    return TerminalFaults(parse_faults(text), RIG, CHANNELS, seed=1).apply(time, volts)


def test_faults_are_read():
    assert parse_faults("") == ()
    assert parse_faults(" accel_x:short@2-3.5, excitation:low@1e1 ") == (
        TerminalFault("accel_x", "short", 2.0, 3.5),
        TerminalFault("excitation", "low", 10.0, math.inf),
    )


@pytest.mark.parametrize(
    "text, why",
    [
        ("fish_pressure", "write CHANNEL:KIND@START"),
        ("fish_pressure:broken@1", "KIND one of open, short"),
        ("fish_pressure:open@soon", "times in s"),
        ("fish_pressure:open@3-2", "must stop after it starts"),
        ("fish_pressure:low@3", "low and high are for the excitation"),
        ("excitation:open@3", "low and high are for the excitation"),
    ],
)
def test_what_is_no_fault_is_refused(text, why):
    with pytest.raises(FaultError, match=why):
        parse_faults(text)


def test_a_fault_needs_a_channel_of_the_board():
    with pytest.raises(FaultError, match="no channel 'accel_q': give one of fish_pressure"):
        with_faults("accel_q:open@1")


@pytest.mark.parametrize(
    "text, volts",
    [
        ("fish_pressure:open@2-3", 0.3),
        ("accel_z:open@2-3", 3.3),
        ("depressor_pressure:short@2-3", 0.0),
        ("accel_x:stuck@2-3", 4.0),  # channel 2 at 2 s
    ],
)
def test_volts_of_a_fault_while_it_lasts(text, volts):
    channel = CHANNELS.index(text.partition(":")[0])
    clean, faulty = with_faults(""), with_faults(text)
    during = (TIME >= 2.0) & (TIME < 3.0)
    assert np.all(faulty[during, channel] == pytest.approx(volts, abs=1e-12))
    clean[during, channel] = faulty[during, channel]
    np.testing.assert_array_equal(faulty, clean)


def test_excitation_takes_the_bridges_with_it():
    clean, faulty = with_faults(""), with_faults("excitation:high@5")
    late = TIME >= 5.0
    for channel in (0, 1, 5):
        np.testing.assert_allclose(faulty[late, channel], 1.2 * clean[late, channel])
    np.testing.assert_array_equal(faulty[:, 2:5], clean[:, 2:5])
    np.testing.assert_array_equal(faulty[~late], clean[~late])


def test_noise_is_fifty_times_the_rigs_highest():
    faulty = with_faults("fish_pressure:noisy@0", volts=np.zeros((len(TIME), 6)))
    # 1000 samples tell a deviation to 2.2 %; five of that
    assert np.std(faulty[:, 0]) == pytest.approx(50 * 5e-6, rel=0.11)


def test_instants_one_by_one_are_as_all_at_once():
    text = "fish_pressure:stuck@1-4,accel_y:open@2,excitation:low@3-5"
    faults = TerminalFaults(parse_faults(text), RIG, CHANNELS)
    volts = np.add.outer(TIME, np.arange(6.0))
    one_by_one = [faults.apply(t, v) for t, v in zip(TIME.tolist(), volts, strict=True)]
    np.testing.assert_array_equal(one_by_one, with_faults(text))
