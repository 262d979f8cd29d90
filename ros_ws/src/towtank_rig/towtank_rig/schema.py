# SPDX-License-Identifier: Apache-2.0
"""The rig: everything that one rig file says, validated. Sections are in tow and instruments."""

import hashlib
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import BaseModel, PrivateAttr, TypeAdapter, ValidationError, model_validator

from towtank_rig.document import Document
from towtank_rig.instruments import Board, Calibrations, Sensors
from towtank_rig.quantity import SI, Quantity, Section, rig_fault
from towtank_rig.tow import Depressor, Fish, Length, Lines, Run, TowPoint
from towtank_rig.water_density import density_of

Temperature = Annotated[Quantity, SI("degC", ge=-3, le=50)]
Salinity = Annotated[Quantity, SI("1", ge=0, le=0.042)]


class Water(Section):
    """The water of the tank and the local gravity.

    Salinity is the absolute one, a fraction of mass. A density that the file does not give follows
    from temperature and salinity.
    """

    density: Annotated[Quantity, SI("kg/m^3", gt=0)]
    gravity: Annotated[Quantity, SI("m/s^2", gt=0)]
    temperature: Temperature
    salinity: Salinity = Quantity(value=0.0, unit="1")

    @model_validator(mode="before")
    @classmethod
    def _density_by_temperature(cls, data: Any) -> Any:
        if not isinstance(data, dict) or "density" in data or "temperature" not in data:
            return data
        try:
            temperature = _TEMPERATURE.validate_python(data["temperature"])
            salinity = _SALINITY.validate_python(data.get("salinity", "0"))
        except ValidationError:
            # Refused where temperature or salinity stand; a density amiss would only hide that
            return {**data, "density": "1000 kg/m^3"}
        return {**data, "density": density_of(temperature, salinity)}


_TEMPERATURE: TypeAdapter[Quantity] = TypeAdapter(Temperature)
_SALINITY: TypeAdapter[Quantity] = TypeAdapter(Salinity)


class Tank(Section):
    """Inner dimensions; ``depth`` is the depth of water.

    ``clearance``: of the length, what a run leaves free at both ends together. Rig files in old
    bags lack it.
    """

    length: Length
    width: Length
    depth: Length
    clearance: Annotated[Quantity, SI("m", ge=0)] = Quantity(value=2.0, unit="m")


class Rig(Section):
    """One rig. Load it with ``load_rig``; fields are the sections of the file."""

    name: str
    description: str
    water: Water
    tank: Tank
    tow_point: TowPoint
    run: Run
    lines: Lines
    depressor: Depressor
    fish: Fish
    board: Board
    sensors: Sensors
    calibrations: Calibrations = Calibrations()

    _document: Document = PrivateAttr()  # set by loading, the only place that makes rigs
    _calibration_records: dict[str, str] = PrivateAttr(default_factory=dict)  # as well

    @model_validator(mode="after")
    def _channels_exist(self) -> "Rig":
        sensors = self.sensors
        wanted = {
            "sensors.fish_pressure.channel": sensors.fish_pressure.channel,
            "sensors.depressor_pressure.channel": sensors.depressor_pressure.channel,
            "sensors.accelerometer.channels.x": sensors.accelerometer.channels.x,
            "sensors.accelerometer.channels.y": sensors.accelerometer.channels.y,
            "sensors.accelerometer.channels.z": sensors.accelerometer.channels.z,
        }
        for where, channel in wanted.items():
            if channel not in self.board.channels:
                raise rig_fault(
                    f"board.channels has no channel {channel!r}",
                    f"use one of {', '.join(self.board.channels)}",
                    at=where,
                )
        return self

    @property
    def text(self) -> str:
        """Return the YAML text from which this rig was read, to the character."""
        return self._document.text

    @property
    def source(self) -> str:
        """Return the name of the file, or what stands for it."""
        return self._document.source

    @property
    def sha256(self) -> str:
        """Return the SHA-256 of ``text`` in UTF-8, as hexadecimal digits."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def calibration_records(self) -> dict[str, str]:
        """Return the text of the calibration files that the rig refers to, by their paths."""
        return dict(self._calibration_records)

    def quantities(self) -> Iterator[tuple[str, Quantity]]:
        """Yield every quantity with its dotted path, in the order of the schema."""
        yield from _walk(self, "")

    def assumptions(self) -> dict[str, Quantity]:
        """Return the quantities with basis ``assumed`` by dotted path."""
        return {path: q for path, q in self.quantities() if q.basis == "assumed"}


def _walk(node: object, path: str) -> Iterator[tuple[str, Quantity]]:
    if isinstance(node, Quantity):
        yield path, node
    elif isinstance(node, BaseModel):
        for name in type(node).model_fields:
            yield from _walk(getattr(node, name), f"{path}.{name}" if path else name)
    elif isinstance(node, tuple):
        for index, item in enumerate(node):
            yield from _walk(item, f"{path}.{index}")
