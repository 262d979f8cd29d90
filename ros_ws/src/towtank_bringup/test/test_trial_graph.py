# SPDX-License-Identifier: Apache-2.0
"""The graph description, and that the launch file is made of it and of nothing else."""

from __future__ import annotations

import importlib.util
import os
import sys
import types
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_share_directory
from towtank_bringup.graph import Program, RosNode
from towtank_bringup.plan import PlanError, plan_trial
from towtank_bringup.processes import command_of


@pytest.fixture
def firmware(monkeypatch, tmp_path):
    monkeypatch.setenv("TOWTANK_FIRMWARE", str(tmp_path))
    return tmp_path


def planned_graph(tmp_path, **wishes):
    return plan_trial(rig="nit_calicut_2012", runtime=tmp_path, out=tmp_path / "o", **wishes).graph


def test_names_are_unique_and_executables_installed(firmware, tmp_path):
    graph = planned_graph(tmp_path)
    names = [item.full_name for item in graph]
    assert len(names) == len(set(names))
    for item in graph:
        if isinstance(item, RosNode):
            assert os.access(command_of(item)[0], os.X_OK), item.full_name


def test_real_board_runs_the_same_measurement_without_the_virtual_tank(firmware, tmp_path):
    port = tmp_path / "ttyACM0"
    port.touch()
    virtual, real = planned_graph(tmp_path), planned_graph(tmp_path, port=port)
    assert {item.full_name for item in virtual} - {item.full_name for item in real} == {
        "virtual_board",
        "/plant/simulator",
        "/plant/bench",
    }
    board = next(item for item in real if item.full_name == "/measured/adc_board")
    assert board.parameters["port"] == str(port)


def test_parameters_are_passed_as_yaml(firmware, tmp_path):
    node = RosNode("towtank_sim", "twin", "/twin", "simulator", {"rig": "/a b/r.yaml", "n": 3})
    command = command_of(node)
    assert 'rig:="/a b/r.yaml"' in command
    assert "n:=3" in command
    assert "__ns:=/twin" in command


def test_missing_port_is_named(firmware, tmp_path):
    with pytest.raises(PlanError, match=r"port .*ttyUSB9 does not exist"):
        planned_graph(tmp_path, port=tmp_path / "ttyUSB9")


class _Recorded:
    """Stands in for a launch action: keeps what it was made with."""

    def __init__(self, *positional, **keywords):
        self.positional, self.keywords = positional, keywords


@pytest.fixture
def launch_file(monkeypatch):
    """The launch file, loaded with stand-ins for launch and launch_ros, which no wheel has."""

    def module(name, *classes):
        made = types.ModuleType(name)
        for each in classes:
            setattr(made, each, type(each, (_Recorded,), {}))
        monkeypatch.setitem(sys.modules, name, made)
        return made

    module("launch", "LaunchContext", "LaunchDescription")
    module(
        "launch.actions", "DeclareLaunchArgument", "ExecuteProcess", "OpaqueFunction", "Shutdown"
    )
    substitutions = module("launch.substitutions", "LaunchConfiguration")
    substitutions.LaunchConfiguration.perform = lambda self, context: context[self.positional[0]]
    module("launch_ros")
    module("launch_ros.actions", "LifecycleNode", "Node")
    share = Path(get_package_share_directory("towtank_bringup"))
    spec = importlib.util.spec_from_file_location("trial_launch", share / "launch/trial.launch.py")
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def test_launch_file_starts_exactly_the_graph_and_the_conductor(firmware, tmp_path, launch_file):
    context = {name: default for name, (default, _) in launch_file.ARGUMENTS.items()}
    *actions, conductor = launch_file.trial({**context, "out": str(tmp_path / "o")})
    graph = planned_graph(tmp_path)
    assert len(actions) == len(graph)
    for action, item in zip(actions, graph, strict=True):
        if isinstance(item, Program):
            assert type(action).__name__ == "ExecuteProcess"
            assert action.keywords["cmd"][0] == item.command[0]
        else:
            assert type(action).__name__ == ("LifecycleNode" if item.lifecycle else "Node")
            assert action.keywords["namespace"] == item.namespace
            assert action.keywords["executable"] == item.executable
            assert list(action.keywords["parameters"][0]) == list(item.parameters)
    assert conductor.keywords["executable"] == "conduct"
    assert str(tmp_path / "o") in conductor.keywords["arguments"]
