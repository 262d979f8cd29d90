# SPDX-License-Identifier: Apache-2.0
"""The studies that come with the project can be run as they are."""

from pathlib import Path

import pytest
from towtank_rig import load_rig
from towtank_study.designs import samples
from towtank_study.evaluation import changed
from towtank_study.loading import read_document
from towtank_study.study import Optimisation
from towtank_study.tow_study import plan_tows

ROOT = Path(__file__).resolve().parents[4]
STUDIES = [
    path
    for path in sorted((ROOT / "studies").glob("*.yaml"))
    if "manoeuvre" not in read_document(path).data  # those tow something else than a rig's tow
]

# What no simulation of the tow knows: the tank's size, what only the sensors feel.
WITHOUT_EFFECT = (
    *("tank.", "run.settling_time", "water.temperature", "board.", "calibrations.", "sensors."),
)
PORT = "sensors.fish_pressure.position."


def rig_file(name: str) -> Path:
    return ROOT / "hardware" / "rigs" / f"{name}.yaml"


@pytest.mark.parametrize("path", STUDIES, ids=[path.stem for path in STUDIES])
def test_samples_are_possible_rigs(path):
    planned = plan_tows(read_document(path), rig_file)
    assert planned.file.study.name == path.stem
    if isinstance(planned.file.study.design, Optimisation):
        return  # its samples are found on the way
    for sample in samples(planned.file.study.design, planned.variables)[::7]:
        changed(planned.file.study, planned.rig, sample)  # raises what the schema refuses


@pytest.mark.parametrize(
    ("study", "rig"),
    [
        ("sensitivity_wu_chwang", "wu_chwang_2001"),
        ("sensitivity_nit_calicut", "nit_calicut_2012"),
    ],
)
def test_the_sensitivity_studies_leave_no_assumption_out(study, rig):
    path = ROOT / "studies" / f"{study}.yaml"
    parameters = plan_tows(read_document(path), rig_file).file.study.parameters
    varied = {path for parameter in parameters for path in parameter.paths}
    assumed = {
        path
        for path in load_rig(rig_file(rig)).assumptions()
        if path.startswith(PORT) or not path.startswith(WITHOUT_EFFECT)
    }
    assert len(assumed) > 30
    assert assumed <= varied
