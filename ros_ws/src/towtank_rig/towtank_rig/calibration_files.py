# SPDX-License-Identifier: Apache-2.0
"""Calibrations in files of their own, to which a rig file refers.

    calibrations:
      fish_pressure:
        file: calibrations/fish_pressure-20261125T101500Z.yaml
        id: fish_pressure-20261125T101500Z

The path is relative to the rig file. When the rig is loaded, the file's section ``calibration``
takes the reference's place in the rig's text: that text, which a recorder stores, explains itself
without the file. The file's own text, with who made it and all readings, comes along as a record.

A calibration file is written once and never edited: a new calibration is a new file.
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from towtank_rig.document import Document
from towtank_rig.errors import RigError
from towtank_rig.instruments import Calibrations
from towtank_rig.quantity import Section

SensorName = Literal["fish_pressure", "depressor_pressure", "accelerometer", "crank"]
Value = float | int | str | None


class BoardIdentity(Section):
    """The board that took the readings, as it reports itself; hexadecimal but for the version."""

    serial: str
    firmware: str
    schema_hash: str


class CalibrationFile(Section):
    """A calibration and all that is behind it.

    Attributes:
        id: Name of the calibration; the file is called by it.
        sensor: The rig's sensor.
        made_at: When it was finished, with time zone.
        made_by: Who made it.
        software: What evaluated it.
        rig: Name of the rig and SHA-256 of its text.
        reference: The instrument that the sensor was held against, with its own certificate.
        board: The board that took the readings; None if they came from a file.
        due: Day after which the calibration is out of date.
        conditions: What held while the readings were taken, by name.
        readings: All of them, raw, one row each.
        fit: Coefficients, their covariance, scatter, degrees of freedom.
        drift: Against the calibration that was in force before, or None.
        calibration: What the rig takes over, a section of its ``calibrations``.
    """

    id: str = Field(min_length=1)
    sensor: SensorName
    made_at: datetime.datetime
    made_by: str = Field(min_length=1)
    software: str
    rig: str
    reference: str = Field(min_length=1)
    board: BoardIdentity | None = None
    due: datetime.date
    conditions: dict[str, Value] = Field(default_factory=dict)
    readings: tuple[dict[str, Value], ...] = Field(min_length=2)
    fit: dict[str, Any]
    drift: dict[str, Any] | None = None
    calibration: dict[str, Any]

    def section(self, file: str) -> dict[str, Any]:
        """Return the section of the rig's calibrations, with where it comes from."""
        day = self.made_at.date().isoformat()
        origin = {"id": self.id, "date": day, "due": self.due.isoformat(), "file": file}
        return {**origin, **self.calibration}


def resolve(document: Document, folder: Path | None) -> tuple[Document, dict[str, str]]:
    """Put the sections of calibration files in the place of references to them.

    Args:
        document: A rig.
        folder: Where paths begin; None if there is no place to look.

    Returns:
        The document without references, the same one if there were none, and the text of each
        calibration file by its path as the rig gives it.

    Raises:
        RigError: a file is not there, cannot be read, or is not the one that the rig means.
    """
    sections = document.data.get("calibrations")
    changes: dict[str, object] = {}
    records: dict[str, str] = {}
    for sensor, section in sections.items() if isinstance(sections, dict) else ():
        if not _is_reference(section):
            continue
        where = f"calibrations.{sensor}"
        if folder is None:
            raise _fault(
                document, where, "refers to a file, which is not at hand", "load the rig's own file"
            )
        name = str(section["file"])
        text, record = _read(document, where, folder / name, name)
        if record.sensor != sensor or record.id != section["id"]:
            raise _fault(
                document,
                where,
                f"{name} holds {record.id} of {record.sensor}",
                "refer to the file of this id and sensor",
            )
        changes[where] = record.section(name)
        records[name] = text
    if not changes:
        return document, {}
    return Document(document.replaced(changes), document.source), records


def _is_reference(section: object) -> bool:
    return isinstance(section, Mapping) and set(section) == {"file", "id"}


def _read(document: Document, where: str, path: Path, name: str) -> tuple[str, CalibrationFile]:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise _fault(
            document,
            where,
            f"{name} cannot be read ({reason})",
            "give the path from the rig's folder",
        ) from None
    return text, parse_calibration_file(text, str(path))


def parse_calibration_file(text: str, source: str) -> CalibrationFile:
    """Read the text of a calibration file; RigError for its first fault."""
    content = Document(text, source)
    try:
        record = CalibrationFile.model_validate(content.data)
        Calibrations.model_validate({record.sensor: record.section(source)})
    except ValidationError as error:
        first = error.errors()[0]
        context = first.get("ctx", {})
        where = ".".join(map(str, first["loc"]))
        what = f"{context.get('what', first['msg'])}"
        mend = context.get("mend", "take the file as it was written")
        raise RigError(source, content.line(first["loc"]), where, what, mend) from None
    return record


def _fault(document: Document, where: str, what: str, mend: str) -> RigError:
    return RigError(document.source, document.line(where.split(".")), where, what, mend)
