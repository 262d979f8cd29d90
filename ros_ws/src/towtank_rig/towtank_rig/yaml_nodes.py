# SPDX-License-Identifier: Apache-2.0
"""YAML text as nodes with marks, by libyaml: some twenty times as fast as a parser in Python.

libyaml keeps to YAML 1.1, of which the scalars are not taken: `yes`, `010`, `1:30` and `1_000` are
what the core schema of YAML 1.2 (section 10.3.2 of its specification) makes of them.
"""

import re
from typing import Any

from yaml.cyaml import CParser
from yaml.error import MarkedYAMLError
from yaml.nodes import Node, ScalarNode
from yaml.reader import ReaderError
from yaml.resolver import BaseResolver

_DEEPEST = 100
"""Levels of nesting. libyaml would take any number, and overflow the stack."""

# Only in YAML 1.1 do these end a line.
_OTHER_LINE_BREAKS = re.compile("[\x85\u2028\u2029]")


def compose(text: str) -> Node | None:
    """Return the root of the only document of a text, None if it is empty.

    Marks count lines and columns from 0, and characters of the text, without a byte order mark.

    Raises:
        MarkedYAMLError: not YAML, at `problem_mark` or `context_mark`.
        ReaderError: a character that YAML does not have; `position` is its place in the text.
    """
    foreign = _OTHER_LINE_BREAKS.search(text)
    if foreign:
        reason = "write it as an escape in double quotes"
        raise ReaderError("", foreign.start(), ord(foreign[0]), "", reason)
    try:
        return _Parser(text).get_single_node()
    except UnicodeEncodeError as error:
        character = ord(text[error.start])
        raise ReaderError("", error.start, character, "", "half a character") from None
    except ReaderError as error:
        # libyaml has the place in UTF-8
        position = len(text.encode()[: error.position].decode(errors="ignore"))
        raise ReaderError("", position, error.character, "", error.reason) from None


def scalar_value(node: ScalarNode) -> Any:
    """Return the Python value of a scalar: None, bool, int, float or text (dates too).

    Raises:
        ValueError: a value that does not fit the tag that it was given.
    """
    text = node.value
    try:
        match node.tag:
            case "tag:yaml.org,2002:null":
                return None
            case "tag:yaml.org,2002:bool":
                return text.lower() == "true"
            case "tag:yaml.org,2002:int":
                return int(text, 10 if text.lstrip("+-").isdigit() else 0)
            case "tag:yaml.org,2002:float":
                return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
            case _:
                return text
    except ValueError:
        raise ValueError(f"{text!r} is no {node.tag.rpartition(':')[2]}") from None


class _Parser(CParser, BaseResolver):
    """libyaml's parser; it asks the resolver for the tag of each scalar, by its first character."""

    def __init__(self, text: str) -> None:
        CParser.__init__(self, text)
        BaseResolver.__init__(self)
        self._levels = 0

    def descend_resolver(self, parent: Node | None, key: Any) -> None:
        self._levels += 1
        if self._levels > _DEEPEST:
            problem = f"nested deeper than {_DEEPEST} levels"
            raise MarkedYAMLError(problem=problem, problem_mark=parent.start_mark)

    def ascend_resolver(self) -> None:
        self._levels -= 1


for _tag, _form, _first in (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    # With signs and in base 2 as well, which the core schema leaves out
    ("int", r"[-+]?([0-9]+|0b[01]+|0o[0-7]+|0x[0-9a-fA-F]+)", list("-+0123456789")),
    (
        "float",
        r"[-+]?((\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|\.(inf|Inf|INF))|\.(nan|NaN|NAN)",
        list("-+.0123456789"),
    ),
):
    _Parser.add_implicit_resolver(
        f"tag:yaml.org,2002:{_tag}", re.compile(rf"^(?:{_form})\Z"), _first
    )
