# SPDX-License-Identifier: Apache-2.0
"""Names, types and quality of service of the graph stand once, in names, topics and services."""

from __future__ import annotations

import ast
import functools
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from towtank_node import names, services, topics
from towtank_node.endpoints import qos_profile
from towtank_node.qos import LATCHED, RELIABLE, SENSOR
from towtank_node.services import Service
from towtank_node.topics import Topic

ROOT = Path(__file__).resolve().parents[4]
SOURCES = ("ros_ws/src", "tests", "bags", "firmware", "hardware", "studies")
HERE = ("names.py", "topics.py", "services.py", "qos.py", Path(__file__).name)

STRANGERS = {
    "tests/test_whole_trial.py": "reads a bag with other software, as its users do by these names",
    "tests/test_disturbed_trial.py": "its stranger knows nothing of the graph's own modules",
    "tests/test_hostile_environment.py": "reads a bag with other software",
}
"""Files that write names out, and why."""

JOINT_WORDS = {
    "towtank_bringup/cli.py": "the verb `towtank crank`",
    "towtank_bringup/verbs/crank.py": "the verb `towtank crank`",
    "towtank_bringup/verbs/uncertainty.py": "a key of its JSON",
    "towtank_daq/doctor.py": "the checks' subjects",
}
"""Files in which the word for a joint means something else."""

JOINTS = {names.CRANK_JOINT, names.CARRIAGE_JOINT}
DEFINED = [each for each in vars(topics).values() if isinstance(each, Topic)]
ABSOLUTE = {each for each in DEFINED if each.name.startswith("/")}
SERVICES = [each for each in vars(services).values() if isinstance(each, Service)]
_NAME = re.compile(rf"^~/|^/?({names.MEASURED}|{names.TWIN}|{names.PLANT})/")


def python_files() -> list[Path]:
    found = [path for folder in SOURCES for path in (ROOT / folder).rglob("*.py")]
    assert len(found) > 300
    return [path for path in found if path.name not in HERE]


@functools.cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


def constants(tree: ast.AST) -> Iterator[ast.Constant]:
    """All strings of a module but the docstrings, and those that stand alone."""
    idle = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in idle:
            yield node


def findings(path: Path) -> Iterator[str]:
    tree = tree_of(path)
    written_out = {each.name for each in DEFINED + SERVICES if "/" in each.name}
    written_out |= {each.type_name for each in ABSOLUTE} - {"std_msgs/msg/String"}
    written_out |= {f"/{each.name}" for each in DEFINED if "/" not in each.name}  # of f-strings
    # The others are plain words; a heave ratio is a part of results, too
    relative = {each.name for each in DEFINED if "_" in each.name} - {topics.HEAVE_RATIO.name}
    for node in constants(tree):
        text = node.value
        if text in written_out | relative or _NAME.match(text):
            yield f"line {node.lineno}: '{text}'"
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func).rpartition(".")[2]
            if called in ("QoSProfile", "Qos"):
                yield f"line {node.lineno}: a quality of service of its own"
            yield from (
                f"line {k.value.lineno}: frame {ast.unparse(k.value)}"
                for k in node.keywords
                if k.arg in ("frame_id", "child_frame_id") and isinstance(k.value, ast.Constant)
            )
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant):
            for target in node.targets:
                if isinstance(target, ast.Attribute) and target.attr.endswith("frame_id"):
                    yield f"line {node.lineno}: frame {node.value.value!r}"


def test_no_name_of_the_graph_is_written_out_elsewhere():
    found = {
        str(path.relative_to(ROOT)): each
        for path in python_files()
        if path.name != "endpoints.py" and (each := list(findings(path)))
    }
    strange = {place: found.pop(place, None) for place in STRANGERS}
    assert not found, "take these from towtank_node"
    assert all(strange.values()), "a file needs no exception any more"


def test_no_joint_is_named_elsewhere():
    graph = re.compile(r"ros_ws/src/(towtank_(?:node|bag|daq|sim|compare|bringup)/.*)")
    excused = set()
    for path in python_files():
        match = graph.match(str(path.relative_to(ROOT)))
        words = {node.value for node in constants(tree_of(path))} & JOINTS
        if match and words and "/test/" not in str(path):
            place = match[1].split("/", 1)[1]
            assert place in JOINT_WORDS, f"{place}: take {words} from towtank_node.names"
            excused.add(place)
    assert excused == set(JOINT_WORDS)


def test_every_topic_of_the_graph_is_recorded_once():
    assert len(topics.TRIAL) == len({topic.name for topic in topics.TRIAL})
    assert set(topics.TRIAL) == ABSOLUTE


def test_every_topic_has_a_publisher():
    """By its own name, or by the family that it belongs to; nothing else is published."""
    published = set()
    for path in (ROOT / "ros_ws/src").rglob("*.py"):
        if "/test/" in str(path):
            continue
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Call) and "publisher" in ast.unparse(node.func):
                published |= set(re.findall(r"\b[A-Z][A-Z_]+\b", ast.unparse(node)))
    told = [
        each for name, each in vars(topics).items() if isinstance(each, Topic) and name in published
    ]
    families = {(f"/{each.name}", each.type_name) for each in told}
    without = {
        topic.name
        for topic in ABSOLUTE - set(told)
        if not any(topic.name.endswith(end) and topic.type_name == of for end, of in families)
    }
    assert not without


@pytest.mark.parametrize("each", [*topics.TRIAL, *SERVICES], ids=lambda each: each.name)
def test_types_are_there(each):
    package, kind, name = each.type_name.split("/")
    assert each.type.__name__ == name
    assert each.type.__module__.startswith(f"{package}.{kind}.")
    assert kind == ("msg" if isinstance(each, Topic) else "srv")


def test_a_topic_lies_within_places_or_below_a_node():
    depth = Topic("depth", "towtank_interfaces/msg/Depth", SENSOR)
    assert depth.within("measured", "fish").name == "/measured/fish/depth"
    assert depth.of("/plant/bench").name == "/plant/bench/depth"
    assert depth.of("~").name == "~/depth"
    assert depth.within("twin") == Topic("/twin/depth", depth.type_name, SENSOR)
    assert names.split_name("/measured/fish/imu") == ("/measured/fish", "imu")
    assert names.split_name("/recorder") == ("/", "recorder")


@pytest.mark.parametrize("qos", [SENSOR, RELIABLE, LATCHED])
def test_a_profile_keeps_the_last_messages(qos):
    profile = qos_profile(qos)
    assert profile.history.name == "KEEP_LAST"
    assert profile.depth == qos.depth
    assert profile.reliability.name.lower() == qos.reliability
    assert profile.durability.name.lower() == qos.durability


def test_names_need_no_ros():
    """Neither rclpy nor a message: bags are read, and an emergency stop is given, without."""
    code = (
        "import sys; from towtank_node import names, topics, services, qos; "
        "sys.exit(sorted({'rclpy', 'numpy', 'towtank_interfaces'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
