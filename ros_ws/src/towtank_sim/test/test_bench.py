# SPDX-License-Identifier: Apache-2.0
"""The virtual bench: true states to volts, angles and bench frames."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML
from towtank_rig import load_rig
from towtank_rig.conversion import (
    accelerometer_conversion,
    carriage_encoder,
    crank_encoder,
    depth_from_pressure,
    pressure_conversion,
)
from towtank_rig.loading import replaced
from towtank_sim.bench import Bench, BenchError, TrueState
from towtank_sim.bench_frame import bench_frame
from towtank_sim.protocol_records import CHANNELS, RecordError
from towtank_uncertainty import sensor_errors

ROOT = Path(__file__).resolve().parents[4]
BOARD = ROOT / "firmware" / "protocol" / "board.yaml"
RIGS = ROOT / "hardware" / "rigs"

BOW_DOWN = 0.3  # rad, about +y
STATE = TrueState(
    time=12.0,
    crank_angle=2.5,
    carriage_position=17.25,
    fish_position=(15.0, 0.0, -0.8),
    fish_quaternion=(math.cos(BOW_DOWN / 2), 0.0, math.sin(BOW_DOWN / 2), 0.0),
    fish_velocity=(1.0, 0.0, 0.1),
    fish_angular_velocity=(0.0, 0.2, 0.0),
    specific_force=(-2.0, 0.3, 9.4),
    depressor_position=(16.0, 0.0, -1.4),
    depressor_velocity=(1.0, 0.0, -0.2),
)


@pytest.fixture(params=["nit_calicut_2012", "wu_chwang_2001"])
def rig(request):
    return load_rig(RIGS / f"{request.param}.yaml")


def make_bench(rig, errors=None):
    return Bench(rig, errors or sensor_errors.none(rig), CHANNELS)


def volts_by_channel(rig, errors=None, state=STATE):
    volts = make_bench(rig, errors).terminal_volts(state)
    return dict(zip(CHANNELS, volts.T, strict=True))


def still(state):
    """The same place without any flow past the ports."""
    zero = (0.0, 0.0, 0.0)
    return state._replace(fish_velocity=zero, fish_angular_velocity=zero, depressor_velocity=zero)


def test_ideal_volts_convert_back_to_the_depth_of_the_ports(rig):
    volts = volts_by_channel(rig, state=still(STATE))
    x, _, z = rig.sensors.fish_pressure.position.value
    # A bow-down fish carries a forward port down: z' = −x sin + z cos.
    fish_depth = 0.8 + x * math.sin(BOW_DOWN) - z * math.cos(BOW_DOWN)
    depressor_depth = 1.4 - rig.sensors.depressor_pressure.position.value[2]
    for sensor, depth in (("fish_pressure", fish_depth), ("depressor_pressure", depressor_depth)):
        pressure = pressure_conversion(rig, sensor).pressure(volts[sensor])
        assert depth_from_pressure(pressure, rig.water) == pytest.approx(depth, abs=1e-12)


def test_flow_shifts_the_pressure_by_its_coefficient(rig):
    changed = replaced(
        rig,
        {
            "sensors.fish_pressure.flow_coefficient": "0.2",
            "sensors.depressor_pressure.flow_coefficient": "-0.3",
        },
    )
    moving, standing = volts_by_channel(changed), volts_by_channel(changed, state=still(STATE))
    # The port's own speed: the origin's and that of turning about y, ω × r = 0.2·(z, 0, −x).
    x, _, z = rig.sensors.fish_pressure.position.value
    fish_speed_squared = (1.0 + 0.2 * z) ** 2 + (0.1 - 0.2 * x) ** 2
    head = 0.5 * rig.water.density.value
    for sensor, expected in (
        ("fish_pressure", 0.2 * head * fish_speed_squared),
        ("depressor_pressure", -0.3 * head * (1.0**2 + 0.2**2)),
    ):
        shift = pressure_conversion(changed, sensor).pressure(moving[sensor] - standing[sensor])
        shift = shift - pressure_conversion(changed, sensor).pressure(0.0)
        assert shift == pytest.approx(expected, rel=1e-9)


def test_a_port_above_water_feels_no_pressure(rig):
    above = still(STATE)._replace(fish_position=(0.0, 0.0, 1.0), fish_quaternion=(1, 0, 0, 0))
    volts = volts_by_channel(rig, state=above)["fish_pressure"]
    assert pressure_conversion(rig, "fish_pressure").pressure(volts) == pytest.approx(0, abs=1e-9)


def test_ideal_accelerometer_volts_convert_back_to_the_specific_force(rig):
    volts = volts_by_channel(rig)
    axes = rig.sensors.accelerometer.channels
    xyz = [volts[axes.x], volts[axes.y], volts[axes.z]]
    np.testing.assert_allclose(
        accelerometer_conversion(rig).specific_force(xyz), STATE.specific_force, atol=1e-12
    )


def test_excitation_is_seen_and_scales_the_bridges(rig):
    errors = sensor_errors.none(rig)
    low = sensor_errors.realise(rig, {}, excitation=9.5, noise_scale=0.0)
    nominal, lowered = volts_by_channel(rig, errors), volts_by_channel(rig, low)
    assert lowered["excitation"] == 9.5
    ratio = 9.5 / rig.board.excitation.value
    assert lowered["fish_pressure"] == pytest.approx(ratio * nominal["fish_pressure"], rel=1e-12)
    assert lowered["accel_z"] == nominal["accel_z"]


def test_drawn_errors_change_every_sensor_and_follow_the_seed(rig):
    ideal = make_bench(rig).terminal_volts(STATE)
    first, again, other = (
        make_bench(rig, sensor_errors.draw(rig, seed)).terminal_volts(STATE) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    sensors = slice(0, 5)  # the excitation may have no range
    assert np.all(first[sensors] != ideal[sensors])
    assert np.all(first[sensors] != other[sensors])


def test_zero_drifts_with_time_and_then_stays(rig):
    errors = sensor_errors.realise(
        rig,
        {"fish_pressure/offset over temperature": 3e-6},
        excitation=rig.board.excitation.value,
        noise_scale=0.0,
    )
    start, half, end, later = (
        volts_by_channel(rig, errors, STATE._replace(time=time))["fish_pressure"]
        for time in (0.0, 150.0, 300.0, 1000.0)
    )
    assert half - start == pytest.approx(1.5e-6, rel=1e-6)
    assert end - start == pytest.approx(3e-6, rel=1e-6)
    assert later == end


def test_many_states_at_once_equal_one_by_one(rig):
    """The offline chain hands over whole histories, the node one state at a time."""
    times = np.linspace(0.0, 400.0, 7)
    depths = np.linspace(-0.1, 1.6, 7)
    ones = np.ones(7)

    def spread(values):
        return tuple(value * ones for value in values)

    many = TrueState(
        times,
        2.5 * ones,
        17.25 * ones,
        (15.0 * ones, 0.0 * ones, -depths),
        *(spread(field) for field in STATE[4:]),
    )
    bench = make_bench(rig, sensor_errors.draw(rig, 3))
    together = bench.terminal_volts(many)
    assert together.shape == (7, 6)
    for i in range(7):
        one = STATE._replace(time=times[i], fish_position=(15.0, 0.0, -depths[i]))
        np.testing.assert_allclose(together[i], bench.terminal_volts(one), rtol=1e-14)


@pytest.mark.parametrize("direction", [1, -1])
def test_encoders_count_what_the_rig_converts_back(rig, direction):
    changed = replaced(
        rig,
        {
            "sensors.crank_encoder.direction": direction,
            "sensors.carriage_encoder.direction": direction,
        },
    )
    crank, wheel = make_bench(changed).encoder_angles(STATE)
    encoders = changed.sensors
    # The virtual board counts edges of the shaft's angle.
    crank_counts = math.floor(crank / (2 * math.pi) * encoders.crank_encoder.counts_per_revolution)
    wheel_counts = math.floor(
        wheel / (2 * math.pi) * encoders.carriage_encoder.counts_per_revolution
    )
    # An edge is at most one count away.
    crank_conversion, carriage_conversion = crank_encoder(changed), carriage_encoder(changed)
    assert crank_conversion.value(crank_counts) == pytest.approx(
        STATE.crank_angle, abs=abs(crank_conversion.per_count)
    )
    assert carriage_conversion.value(wheel_counts) == pytest.approx(
        STATE.carriage_position, abs=abs(carriage_conversion.per_count)
    )
    assert (crank > 0) == (direction > 0)


def test_other_channels_than_the_boards_are_refused(rig):
    with pytest.raises(BenchError, match=r"board\.channels"):
        Bench(rig, sensor_errors.none(rig), CHANNELS[::-1])


# ------------------------------------------------------------------------------ bench frame


def test_frame_bytes_follow_the_boards_description():
    """Decoded here field by field from the description's types, offsets counted by hand."""
    board = YAML(typ="safe").load(BOARD.read_text())
    description = board["bench"]
    volts = [0.001, 0.002, 1.1, 1.2, 2.3, 10.0]
    frame = bench_frame(7, 123_456_789_012, volts, -2.5, 108.4)
    values, offset = {}, 0
    for name, kind in description["fields"]:
        scalar, _, count = kind.partition("[")
        count = len(board[count.rstrip("]")]) if count else 1
        code, size = {"u32": ("I", 4), "i64": ("q", 8), "f64": ("d", 8)}[scalar]
        values[name] = struct.unpack_from(f"<{count}{code}", frame, offset)
        offset += count * size
    assert offset == len(frame)
    assert values == {
        "magic": (description["magic"],),
        "sequence": (7,),
        "time_ns": (123_456_789_012,),
        "terminal_volts": tuple(volts),
        "crank_angle_rad": (-2.5,),
        "carriage_angle_rad": (108.4,),
    }
    assert frame[:4] == b"TWB1"


def test_sequence_wraps_at_32_bits():
    volts = [0.0] * 6
    assert bench_frame(2**32 + 3, 0, volts, 0.0, 0.0) == bench_frame(3, 0, volts, 0.0, 0.0)


def test_a_frame_has_a_voltage_for_each_channel():
    with pytest.raises(RecordError, match="5 values in place of 6"):
        bench_frame(0, 0, [0.0] * 5, 0.0, 0.0)


def test_the_rigs_name_the_boards_channels(rig):
    assert rig.board.channels == CHANNELS
