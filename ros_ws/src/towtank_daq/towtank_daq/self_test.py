# SPDX-License-Identifier: Apache-2.0
"""What the board found when it looked at itself, in volts, with a verdict on each.

The board only measures; the limits stand in board.yaml, with their sources.
"""

from __future__ import annotations

from dataclasses import dataclass

from towtank_daq.description import BoardDescription
from towtank_daq.protocol_records import SelfTestResponse

_FULL_SCALE = 2**23  # of a bipolar code, on either side of zero
_CLIPPED = 2**24 - 1


@dataclass(frozen=True, slots=True)
class Check:
    """One finding."""

    name: str
    value: float
    unit: str
    minimum: float
    maximum: float
    mend: str
    """What to do if it fails."""

    @property
    def passed(self) -> bool:
        return self.minimum <= self.value <= self.maximum

    def __str__(self) -> str:
        """One line for people; with the mend if it failed."""
        value = f"{self.value:.6g} {self.unit}".rstrip()
        line = f"{self.name}: {value} ({self.minimum:.6g} to {self.maximum:.6g})"
        return line if self.passed else f"{line}: {self.mend}"


@dataclass(frozen=True, slots=True)
class SelfTest:
    """The findings of one self-test."""

    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        return all(check.passed for check in self.checks)

    @property
    def failures(self) -> tuple[Check, ...]:
        return tuple(check for check in self.checks if not check.passed)


def judge(record: SelfTestResponse, board: BoardDescription) -> SelfTest:
    """The board's measurements as volts against the limits of board.yaml.

    Where the ADC does not answer, that is the only finding: there is nothing else to judge.
    """
    answers = Check(
        "ADC answers",
        float(record.adc_id != 0),
        "",
        1.0,
        1.0,
        "check the ADC's 3.3 V supply and the wires CS, SCLK, DIN and DOUT",
    )
    if not answers.passed:
        return SelfTest((answers,))
    reference = board.adc.internal_reference_volts
    setups = board.adc.setups
    limits = board.self_test.limits

    def bipolar_volts(code: int, setup: str) -> float:
        return (code - _FULL_SCALE) / _FULL_SCALE * reference / setups[setup].pga

    def limited(name: str, value: float, key: str, mend: str) -> Check:
        limit = limits[key]
        return Check(name, value, "V", limit.minimum, limit.maximum, mend)

    slots = {slot.name: slot.setup for slot in board.self_test.slots}
    supply_volts = 6.0 * bipolar_volts(record.supply_code, slots["supply"])
    checks = [
        answers,
        Check(
            "SPI errors",
            record.spi_errors,
            "",
            0,
            0,
            "shorten the ADC's wires, check their level shifters and its ground",
        ),
        Check(
            "conversions missing",
            record.conversions_missing,
            "",
            0,
            0,
            "check the wire SYNC and that DOUT reaches both pins",
        ),
        limited(
            "ADC offset, input shorted",
            bipolar_volts(record.short_code, slots["short"]),
            "short_offset_volts",
            "the ADC is damaged: replace it",
        ),
        limited(
            "ADC noise, input shorted, peak to peak",
            record.short_spread / _FULL_SCALE * reference / setups[slots["short"]].pga,
            "short_spread_volts",
            "check the ADC's supply decoupling and keep its wires from the motor's",
        ),
        limited(
            "ADC test voltage",
            bipolar_volts(record.known_voltage_code, slots["known_voltage"]),
            "known_voltage_volts",
            "the ADC's amplifier or internal reference is damaged: replace it",
        ),
        limited("ADC supply", supply_volts, "supply_volts", "check the 3.3 V regulator"),
        limited(
            "reference REFIN1",
            _refin1_volts(record, supply_volts),
            "refin1_volts",
            "check the bridges' 10 V excitation and the divider from it to REFIN1",
        ),
    ]
    limit = limits["deflection_volts"]
    axes = zip(
        board.self_test.accelerometer, record.rest_codes, record.deflected_codes, strict=True
    )
    for name, rest, deflected in axes:
        # No axis is measured against the excitation.
        per_code = board.adc_channel(name, excitation_volts=1.0).resolution
        checks.append(
            Check(
                f"{name} deflection by its self-test",
                abs(deflected - rest) * per_code,
                "V",
                limit.minimum,
                limit.maximum,
                "check the accelerometer's supply, its output and the wire to its ST pin",
            )
        )
    return SelfTest(tuple(checks))


def _refin1_volts(record: SelfTestResponse, supply_volts: float) -> float:
    """AVDD/6 was converted against both references: the codes' ratio is that of the references.

    0 where the code is clipped, as without a reference.
    """
    ratio = (record.supply_on_refin1_code - _FULL_SCALE) / _FULL_SCALE
    if record.supply_on_refin1_code >= _CLIPPED or ratio <= 0.0:
        return 0.0
    return supply_volts / 6.0 / ratio
