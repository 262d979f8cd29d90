# SPDX-License-Identifier: Apache-2.0
"""Finding rig files: by path, or by the name of one that comes with the project."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from towtank_rig import RigError


def rig_path(name_or_path: str) -> Path:
    """Absolute path of a rig file. RigError, naming the rigs there are, if there is none such."""
    if Path(name_or_path).is_file():
        return Path(name_or_path).resolve()
    shipped = Path(get_package_share_directory("towtank_bringup")) / "rigs"
    candidate = shipped / f"{name_or_path}.yaml"
    if candidate.is_file():
        return candidate.resolve()
    names = ", ".join(sorted(path.stem for path in shipped.glob("*.yaml")))
    raise RigError(
        name_or_path, None, "", "no such rig file", f"give a path or one of the rigs {names}"
    )
