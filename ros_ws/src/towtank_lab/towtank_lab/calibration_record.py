# SPDX-License-Identifier: Apache-2.0
"""The dated file of a calibration, its residual plot, and a rig file that refers to it.

All are written once: a file that is there already is never touched.
"""

from __future__ import annotations

import datetime
import io
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import BinaryIO

import numpy as np
from matplotlib.figure import Figure
from ruamel.yaml import YAML
from towtank_rig import Rig, load_rig
from towtank_rig.calibration_files import BoardIdentity, CalibrationFile, parse_calibration_file
from towtank_rig.document import Document

from towtank_lab.errors import ProcedureError
from towtank_lab.procedures import Evaluation, Residuals, Row


@dataclass(frozen=True)
class Circumstances:
    """Who made a calibration, when, against what, and for how long it holds."""

    made_at: datetime.datetime
    made_by: str
    reference: str
    valid_for: datetime.timedelta
    board: BoardIdentity | None
    conditions: Mapping[str, float | str]


def make_record(
    rig: Rig, evaluation: Evaluation, rows: Sequence[Row], circumstances: Circumstances
) -> CalibrationFile:
    """Return the calibration with all that is behind it."""
    at = circumstances.made_at.astimezone(datetime.UTC).replace(microsecond=0)
    water = rig.water
    return CalibrationFile(
        id=f"{evaluation.sensor}-{at:%Y%m%dT%H%M%SZ}",
        sensor=evaluation.sensor,
        made_at=at,
        made_by=circumstances.made_by,
        software=f"towtank_lab {_software_version()}",
        rig=f"{rig.name}, sha256 {rig.sha256}",
        reference=circumstances.reference,
        board=circumstances.board,
        due=(at + circumstances.valid_for).date(),
        conditions={
            "water_density": str(water.density),
            "gravity": str(water.gravity),
            "water_temperature": str(water.temperature),
            **circumstances.conditions,
        },
        readings=tuple(rows),
        fit=evaluation.fit,
        drift=evaluation.drift,
        calibration=evaluation.section,
    )


def _software_version() -> str:
    try:
        return version("towtank_lab")
    except PackageNotFoundError:
        return "not installed"


def record_text(record: CalibrationFile) -> str:
    """Return the record as YAML; reading it back gives the same record."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False
    yaml.allow_unicode = True
    yaml.width = 100
    stream = io.StringIO()
    yaml.dump(record.model_dump(mode="json"), stream)
    text = (
        "# SPDX-License-Identifier: Apache-2.0\n"
        f"# Calibration of {record.sensor}. Written once: never edit it, calibrate anew.\n"
        + stream.getvalue()
    )
    parse_calibration_file(text, record.id)
    return text


def write_record(record: CalibrationFile, residuals: Residuals, folder: Path) -> tuple[Path, Path]:
    """Write record and residual plot into the folder, which is made; return their paths.

    Raises ProcedureError if they are there already or cannot be written.
    """
    path = folder / f"{record.id}.yaml"
    plot = path.with_suffix(".svg")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ProcedureError(f"{folder}: {error.strerror}: give another folder") from None
    figure = residual_figure(residuals, record.id)
    write_new(plot, lambda file: figure.savefig(file, format="svg", metadata={"Date": None}))
    write_new(path, lambda file: file.write(record_text(record).encode()))
    return path, plot


def write_referring_rig(rig_file: Path, record: CalibrationFile, path: Path, new: Path) -> None:
    """Write a copy of a rig file that refers to the calibration at `path`; comments stay.

    The copy is called by its file, and its other references still lead to their files. Raises
    ProcedureError if the file is there already, RigError if the copy is not sound.
    """
    # The rig file's own text: that of the loaded rig has the figures in the references' place

    document = Document(rig_file.read_text(encoding="utf-8"), str(rig_file))
    changes: dict[str, object] = {"name": new.stem}
    sections = document.data.get("calibrations")
    sections = sections if isinstance(sections, dict) else {}
    for sensor, section in sections.items():
        if isinstance(section, dict) and set(section) == {"file", "id"}:
            moved = os.path.relpath(rig_file.parent / section["file"], new.parent)
            changes[f"calibrations.{sensor}"] = {**section, "file": moved}
    reference = {"file": os.path.relpath(path, new.parent), "id": record.id}
    if sections:
        changes[f"calibrations.{record.sensor}"] = reference
    else:
        changes["calibrations"] = {record.sensor: reference}
    text = document.replaced(changes)
    write_new(new, lambda file: file.write(text.encode()))
    load_rig(new)


def residual_figure(residuals: Residuals, title: str) -> Figure:
    """Return the residuals over what was set; readings are joined in the order of their taking."""
    figure = Figure(figsize=(7.0, 3.6), layout="constrained")
    axes = figure.add_subplot()
    for name, values in residuals.curves.items():
        axes.plot(residuals.x, values, "o-", linewidth=0.8, markersize=4, label=name)
    axes.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
    axes.set_xlabel(residuals.x_label)
    axes.set_ylabel(f"reading less fit, {residuals.unit}")
    axes.set_title(title, fontsize="medium")
    if len(residuals.curves) > 1:
        axes.legend()
    if float(np.ptp(residuals.x)) > 0.0:
        axes.margins(x=0.03)
    return figure


def write_new(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a file whole or not at all, and never over another. Raises ProcedureError."""
    part = path.with_name(f".{path.name}.part")
    try:
        with part.open("wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        os.link(part, path)
    except FileExistsError:
        raise ProcedureError(f"{path} exists: give another place") from None
    except OSError as error:
        raise ProcedureError(f"{path}: {error.strerror}: give another place") from None
    finally:
        part.unlink(missing_ok=True)
