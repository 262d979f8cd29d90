# SPDX-License-Identifier: Apache-2.0
"""YAML text of a rig as a tree that knows where in the text each value stands.

The tree gives plain Python data to validate, the line of a dotted path, and changed copies of the
text in which everything else, comments too, stays as it was.
"""

import json
import re
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

from yaml.error import MarkedYAMLError
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from yaml.reader import ReaderError

from towtank_rig.errors import RigError
from towtank_rig.yaml_nodes import compose, scalar_value

Key = str | int

_BYTE_ORDER_MARK = "\ufeff"


def keys(path: str) -> list[Key]:
    """Return the keys of a dotted path; digits are places in a list."""
    return [int(key) if key.isdigit() else key for key in path.split(".") if key]


class Document:
    """The YAML text of a rig. ``data`` is what it holds, in dicts, lists, strings and numbers."""

    def __init__(self, text: str, source: str) -> None:
        """Read ``text``; ``source`` names it in errors.

        Raises:
            RigError: not YAML, no mapping at its top, a key twice or of no text, or an alias.
        """
        self.text = text
        self.source = source
        self._root = self._compose()
        self.data: dict[str, Any] = self._plain(self._root, seen=set())

    def __eq__(self, other: object) -> bool:
        same_kind = isinstance(other, Document)
        return same_kind and (self.text, self.source) == (other.text, other.source)

    __hash__ = None  # like the rig that holds it, compared but never a key

    def line(self, path: Sequence[Key]) -> int:
        """Return the line (from 1) of the deepest key of ``path`` that the text has."""
        node, line = self._root, self._root.start_mark.line
        for key in path:
            place = _place(node, key)
            if place is None:
                break
            at, node = place
            line = at.start_mark.line
        return line + 1

    def replaced(self, changes: Mapping[str, object]) -> str:
        """Return the text with other values at dotted paths.

        A number takes the place of a quantity's value only, with the unit that stands there.
        A key that is not there yet is added to its section.

        Raises:
            RigError: the parents of a path are not there, or one change lies within another.
        """
        edits = sorted(self._edit(path, new) for path, new in changes.items())
        text = self.text.removeprefix(_BYTE_ORDER_MARK)  # no place in the text counts it
        mark = self.text[: len(self.text) - len(text)]
        intact = len(text)
        for start, end, new, path in reversed(edits):
            if end > intact:
                what = "another change lies within this one"
                raise RigError(self.source, None, path, what, "make one after the other")
            text = text[:start] + new + text[end:]
            intact = start
        return mark + text

    def _edit(self, path: str, new: object) -> tuple[int, int, str, str]:
        """Return begin and end of the text to replace, the new text, and the path."""
        *parents, last = keys(path) or [""]
        node: Node = self._root
        for key in parents:
            place = _place(node, key)
            if place is None:
                raise self._no_such_key(path)
            node = place[1]
        place = _place(node, last)
        if place is not None:
            return *self._value_edit(place[1], new), path
        if isinstance(node, MappingNode) and node.value and isinstance(last, str):
            return *self._key_edit(node, last, new), path
        raise self._no_such_key(path)

    def _compose(self) -> MappingNode:
        try:
            root = compose(self.text)
        except MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line = mark.line + 1 if mark else None
            raise self._not_yaml(line, error.problem or error.context) from None
        except ReaderError as error:
            line = self.text.count("\n", 0, error.position) + 1
            code = f"U+{error.character:04X}"
            raise self._not_yaml(line, f"character {code}: {error.reason}") from None
        if not isinstance(root, MappingNode):
            what = "not a rig: the file holds no mapping"
            raise RigError(self.source, 1, "", what, "begin with 'name:' and the sections")
        return root

    def _not_yaml(self, line: int | None, problem: object) -> RigError:
        what = f"not valid YAML ({problem})"
        return RigError(self.source, line, "", what, "correct the YAML syntax")

    def _no_such_key(self, path: str) -> RigError:
        return RigError(self.source, None, path, "no such key in the rig", "correct the path")

    def _plain(self, node: Node, seen: set[int]) -> Any:
        line = node.start_mark.line + 1
        if id(node) in seen:
            # An alias would make one change of a value a change in two places.
            anchor = re.search(r"&[^\s,\[\]{}]+", self.text[node.start_mark.index :])
            what = f"alias of {anchor[0] if anchor else 'this'} is not accepted"
            raise RigError(self.source, line, "", what, "write the values out in both places")
        seen.add(id(node))
        if isinstance(node, SequenceNode):
            return [self._plain(item, seen) for item in node.value]
        if isinstance(node, MappingNode):
            data: dict[str, Any] = {}
            for key, value in node.value:
                line = key.start_mark.line + 1
                if not isinstance(key, ScalarNode):
                    what = "a list or a mapping is no key"
                    raise RigError(self.source, line, "", what, "give the section a name")
                if key.value in data:
                    what = f"key {key.value!r} stands twice in one section"
                    raise RigError(self.source, line, "", what, "name each key once")
                data[key.value] = self._plain(value, seen)
            return data
        try:
            return scalar_value(node)
        except ValueError as error:
            raise RigError(self.source, line, "", str(error), "correct the value") from None

    def _value_edit(self, node: Node, new: object) -> tuple[int, int, str]:
        text = _on_one_line(new)
        if isinstance(new, Real) and not isinstance(new, bool):
            value = _place(node, "value")
            if value is not None:
                return self._value_edit(value[1], new)
            _, blank, unit = str(node.value).strip().partition(" ")
            if isinstance(node, ScalarNode) and blank:
                text = f"{float(new)!r} {unit}"
        start, end = node.start_mark.index, node.end_mark.index
        # The end of a block collection lies at the next key: keep the lines between.
        old = self.text.removeprefix(_BYTE_ORDER_MARK)[start:end]
        # A key without a value has its end there.
        return start, start + len(old.rstrip()), text if old else f" {text}"

    def _key_edit(self, node: MappingNode, key: str, new: object) -> tuple[int, int, str]:
        first = node.value[0][0].start_mark
        between = ", " if node.flow_style else "\n" + " " * first.column
        text = f"{key}: {_on_one_line(new)}{between}"
        return first.index, first.index, text


def _place(node: Node, key: Key) -> tuple[Node, Node] | None:
    """Return the node at which a child begins (its key, if it has one) and the child's own."""
    if isinstance(node, MappingNode):
        found = (pair for pair in node.value if str(pair[0].value) == str(key))
        return next(found, None)
    if isinstance(node, SequenceNode) and isinstance(key, int) and key < len(node.value):
        return node.value[key], node.value[key]
    return None


def _on_one_line(value: object) -> str:
    """Return a value as YAML on one line: JSON, with numpy's numbers as Python's."""
    return json.dumps(value, ensure_ascii=False, default=float)
