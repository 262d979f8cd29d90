# SPDX-License-Identifier: Apache-2.0
"""`towtank compare` says what is wrong with a bag, in the table too."""

import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner
from towtank_bringup.verbs.compare import command

REFERENCE = Path(__file__).resolve().parents[4] / "bags" / "reference"


def compare(*arguments):
    return CliRunner().invoke(command, [str(argument) for argument in arguments])


@pytest.fixture
def broken_off(tmp_path):
    bag = tmp_path / "bag"
    bag.mkdir()
    data = (REFERENCE / "reference_0.mcap").read_bytes()
    (bag / "reference_0.mcap").write_bytes(data[: len(data) * 2 // 3])
    return bag


def test_the_table_of_a_bag_that_broke_off_says_so(broken_off):
    done = compare(broken_off)
    assert done.exit_code == 0
    warning = f"warning: {broken_off}: the recording broke off; the bag is read as far as it goes"
    assert warning in done.output.splitlines()
    told = json.loads(compare(broken_off, "--json").output)
    assert warning == f"warning: {told['bag_problem']}"


def test_the_table_of_a_whole_bag_says_nothing(tmp_path):
    assert "warning: bag" not in compare(REFERENCE).output


def test_a_rig_can_be_given_by_name(broken_off):
    done = compare(broken_off, "--rig", "wu_chwang_2001")
    assert done.exit_code == 0
    assert "wu_chwang_2001: heave at the crank frequency" in done.output
    assert "note: the rig is that of" in done.output
    done = compare(broken_off, "--rig", "no_such_rig")
    assert done.exit_code == 1
    assert "no such rig file" in done.output


@pytest.mark.parametrize(
    "arguments",
    [
        (REFERENCE, "--window", "nan", "nan"),
        (REFERENCE / "reference_0.mcap",),
        (REFERENCE.parent,),
    ],
)
def test_what_gives_nothing_is_one_line(arguments):
    done = compare(*arguments)
    assert done.exit_code == 1
    assert done.output.startswith("Error: ")
    assert done.output.count("\n") == 1


def test_a_bag_of_which_a_link_is_left_is_one_line(tmp_path):
    bag = tmp_path / "bag"
    shutil.copytree(REFERENCE, bag)
    (bag / "reference_0.mcap").unlink()
    (bag / "reference_0.mcap").symlink_to("nowhere")
    done = compare(bag)
    assert done.exit_code == 1
    assert "fetch what the link names" in done.output
