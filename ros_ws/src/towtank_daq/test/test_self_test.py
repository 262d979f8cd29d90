# SPDX-License-Identifier: Apache-2.0
"""The verdict on a board's self-test."""

from dataclasses import replace

import pytest
from towtank_daq.protocol_records import SelfTestResponse
from towtank_daq.self_test import judge

# Hand values: 20 mV with gain 32 is 0.64 V of 2.5 V; AVDD/6 is 0.55 V of 2.5 V on either reference;
# 50 mV on the accelerometer are 254 200 of 2^24 codes in 3.3 V.
SOUND = SelfTestResponse(
    adc_id=0x14,
    spi_errors=0,
    conversions_missing=0,
    short_code=2**23,
    short_spread=200,
    known_voltage_code=2**23 + round(2**23 * 0.256),
    supply_code=2**23 + round(2**23 * 0.22),
    supply_on_refin1_code=2**23 + round(2**23 * 0.22),
    rest_codes=(11_000_000, 11_000_000, 15_000_000),
    deflected_codes=(10_745_800, 11_254_200, 15_254_200),
)


def test_a_sound_board(description):
    report = judge(SOUND, description)
    assert report.passed
    assert report.failures == ()
    values = {check.name: check.value for check in report.checks}
    assert values["ADC test voltage"] == pytest.approx(0.020, abs=1e-8)
    assert values["ADC noise, input shorted, peak to peak"] == pytest.approx(59.6e-6, rel=1e-3)
    assert values["ADC supply"] == pytest.approx(3.3, abs=1e-6)
    assert values["reference REFIN1"] == pytest.approx(2.5, abs=1e-6)
    assert values["accel_x deflection by its self-test"] == pytest.approx(0.05, abs=1e-7)


@pytest.mark.parametrize(
    ("fault", "finding"),
    [
        ({"spi_errors": 1}, "SPI errors: 1 (0 to 0): shorten the ADC's wires"),
        ({"conversions_missing": 56}, "conversions missing: 56 (0 to 0): check the wire SYNC"),
        ({"short_code": 2**23 + 400}, "ADC offset, input shorted: 0.000119209 V (-0.0001 to 0."),
        ({"short_spread": 700}, "ADC noise, input shorted, peak to peak: 0.000208616 V"),
        ({"known_voltage_code": 2**23}, "ADC test voltage: 0 V (0.018 to 0.022): the ADC's amp"),
        ({"supply_on_refin1_code": 2**24 - 1}, "reference REFIN1: 0 V (2.375 to 2.625): check the"),
        ({"supply_on_refin1_code": 2**23 - 1}, "reference REFIN1: 0 V"),
        ({"supply_on_refin1_code": 2**23 + 1_537_000}, "reference REFIN1: 3.00178 V"),
        ({"deflected_codes": SOUND.rest_codes[:2] + SOUND.deflected_codes[2:]}, "accel_x defl"),
    ],
)
def test_each_fault_is_named_with_its_mend(description, fault, finding):
    report = judge(replace(SOUND, **fault), description)
    assert not report.passed
    assert str(report.failures[0]).startswith(finding)


def test_a_silent_adc_is_the_only_finding(description):
    silent = SelfTestResponse(0, 0, 0, 0, 0, 0, 0, 0, (0, 0, 0), (0, 0, 0))
    (finding,) = judge(silent, description).failures
    assert str(finding).startswith("ADC answers: 0 (1 to 1): check the ADC's 3.3 V supply")
