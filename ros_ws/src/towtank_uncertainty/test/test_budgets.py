# SPDX-License-Identifier: Apache-2.0
"""Uncertainty budgets: worked examples with known answers, and what must cancel."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from towtank_rig import load_rig
from towtank_rig.loading import replaced
from towtank_rig.quantity import NORMAL_95
from towtank_uncertainty.depth_budget import OperatingPoint, amplitude_noise, depth_budget
from towtank_uncertainty.error_terms import AXES
from towtank_uncertainty.inclination_budget import inclination_budget
from towtank_uncertainty.ratio_budget import ratio_relative_uncertainty

RIG = load_rig(Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml")
BARE = replaced(RIG, {"calibrations": {}})
SENSORS = ("fish_pressure", "depressor_pressure")
AT = OperatingPoint(mean_depth=1.2, amplitude=0.05, speed=1.0)


def errors_of(sensor, errors):
    """Return the changes that make every error of a sensor zero but for the given ones."""
    given = getattr(RIG.sensors, sensor).errors
    changes = {}
    for name in type(given).model_fields:
        value, unit = errors.get(name, 0.0), getattr(given, name).unit
        value = value if unit == "1" else f"{value} {unit}"
        changes[f"sensors.{sensor}.errors.{name}"] = {"value": value}
    return changes


def only(rig, errors):
    """Return the rig in exact water with only the given errors of both pressure sensors."""
    fish, depressor = (errors_of(sensor, errors) for sensor in SENSORS)
    water = {"water.density": "1000 kg/m^3", "water.gravity": "9.8 m/s^2"}
    return replaced(rig, {**fish, **depressor, **water})


def level_errors(**errors):
    """Return the rig without calibration and with only the given accelerometer errors."""
    return replaced(BARE, errors_of("accelerometer", errors))


def components(budget):
    return {component.name: component for component in budget.components}


def test_span_tolerance_alone_reproduces_the_thesis():
    # P. P. Lalu's thesis, appendix III: span 80 ± 1 mV, so 1/80 of 21.56 kPa (2.2 m) is 0.2695 kPa,
    # 27.5 mm; it prints 2.74 cm. A tolerance is a limit, √3 standard uncertainties.
    rig = replaced(only(BARE, {"span": 1 / 80}), {"sensors.fish_pressure.span": 0.080})
    budget = depth_budget(rig, "fish_pressure", OperatingPoint(2.2, 0.05, 1.0))
    assert math.sqrt(3) * budget.depth == pytest.approx(0.2695e3 / 9800, rel=1e-12)
    assert math.sqrt(3) * budget.depth == pytest.approx(0.0274, abs=2e-4)


def test_two_uncalibrated_spans_alone_make_3_percent_of_the_ratio():
    # 40 ± 1.5 mV each: √2 · 3.75 % / √3 = 3.06 %, standard.
    fish, depressor = (depth_budget(only(BARE, {"span": 0.0375}), s, AT) for s in SENSORS)
    assert ratio_relative_uncertainty(fish, depressor) == pytest.approx(
        math.sqrt(2 / 3) * 0.0375, rel=1e-12
    )


def test_two_spans_calibrated_to_half_a_percent_make_0_7_percent_of_the_ratio():
    rig = only(RIG, {})
    fish, depressor = (depth_budget(rig, sensor, AT) for sensor in SENSORS)
    # Both at the 95 % level: √2 · 0.5 %.
    expanded = NORMAL_95 * ratio_relative_uncertainty(fish, depressor)
    assert expanded == pytest.approx(math.sqrt(2) * 0.005, rel=1e-12)


def test_shared_errors_scale_amplitudes_and_cancel_in_the_ratio():
    rig = replaced(
        only(BARE, {"reference_ratio": 0.01}),
        {
            "water.density": {"value": "1000 kg/m^3", "range": [990, 1010]},
            "water.gravity": {"value": "9.8 m/s^2", "range": [9.7, 9.9]},
        },
    )
    fish, depressor = (depth_budget(rig, sensor, AT) for sensor in SENSORS)
    parts = (0.01, 0.01, 0.1 / 9.8)
    assert fish.gain == pytest.approx(math.hypot(*parts) / math.sqrt(3), rel=1e-12)
    assert ratio_relative_uncertainty(fish, depressor) == 0.0


def test_shared_error_that_only_one_sensor_has_does_not_cancel():
    # One sensor calibrated in place, which covers its reference; the other not.
    rig = only(RIG, {"reference_ratio": 0.01})
    calibration = {
        "id": "exact",
        "date": "2012-01-01",
        "span": "0.040 V",
        "offset": "0 V",
        "fitted_range": "20000 Pa",
        "span_error": 0,
    }
    rig = replaced(rig, {"calibrations": {"fish_pressure": calibration}})
    fish, depressor = (depth_budget(rig, sensor, AT) for sensor in SENSORS)
    assert "reference ratio" not in components(fish)
    assert ratio_relative_uncertainty(fish, depressor) == pytest.approx(
        0.01 / math.sqrt(3), rel=1e-12
    )


def test_zeroing_removes_offsets_and_leaves_their_drift():
    errors = {
        "offset": 0.001,
        "offset_stability": 2e-4,
        "temperature_hysteresis": 3e-4,
        "offset_temperature": 1e-5,
        "temperature_since_zeroing": 0.5,
    }
    budget = depth_budget(only(RIG, errors), "fish_pressure", AT)
    budget = replace(
        budget, components=tuple(c for c in budget.components if c.name != "calibrated span")
    )
    metres_per_volt = 50_000 / 0.040 / 9800
    offset = math.hypot(0.001, 2e-4, 3e-4) / math.sqrt(3) * metres_per_volt
    drift = 1e-5 / math.sqrt(3) * 0.5 / math.sqrt(3) * metres_per_volt
    assert budget.depth == pytest.approx(drift, rel=1e-12)
    assert budget.depth_before_zeroing == pytest.approx(math.hypot(offset, drift), rel=1e-12)
    assert budget.gain == 0.0


def test_linearity_is_felt_by_its_slope_where_the_sensor_works():
    rig = only(BARE, {"linearity": 0.0025})
    shallow = depth_budget(rig, "fish_pressure", OperatingPoint(0.0, 0.05, 0.0))
    middle = depth_budget(rig, "fish_pressure", OperatingPoint(25_000 / 9800, 0.05, 0.0))
    # Parabola of height 0.25 % of full scale: slope 4 · 0.25 % at its end, none in the middle.
    assert shallow.gain == pytest.approx(0.01 / math.sqrt(3), rel=1e-12)
    assert shallow.depth == 0.0
    assert middle.gain == pytest.approx(0.0, abs=1e-17)
    height = 0.0025 * 50_000 / 9800
    assert middle.depth == pytest.approx(height / math.sqrt(3), rel=1e-12)


def test_straight_line_fitted_over_less_takes_most_of_the_curvature():
    rig = replaced(
        only(RIG, {"linearity": 0.0025}), {"calibrations.fish_pressure.span_error": {"value": 0}}
    )
    deepest = depth_budget(rig, "fish_pressure", OperatingPoint(10_000 / 9800, 0.05, 0.0))
    # Middle of a line fitted to 20 of 50 kPa: the parabola's height shrinks by (20/50)².
    height = 0.0025 * 50_000 / 9800 * 0.4**2
    assert deepest.depth == pytest.approx(height / math.sqrt(3), rel=1e-12)


def test_flow_past_the_port():
    rig = only(RIG, {"flow_coefficient": 0.3, "surge_speed": 0.03})
    budget = depth_budget(rig, "fish_pressure", AT)
    flow, surge = components(budget)["flow pressure"], components(budget)["surge"]
    # Cp·½U²/g in depth; Cp·U·dU/g, zero expectation of both factors, in the amplitude.
    assert flow.depth == pytest.approx(0.3 / math.sqrt(3) * 0.5 / 9.8, rel=1e-12)
    oscillation = 0.3 / math.sqrt(3) * 0.03 / math.sqrt(3) / 9.8
    assert surge.gain == pytest.approx(oscillation / 0.05)
    # A depth is read at any instant of the oscillation.
    assert surge.depth == surge.absolute_depth == pytest.approx(oscillation / math.sqrt(2))
    at_rest = depth_budget(rig, "fish_pressure", replace(AT, speed=0.0))
    assert components(at_rest)["flow pressure"].depth == components(at_rest)["surge"].gain == 0.0


def test_noise_of_an_amplitude_falls_with_the_root_of_the_samples():
    budget = depth_budget(RIG, "fish_pressure", AT)
    metres_per_volt = 50_000 / 0.040 / (996.5 * 9.782)
    assert budget.noise == pytest.approx(5e-7 * metres_per_volt, rel=1e-12)
    with_board = depth_budget(RIG, "fish_pressure", AT, board_noise=1.2e-6)
    assert with_board.noise == pytest.approx(1.3e-6 * metres_per_volt, rel=1e-12)
    assert amplitude_noise(0.001, 200) == pytest.approx(0.0001, rel=1e-12)
    quiet = replace(budget, components=())
    assert quiet.amplitude(200) == pytest.approx(quiet.noise / 10, rel=1e-12)


def test_rows_list_every_component_and_the_sum():
    budget = depth_budget(RIG, "fish_pressure", AT)
    *parts, total = budget.rows()
    assert [row["name"] for row in parts] != [] and total["name"] == "combined"
    assert {row["name"] for row in parts} == set(components(budget))
    by_percent = [row["amplitude_percent"] for row in parts]
    assert by_percent == sorted(by_percent, reverse=True)
    assert total["amplitude_percent"] == pytest.approx(math.hypot(*by_percent), rel=1e-12)
    assert all(row["source"] for row in parts)


def test_amplitude_must_be_positive():
    with pytest.raises(ValueError, match="must be positive"):
        depth_budget(RIG, "fish_pressure", OperatingPoint(1.0, 0.0, 1.0))


def test_inclination_of_a_level_fish_by_hand():
    g, sensitivity = 9.782, 0.067301
    rig = level_errors(zero_g=0.005)
    # Small angle: volts over sensitivity over g. Level, the other axes do nothing at first order.
    expected = 0.005 / math.sqrt(3) / sensitivity / g
    # The difference quotient's own error is of third order: (0.0044 rad)² / 3.
    assert inclination_budget(rig).pitch == pytest.approx(expected, rel=1e-5)
    assert inclination_budget(rig).roll == pytest.approx(expected, rel=1e-5)
    rig = level_errors(alignment=0.01)
    assert inclination_budget(rig).pitch == pytest.approx(0.01 / math.sqrt(3), rel=1e-12)
    rig = level_errors(cross_axis=0.02)  # what x sees of z
    assert inclination_budget(rig).pitch == pytest.approx(0.02 / math.sqrt(3), rel=1e-4)


def test_gain_errors_of_an_accelerometer_act_only_when_pitched():
    rig = level_errors(sensitivity=0.01)
    assert inclination_budget(rig).pitch == pytest.approx(0.0, abs=1e-15)
    pitched = inclination_budget(rig, pitch=0.3)
    # d atan2(x, z) = sin θ cos θ · (dx/x − dz/z), two independent axes.
    expected = math.sqrt(2) * math.sin(0.3) * math.cos(0.3) * 0.01 / math.sqrt(3)
    assert pitched.pitch == pytest.approx(expected, rel=1e-4)


def test_calibrated_inclinometer_is_far_better_than_the_data_sheet():
    calibrated, bare = inclination_budget(RIG), inclination_budget(BARE)
    assert math.degrees(NORMAL_95 * calibrated.pitch) < 0.7
    assert math.degrees(NORMAL_95 * bare.pitch) == pytest.approx(9.9, abs=0.2)
    assert len(bare.components) == 5 * len(AXES) + 6 + 1  # couplings, supply
    assert len(calibrated.components) == 5 * len(AXES) + 1


def test_zeroing_in_the_water_leaves_the_way_from_there():
    """Gains act on the way from the place of zeroing, a bend by what it is at both ends."""
    rig = only(BARE, {"span": 0.01, "linearity": 0.0025})
    at = OperatingPoint(mean_depth=1.8, amplitude=0.05, speed=0.0, zeroed_at=1.3)
    found = components(depth_budget(rig, "fish_pressure", at))
    assert found["span"].depth == pytest.approx(0.01 / math.sqrt(3) * 0.5, rel=1e-12)
    assert found["span"].absolute_depth == pytest.approx(0.01 / math.sqrt(3) * 1.8, rel=1e-12)

    def bend(depth):
        pressure = 9800 * depth
        return 4 * 0.0025 * pressure * (50_000 - pressure) / 50_000 / 9800

    expected = (bend(1.8) - bend(1.3)) / math.sqrt(3)
    assert found["linearity"].depth == pytest.approx(expected, rel=1e-9)


def test_interval_of_one_limit_is_that_limit():
    budget = depth_budget(only(BARE, {"span": 0.01}), "fish_pressure", AT)
    assert budget.depth_u95() == pytest.approx(0.95 * 0.01 * 1.2, rel=1e-3)
    assert NORMAL_95 * budget.depth == pytest.approx(1.13 * 0.01 * 1.2, rel=1e-2)


def test_flow_and_water_make_no_error_of_the_pressure():
    rig = only(RIG, {"flow_coefficient": 0.3})
    budget = depth_budget(rig, "fish_pressure", AT)
    assert components(budget)["flow pressure"].absolute_depth > 0.0
    assert budget.head_before_zeroing == components(budget)["calibrated span"].absolute_depth


def test_polynomial_takes_the_linearity_out():
    rig = replaced(RIG, {"calibrations.fish_pressure.quadratic": "0.0001 V"})
    assert "linearity" in components(depth_budget(RIG, "fish_pressure", AT))
    assert "linearity" not in components(depth_budget(rig, "fish_pressure", AT))


def test_known_coefficient_of_temperature_leaves_its_own_range():
    """7 K above the calibration's 20 °C; 2e-4 ± 0.5e-4 per kelvin, the difference known to 1 K."""
    rig = replaced(
        RIG,
        {
            "calibrations.fish_pressure.temperature": "20 degC",
            "calibrations.fish_pressure.span_temperature": {
                "value": "2e-4 1/K",
                "range": [1.5e-4, 2.5e-4],
            },
        },
    )
    found = components(depth_budget(rig, "fish_pressure", AT))
    assert found["span's temperature coefficient"].gain == pytest.approx(7 * 0.5e-4 / math.sqrt(3))
    assert found["span over temperature"].gain == pytest.approx(2e-4 / math.sqrt(3))


def test_surge_and_carriage_tilt_the_pitch_but_not_the_roll():
    """0.03 m/s at 3 rad/s: an amplitude within 0.09 m/s², over √3 for the limit and √2 for the
    instant, over g; a carriage that speeds up by 0.5 m/s² within that, over √3."""
    rig = level_errors()
    moving = inclination_budget(rig, crank_rate=3.0, carriage_acceleration=-0.5)
    surge, carriage = moving.components[-2:]
    assert (surge.name, carriage.name) == ("surge", "carriage acceleration")
    assert surge.pitch == pytest.approx(0.09 / math.sqrt(6) / 9.782, rel=1e-4)
    assert carriage.pitch == pytest.approx(0.5 / math.sqrt(3) / 9.782, rel=1e-3)
    assert surge.roll == carriage.roll == 0.0


def test_covariance_of_the_specific_force():
    """A level fish: zeros act on their own axes; the sensitivity of z on z, that feels g."""
    rig = level_errors(zero_g=0.005, sensitivity=0.01)
    covariance = inclination_budget(rig).force_covariance
    zero = 0.005 / math.sqrt(3) / 0.067301
    assert covariance[0, 0] == pytest.approx(zero**2, rel=1e-9)
    # A sensitivity that is 1 % off one way or the other is not quite symmetric in what it reads
    assert covariance[2, 2] == pytest.approx(zero**2 + (0.01 / math.sqrt(3) * 9.782) ** 2, rel=1e-4)
    assert covariance[0, 1] == pytest.approx(0.0, abs=1e-12)


def test_supply_moves_all_axes_together():
    """Of a level fish, zeros of 1.65 V on x, y and z alike, and z's gravity besides."""
    budget = inclination_budget(level_errors(supply_ratio=0.0015))
    slip = 0.0015 / math.sqrt(3)
    zero = slip * 1.65 / 0.067301
    assert budget.pitch == pytest.approx(zero / 9.782, rel=1e-3)
    assert budget.roll == pytest.approx(budget.pitch, rel=1e-3)
    along = (zero, zero, zero + slip * 9.782)
    for i, j in ((0, 0), (0, 1), (1, 2), (2, 2)):
        assert budget.force_covariance[i, j] == pytest.approx(along[i] * along[j], rel=1e-9)
    # It is no axis's own: without it, nothing is left.
    assert inclination_budget(level_errors()).pitch == 0.0
