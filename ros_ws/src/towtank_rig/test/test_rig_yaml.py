# SPDX-License-Identifier: Apache-2.0
"""libyaml, which keeps to YAML 1.1, read as YAML 1.2: held against a parser of YAML 1.2."""

import math
import re
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError
from ruamel.yaml.nodes import ScalarNode
from towtank_rig import RigError
from towtank_rig.document import Document
from towtank_rig.yaml_nodes import compose

ROOT = Path(__file__).resolve().parents[4]
SHIPPED = sorted(
    path
    for folder in ("hardware/rigs", "studies", "docs")
    for path in (ROOT / folder).rglob("*.yaml")
)
RIG = ROOT / "hardware" / "rigs" / "nit_calicut_2012.yaml"


def reference(text: str):
    return YAML(typ="safe", pure=True).compose(text)


def flat(node) -> list[tuple]:
    """Every node: tag, text, and its place in lines, columns and characters."""
    begin, end = node.start_mark, node.end_mark
    place = (begin.line, begin.column, begin.index, end.line, end.column, end.index)
    if isinstance(node.value, str):
        # A date is text to us
        return [(str(node.tag).replace("timestamp", "str"), node.value, *place)]
    children = [child for each in node.value for child in (each if type(each) is tuple else [each])]
    return [(str(node.tag), None, *place), *(row for child in children for row in flat(child))]


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_file_has_the_same_nodes_in_the_same_places(path):
    text = path.read_text(encoding="utf-8")
    assert flat(compose(text)) == flat(reference(text))


NUMBER_LIKE = st.text("0123456789+-.eExob:_ ~yn", max_size=8)
WORDS = st.sampled_from(
    [
        "yes",
        "no",
        "on",
        "off",
        "true",
        "True",
        "TRUE",
        "null",
        "Null",
        ".inf",
        ".NaN",
        ".NAN",
        "=",
        "<<",
    ]
)


def core_schema_leaves_it_out(text: str) -> bool:
    """A 1.2 parser that is kinder than the specification's core schema (10.3.2): digits may be
    grouped there, and it wants a sign in an exponent behind a leading point."""
    return "_" in text or bool(re.fullmatch(r"[-+]?\.[0-9]+[eE][0-9]+", text))


@given(NUMBER_LIKE | WORDS)
@example("010")
@example("0o10")
@example("1:30")
@example("1e3")
@example("0b11")
@example("2012-01-05")
@example("685_230.15")
@example(".5e3")
@example("-.inf")
def test_plain_scalars_are_those_of_yaml_1_2(text):
    try:
        node = reference(f"key: {text}").value[0][1]
    except MarkedYAMLError:
        return
    if not isinstance(node, ScalarNode) or not node.value or node.tag.endswith(("merge", "value")):
        return
    ours = compose(f"key: {text}").value[0][1]
    assert ours.value == node.value
    if core_schema_leaves_it_out(node.value):
        assert ours.tag.endswith("float" if "_" not in node.value else "str")
    else:
        assert ours.tag.replace("timestamp", "str") == str(node.tag).replace("timestamp", "str")


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("yes", "yes"),
        ("True", True),
        ("010", 10),
        ("0o10", 8),
        ("-0x1F", -31),
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("1e3", 1000.0),
        (".5e3", 500.0),
        ("-.INF", -math.inf),
        ("~", None),
        ("", None),
        ("2012-01-05", "2012-01-05"),
        ("'1'", "1"),
        ('!!float "1"', 1.0),
        ("!!str 1", "1"),
    ],
)
def test_values_of_scalars(written, value):
    found = Document(f"key: {written}", "text").data["key"]
    assert (found, type(found)) == (value, type(value))


@pytest.mark.parametrize("number", range(1, 200, 23))
@pytest.mark.parametrize("broken", ["  key: [1, 2", "\tkey: 1", "key: a: b", "'", "- a", "{a: 1}}"])
def test_a_fault_is_reported_at_the_line_where_another_parser_finds_it(number, broken):
    lines = RIG.read_text(encoding="utf-8").splitlines()
    text = "\n".join([*lines[:number], broken, *lines[number:]])
    with pytest.raises(RigError) as caught:
        Document(text, "rig.yaml")
    with pytest.raises(MarkedYAMLError) as expected:
        reference(text)
    assert caught.value.line == expected.value.problem_mark.line + 1
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("a: é\nb: '\a'\n", 2, "U+0007"),
        ("a: 1\nb: x\u2028y\n", 2, "U+2028: write it as an escape"),
        ("a: 1\nb: \ud800\n", 2, "U+D800"),
        ("a: " + "[" * 100_000, 1, "nested deeper than 100 levels"),
        ("a: 1\n? [b]\n: 2\n", 2, "is no key"),
        ("a: 1\nb: !!int x\n", 2, "'x' is no int"),
        ("a: &x 1\nb: *x\n", 1, "alias"),
        ("a: 1\nb: 2\na: 3\n", 3, "'a' stands twice"),
        ("a: 1\n---\nb: 2\n", 2, "found another document"),
        ("", 1, "holds no mapping"),
    ],
)
def test_what_a_rig_may_not_hold_is_refused_at_its_line(text, line, words):
    with pytest.raises(RigError) as caught:
        Document(text, "rig.yaml")
    assert caught.value.line == line
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_byte_order_mark_moves_no_place():
    document = Document("\ufeffa: 1\nb: {c: 2}\n", "text")
    assert document.data == {"a": 1, "b": {"c": 2}}
    assert document.replaced({"b.c": 3}) == "\ufeffa: 1\nb: {c: 3}\n"


def test_a_key_without_a_value_is_given_one():
    assert Document("a:\nb: 2\n", "text").replaced({"a": 1}) == "a: 1\nb: 2\n"
