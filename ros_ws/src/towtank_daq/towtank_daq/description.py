# SPDX-License-Identifier: Apache-2.0
"""The ADC board as `board.yaml` describes it: channels, analog front ends, wire.

The firmware is built from the same file; its hash tells whether both sides have the same one. Only
what the host needs is read here, the hash covers all of it.
"""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import Literal

from ament_index_python.packages import get_package_share_directory
from pydantic import BaseModel, Field, PrivateAttr, ValidationError
from towtank_rig.conversion import Channel

from towtank_daq.schema_hash import load_board, schema_hash


class DescriptionError(Exception):
    """board.yaml is not what this driver can work with; one line."""


class _Limits(BaseModel):
    minimum: int
    maximum: int
    default: int


class _Microcontroller(BaseModel):
    tick_hz: int = Field(gt=0)


class _Sampling(BaseModel):
    rate_hz: _Limits


class _FilterType(BaseModel):
    code: int
    order: int = Field(gt=0)


class _Filter(BaseModel):
    type: str
    types: dict[str, _FilterType]
    dead_cycles: int = Field(ge=0)
    fs: _Limits


class _Setup(BaseModel):
    bipolar: bool
    pga: int = Field(gt=0)
    reference: Literal["refin1", "internal", "avdd"]


class _Adc(BaseModel):
    master_clock_hz: int = Field(gt=0)
    internal_reference_volts: float = Field(gt=0)
    supply_volts: float = Field(gt=0)
    buffer_headroom_volts: float = Field(ge=0)
    refin1_per_excitation: float = Field(gt=0)
    filter: _Filter
    setups: dict[str, _Setup]


class _Input(BaseModel):
    name: str
    negative: str
    setup: str
    gain: float
    output_reference_volts: float
    pole_hz: float = Field(gt=0)
    noise_volts: float = Field(ge=0)


class _SelfTestSlot(BaseModel):
    name: str
    setup: str


class _Range(BaseModel):
    minimum: float
    maximum: float


class _SelfTest(BaseModel):
    slots: list[_SelfTestSlot]
    accelerometer: list[str]
    limits: dict[str, _Range]


class _Drive(BaseModel):
    speed_rpm: _Range
    ramp_rpm_per_s: float = Field(gt=0)
    command_timeout_s: float = Field(gt=0)


class _Eeprom(BaseModel):
    board_serial: int
    calibration_id: int
    identity_checksum: int


class _Crc(BaseModel):
    initial: int


class _Wire(BaseModel):
    crc16: _Crc
    baud: int = Field(gt=0)
    maximum_payload: int = Field(gt=0, le=252)
    response_bit: int


class BoardDescription(BaseModel):
    """The contents of board.yaml; read it with `load_description`."""

    protocol: int
    """Number under which framing and `identify` never change."""
    microcontroller: _Microcontroller
    sampling: _Sampling
    adc: _Adc
    channels: list[_Input] = Field(min_length=1, max_length=8)
    self_test: _SelfTest
    drive: _Drive
    eeprom: _Eeprom
    wire: _Wire
    status: dict[str, int]
    board_state: dict[str, int]
    configuration_origin: dict[str, int]
    drive_state: dict[str, int]
    drive_trip: dict[str, int]
    drive_action: dict[str, int]
    data_flags: dict[str, int]
    adc_error: dict[str, int]
    identity_state: dict[str, int]
    reset_cause: dict[str, int]

    _hash: int = PrivateAttr(default=0)

    @property
    def schema_hash(self) -> int:
        """Hash of the whole file's meaning, as the firmware reports it."""
        return self._hash

    @property
    def channel_names(self) -> list[str]:
        """Channels in the order of the scan."""
        return [channel.name for channel in self.channels]

    def adc_channel(self, name: str, excitation_volts: float, gain: int | None = None) -> Channel:
        """Front end and ADC of one channel, for converting its codes.

        excitation_volts: the nominal excitation, from which a ratiometric reference derives.
        gain: the ADC's, where the board is configured otherwise than board.yaml says.
        """
        channel = self.channels[self.channel_names.index(name)]
        setup = self.adc.setups[channel.setup]
        references = {
            "refin1": excitation_volts * self.adc.refin1_per_excitation,
            "internal": self.adc.internal_reference_volts,
            "avdd": self.adc.supply_volts,
        }
        # Measured against its own output reference, an amplifier's output has no offset
        against_ground = channel.negative == "AVSS"
        return Channel(
            gain=channel.gain,
            offset=channel.output_reference_volts if against_ground else 0.0,
            reference_volts=references[setup.reference],
            bipolar=setup.bipolar,
            pga=float(setup.pga if gain is None else gain),
        )

    def terminal_noise(self, name: str, excitation_volts: float) -> float:
        """Standard deviation of one conversion of a channel, V at the terminals.

        By front end and converter, the steps of its code included; the sensor's comes on top.
        """
        channel = self.channels[self.channel_names.index(name)]
        steps = self.adc_channel(name, excitation_volts).resolution / math.sqrt(12.0)
        return math.hypot(channel.noise_volts / channel.gain, steps)


def installed_description() -> Path:
    """Where the installed package keeps board.yaml."""
    return Path(get_package_share_directory("towtank_daq")) / "protocol" / "board.yaml"


@lru_cache
def load_description(path: Path | str) -> BoardDescription:
    """Read and check board.yaml, once in a process: that takes 0.1 s. Raises DescriptionError,
    OSError."""
    document = load_board(path)
    try:
        description = BoardDescription.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise DescriptionError(f"{path}: {where}: {first['msg']}") from error
    description._hash = schema_hash(document)
    return description
