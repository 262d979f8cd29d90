# SPDX-License-Identifier: Apache-2.0
"""The graph description, and that the launch file is made of it and of nothing else."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import sys
import types
from pathlib import Path

import pytest
import rclpy
from ament_index_python.packages import get_package_share_directory
from hypothesis import example, given, settings
from hypothesis import strategies as st
from towtank_bringup.environment import NO_LOG_FILES
from towtank_bringup.graph import (
    ACQUISITION_RESTARTS,
    FIRMWARE_IMAGE,
    VIRTUAL_BOARD,
    NodeGroup,
    Program,
    RosNode,
    told_to_all,
)
from towtank_bringup.only_trial import DomainTaken, only_trial
from towtank_bringup.plan import PlanError, plan_trial
from towtank_bringup.processes import command_of
from towtank_bringup.rigs import rig_path
from towtank_node import names


@pytest.fixture
def firmware(monkeypatch, tmp_path):
    """What `make -C firmware` leaves, as far as planning looks at it."""
    folder = tmp_path / "firmware"
    for name in (VIRTUAL_BOARD, FIRMWARE_IMAGE):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    monkeypatch.setenv("TOWTANK_FIRMWARE", str(folder))
    return folder


def planned_graph(tmp_path, **wishes):
    return plan_trial(rig="nit_calicut_2012", runtime=tmp_path, out=tmp_path / "o", **wishes).graph


def test_names_are_unique_and_executables_installed(firmware, tmp_path):
    graph = planned_graph(tmp_path)
    for every in (
        [item.full_name for item in graph],
        [name for item in graph for name in item.node_names],
    ):
        assert len(every) == len(set(every))
    for item in graph:
        if not isinstance(item, Program):
            assert os.access(command_of(item)[1], os.X_OK), item.full_name


def test_real_board_runs_the_same_measurement_without_the_virtual_tank(firmware, tmp_path):
    port = tmp_path / "ttyACM0"
    port.touch()
    virtual, real = planned_graph(tmp_path), planned_graph(tmp_path, port=port)
    assert {item.full_name for item in virtual} - {item.full_name for item in real} == {
        "virtual_board",
        "virtual_tank",
    }
    board = next(item for item in real if item.full_name == "acquisition")
    assert board.parameters["port"] == str(port)


def test_the_virtual_board_is_that_of_the_rigs_calibrations(firmware, tmp_path):
    text = rig_path("nit_calicut_2012").read_text()
    rig = tmp_path / "rig.yaml"
    rig.write_text(
        text.replace("  sample_rate: 100 Hz\n", "  sample_rate: 100 Hz\n  calibration_id: 3\n")
    )
    planned = plan_trial(rig=str(rig), runtime=tmp_path, out=tmp_path / "o", any_calibration=True)
    (board,) = (item for item in planned.graph if item.full_name == "virtual_board")
    image = Path(board.command[board.command.index("--eeprom") + 1]).read_bytes()
    assert len(image) == 4096 and image[4:8] == b"\x03\0\0\0"
    (node,) = (item for item in planned.graph if item.full_name == "acquisition")
    assert node.parameters["any_calibration"] is True
    without = plan_trial(rig="nit_calicut_2012", runtime=tmp_path, out=tmp_path / "o").graph
    (board,) = (item for item in without if item.full_name == "virtual_board")
    assert "--eeprom" not in board.command


def test_parameters_are_passed_as_yaml(firmware, tmp_path):
    node = RosNode("towtank_sim", "twin", "/twin", "simulator", {"rig": "/a b/r.yaml", "n": 3})
    command = command_of(node)
    assert 'rig:="/a b/r.yaml"' in command
    assert "n:=3" in command
    assert "__ns:=/twin" in command


def test_nodes_of_one_process_name_themselves():
    command = command_of(NodeGroup("towtank_daq", "sensors", ("/a/b", "/c"), {"rig": "r"}))
    assert command[2:] == [*NO_LOG_FILES, "-p", 'rig:="r"']


def test_interpreter_is_named_for_a_path_with_a_blank():
    """The first line of an installed script cannot name one."""
    command = command_of(NodeGroup("towtank_daq", "sensors", ("/a",)))
    assert command[0] == sys.executable
    assert command[1].endswith("/lib/towtank_daq/sensors")


@settings(max_examples=20)  # each has a node of its own
@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0")))
@example("tow 🐟")
@example("a\\\"b: #{c}'\t\n\x7f\x85\u2028")
def test_any_text_arrives_as_a_parameter(text):
    """Through the command line and rcl's reader."""
    command = command_of(NodeGroup("towtank_daq", "sensors", ("/a",), {"rig": text}))
    context = rclpy.Context()
    rclpy.init(args=command, context=context)
    try:
        node = rclpy.create_node("reader", context=context)
        assert node.declare_parameter("rig", "").value == text
        node.destroy_node()
    finally:
        context.shutdown()


def test_missing_port_is_named(firmware, tmp_path):
    with pytest.raises(PlanError, match=r"port .*ttyUSB9 does not exist"):
        planned_graph(tmp_path, port=tmp_path / "ttyUSB9")


@pytest.mark.parametrize("missing", [VIRTUAL_BOARD, FIRMWARE_IMAGE])
def test_what_is_not_built_is_named(firmware, tmp_path, missing):
    (firmware / missing).unlink()
    with pytest.raises(PlanError, match=f"has no {missing}: .*make -C firmware"):
        planned_graph(tmp_path)


def test_a_run_beyond_the_tank_is_for_the_virtual_one(firmware, tmp_path):
    port = tmp_path / "ttyACM0"
    port.touch()
    with pytest.raises(PlanError, match="or give --beyond-tank"):
        planned_graph(tmp_path, duration=40.0)
    assert planned_graph(tmp_path, duration=40.0, beyond_tank=True)
    with pytest.raises(PlanError, match=r"lower run\.carriage_speed$"):
        planned_graph(tmp_path, duration=40.0, port=port)
    with pytest.raises(PlanError, match="leave --beyond-tank out"):
        planned_graph(tmp_path, duration=10.0, port=port, beyond_tank=True)


class _Recorded:
    """Stands in for a launch action: keeps what it was made with."""

    def __init__(self, *positional, **keywords):
        self.positional, self.keywords = positional, keywords


@pytest.fixture
def launch_file(monkeypatch):
    """The launch file, loaded with stand-ins for launch and launch_ros, which no wheel has."""
    for name, classes in {
        "launch": ["LaunchContext", "LaunchDescription"],
        "launch.actions": [
            *("DeclareLaunchArgument", "ExecuteProcess", "OpaqueFunction"),
            *("RegisterEventHandler", "SetEnvironmentVariable", "Shutdown"),
        ],
        "launch.event_handlers": ["OnProcessIO"],
        "launch.events": [],
        "launch.events.process": ["ProcessExited", "ProcessIO"],
        "launch.substitutions": ["EnvironmentVariable", "LaunchConfiguration"],
        "launch_ros": [],
        "launch_ros.actions": ["LifecycleNode", "Node"],
    }.items():
        module = types.ModuleType(name)
        for each in classes:
            setattr(module, each, type(each, (_Recorded,), {}))
        monkeypatch.setitem(sys.modules, name, module)
    sys.modules["launch.substitutions"].LaunchConfiguration.perform = lambda self, context: context[
        self.positional[0]
    ]
    share = Path(get_package_share_directory("towtank_bringup"))
    spec = importlib.util.spec_from_file_location("trial_launch", share / "launch/trial.launch.py")
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    # It holds the domain until `ros2 launch` ends, which these tests never do
    monkeypatch.setattr(loaded, "only_trial", lambda graph: contextlib.nullcontext())
    return loaded


@pytest.fixture
def launched(firmware, tmp_path, launch_file):
    """What the launch file starts with its defaults: conductor, handler, virtual board, nodes."""
    context = {name: default for name, (default, _) in launch_file.ARGUMENTS.items()}
    conductor, handler, board = launch_file.trial({**context, "out": str(tmp_path / "o")})
    on_stdout = handler.positional[0].keywords["on_stdout"]
    assert handler.positional[0].keywords["target_action"] is board
    assert on_stdout(types.SimpleNamespace(text=b"starting\n")) == []
    nodes = on_stdout(types.SimpleNamespace(text=b"ready pty=/dev/pts/1\n"))
    assert on_stdout(types.SimpleNamespace(text=b"ready once more\n")) == []
    return conductor, [board, *nodes]


def test_launch_file_starts_exactly_the_graph_and_the_conductor(launched, tmp_path):
    conductor, actions = launched
    graph = planned_graph(tmp_path)
    for action, item in zip(actions, graph, strict=True):
        if isinstance(item, Program):
            assert type(action).__name__ == "ExecuteProcess"
            assert action.keywords["cmd"][0] == item.command[0]
        else:
            lifecycle = isinstance(item, RosNode) and item.lifecycle
            assert type(action).__name__ == ("LifecycleNode" if lifecycle else "Node")
            if isinstance(item, RosNode):
                assert action.keywords["namespace"] == item.namespace
                assert action.keywords["name"] == item.name
            else:
                assert not {"namespace", "name"} & set(action.keywords)
            assert action.keywords["executable"] == item.executable
            assert list(action.keywords["parameters"][0]) == list(item.parameters)
    assert conductor.keywords["executable"] == "conduct"
    assert str(tmp_path / "o") in conductor.keywords["arguments"]


def test_launch_ends_well_with_the_conductors_good_end_only(launched):
    """And only the first end counts: the others follow from it."""
    conductor, (board, *_) = launched

    def on_exit(action, status, is_shutdown=False):
        event = types.SimpleNamespace(process_name="it", returncode=status)
        return action.keywords["on_exit"](event, types.SimpleNamespace(is_shutdown=is_shutdown))

    assert type(on_exit(conductor, 0)).__name__ == "Shutdown"
    for action, status in ((conductor, 1), (board, 0), (board, 1)):
        with pytest.raises(RuntimeError, match=f"it ended with status {status}"):
            on_exit(action, status)
        assert on_exit(action, status, is_shutdown=True) is None
    assert on_exit(conductor, 0, is_shutdown=True) is None


def test_launch_starts_acquisition_again_so_often(launched):
    _, actions = launched
    again = [action for action in actions if action.keywords.get("respawn")]
    assert [action.keywords["executable"] for action in again] == ["acquisition"]
    (board,) = again
    assert board.keywords["respawn_max_retries"] == ACQUISITION_RESTARTS
    context = types.SimpleNamespace(is_shutdown=False)
    event = types.SimpleNamespace(process_name="it", returncode=-9)
    for _ in range(ACQUISITION_RESTARTS):
        board.keywords["on_exit"](event, context)
    with pytest.raises(RuntimeError, match="it ended with status -9"):
        board.keywords["on_exit"](event, context)


def test_launch_passes_on_how_long_the_run_is_to_be(firmware, tmp_path, launch_file):
    context = {name: default for name, (default, _) in launch_file.ARGUMENTS.items()}

    def arguments(**changes):
        out = {"out": str(tmp_path / f"o{len(list(tmp_path.iterdir()))}")}
        return launch_file.trial({**context, **out, **changes})[0].keywords["arguments"]

    assert not {"--duration", "--beyond-tank"} & set(arguments())
    assert arguments(duration="10")[2:4] == ["--duration", "10"]
    assert arguments(duration="40", beyond_tank="true")[2:5] == [
        *("--duration", "40", "--beyond-tank")
    ]
    with pytest.raises(PlanError, match="needs a run of"):
        arguments(duration="40")


def test_launch_names_an_argument_that_is_no_number(firmware, tmp_path, launch_file):
    context = {name: default for name, (default, _) in launch_file.ARGUMENTS.items()}
    for name in ("duration", "seed"):
        with pytest.raises(ValueError, match=f"{name}:=soon: give a (whole )?number"):
            launch_file.trial({**context, name: "soon"})


def test_launch_refuses_a_domain_with_a_trial_in_it(firmware, tmp_path, launch_file, monkeypatch):
    monkeypatch.setattr(launch_file, "only_trial", only_trial)
    context = {name: default for name, (default, _) in launch_file.ARGUMENTS.items()}
    with only_trial((), 0.0), pytest.raises(DomainTaken):
        launch_file.trial({**context, "out": str(tmp_path / "o")})
    assert not (tmp_path / "o").exists()


def test_every_node_is_told_of_the_others_and_of_the_trials_clock(firmware, tmp_path):
    """Those that share a process with another one too."""
    graph = planned_graph(tmp_path, clock_offset_ns=7)
    for item in graph:
        if not isinstance(item, Program):
            assert item.parameters["clock_offset_ns"] == 7
            senders = item.parameters["senders"].split()
            assert {names.CONDUCTOR_NODE, names.RECORDER_NODE, names.CRANK_DRIVE_NODE} < set(
                senders
            )
            assert {name for other in graph for name in other.node_names} < set(senders)
    assert told_to_all(graph) == {"clock_offset_ns": 7, "senders": item.parameters["senders"]}
    assert told_to_all(()) == {}
