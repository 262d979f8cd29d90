# SPDX-License-Identifier: Apache-2.0
"""What computes a study: versions of packages, and a digest of the project's own sources."""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import json
from collections.abc import Mapping
from pathlib import Path

PACKAGES = (
    *("sim_core", "towtank_compare", "towtank_rig", "towtank_sim", "towtank_study"),
    "towtank_uncertainty",
)
"""The project's packages that results depend on."""


def software() -> dict[str, str]:
    """Return what computes: versions, and a digest of all files of PACKAGES.

    Which of them a result depends on is not told apart, so that none can be forgotten.
    """
    versions = {
        name: importlib.metadata.version(name)
        for name in ("numpy", "scipy", "SALib", "pymoo", "sim_core")
    }
    return versions | {"sources": digest(folders())}


def folders() -> dict[str, Path]:
    """Return where the packages are that this process imports, by name."""
    found = {}
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        assert spec is not None and spec.origin is not None  # this package imports all of them
        found[name] = Path(spec.origin).parent
    return found


def digest(sources: Mapping[str, Path]) -> str:
    """Return the SHA-256 over names and contents of all files in folders by name."""
    total = hashlib.sha256()
    for name, folder in sorted(sources.items()):
        for path in sorted(folder.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                part = hashlib.sha256(path.read_bytes()).hexdigest()
                total.update(f"{name}/{path.relative_to(folder).as_posix()} {part}\n".encode())
    return total.hexdigest()


def software_text(versions: Mapping[str, str]) -> str:
    """Return versions as they stand in the metadata of tables."""
    return json.dumps(dict(sorted(versions.items())))
