# SPDX-License-Identifier: Apache-2.0
"""Reading rig files: YAML text in, a validated Rig or a RigError with file and line out."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent

from towtank_rig.quantity import SI
from towtank_rig.schema import Rig

Key = str | int


class RigError(Exception):
    """A fault of a rig file, one line: ``file:line: where: what; mend``.

    Attributes:
        source: File name, or what stands for it.
        line: Line counted from 1, or None if the fault has no place in the text.
        where: Dotted path of the faulty key, empty for the whole file.
        what: The fault.
        mend: What to do about it.
    """

    def __init__(self, source: str, line: int | None, where: str, what: str, mend: str) -> None:
        self.source = source
        self.line = line
        self.where = where
        self.what = " ".join(what.split())
        self.mend = " ".join(mend.split())
        place = source if line is None else f"{source}:{line}"
        subject = f" {where}:" if where else ""
        super().__init__(f"{place}:{subject} {self.what}; {self.mend}")


def load_rig(path: str | Path) -> Rig:
    """Read a rig file.

    Raises:
        RigError: the file cannot be read, is not YAML, or breaks the schema.
    """
    return parse_rig(read_rig_text(path), str(path))


def read_rig_text(path: str | Path) -> str:
    """Return the text of a rig file; RigError if it cannot be read."""
    source = str(path)
    try:
        return Path(path).read_bytes().decode("utf-8")
    except FileNotFoundError:
        raise RigError(source, None, "", "no such file", "check the path") from None
    except UnicodeDecodeError as error:
        raise RigError(
            source, None, "", f"not UTF-8 text at byte {error.start}", "save it as UTF-8"
        ) from None
    except OSError as error:
        what = f"cannot be read ({error.strerror})"
        raise RigError(source, None, "", what, "give a readable file") from None


def parse_rig(text: str, source: str = "<text>") -> Rig:
    """Make a Rig from YAML text; ``source`` names it in errors.

    Raises:
        RigError: the text is not YAML or breaks the schema (the first fault is reported).
    """
    rig, faults = validate(text, source)
    if rig is None:
        raise faults[0]
    return rig


def validate(text: str, source: str) -> tuple[Rig | None, list[RigError]]:
    """Return the rig and no faults, or None and every fault of the text in order of the file."""
    try:
        document = _read_yaml(text, source)
    except RigError as fault:
        return None, [fault]
    try:
        rig = Rig.model_validate(document)
    except ValidationError as error:
        faults = [_fault(details, document, source) for details in error.errors()]
        return None, sorted(faults, key=lambda fault: fault.line or 0)
    rig._text = text
    rig._source = source
    return rig, []


def changed_text(text: str, changes: dict[str, object], source: str) -> str:
    """Return YAML ``text`` with the values at dotted paths replaced, comments kept.

    Raises:
        RigError: a path that the text does not have.
    """
    document = _read_yaml(text, source)
    for path, new in changes.items():
        *parents, last = _keys(path) or [""]
        node: Any = document
        for key in parents:
            node = _child(node, key)
        # A missing last key is set: an optional key may be absent, and the schema judges the rest.
        if not isinstance(node, (CommentedMap, CommentedSeq)) or (
            isinstance(node, CommentedSeq) and _child(node, last) is None
        ):
            raise RigError(source, None, path, "no such key in the rig", "correct the path")
        node[last] = _changed(_child(node, last), new)
    stream = io.StringIO()
    _yaml().dump(document, stream)
    return stream.getvalue()


def _changed(old: Any, new: object) -> object:
    """Return ``new`` in the form in which ``old`` stands in the file."""
    if isinstance(new, bool) or not isinstance(new, (int, float)):
        return new
    if isinstance(old, CommentedMap) and "value" in old:
        old["value"] = _changed(old["value"], new)
        return old
    if isinstance(old, str):
        unit = old.strip().partition(" ")[2]
        return f"{float(new)!r} {unit}"
    return new


def _yaml() -> YAML:
    yaml = YAML(typ="rt")
    yaml.width = 4096  # keep flow mappings on the line they were written on
    return yaml


def _read_yaml(text: str, source: str) -> CommentedMap:
    try:
        # An alias would make one change of a value a change in two places.
        for event in _yaml().parse(text):
            if isinstance(event, AliasEvent):
                what, mend = f"alias *{event.anchor} is not accepted", "write the values out"
                raise RigError(source, event.start_mark.line + 1, "", what, mend)
        document = _yaml().load(text)
    except DuplicateKeyError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        what = str(error.problem or "duplicate key").split(" with value")[0]
        raise RigError(source, line, "", what, "name each key once") from None
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = f"not valid YAML ({error.problem or error.context})"
        line = mark.line + 1 if mark else None
        raise RigError(source, line, "", what, "correct the YAML syntax") from None
    except (YAMLError, ValueError) as error:  # ValueError: a date that no calendar has
        what = f"not valid YAML ({error})"
        raise RigError(source, None, "", what, "correct the YAML syntax") from None
    if not isinstance(document, CommentedMap):
        what = "not a rig: the file holds no mapping"
        raise RigError(source, 1, "", what, "begin with 'name:' and the sections")
    return document


def _keys(path: str) -> list[Key]:
    return [int(key) if key.isdigit() else key for key in path.split(".") if key]


def _child(node: Any, key: Key) -> Any:
    if isinstance(node, CommentedMap):
        return node.get(key)
    if isinstance(node, CommentedSeq) and isinstance(key, int) and 0 <= key < len(node):
        return node[key]
    return None


def _line(document: CommentedMap, path: Sequence[Key]) -> int:
    """Return the line (from 1) of the deepest key of ``path`` that the document has."""
    node: Any = document
    line = 0
    for key in path:
        if isinstance(node, CommentedMap) and key in node:
            line = node.lc.key(key)[0]
        elif isinstance(node, CommentedSeq) and isinstance(key, int) and key < len(node):
            line = node.lc.item(key)[0]
        else:
            break
        node = node[key]
    return line + 1


def _fault(details: ErrorDetails, document: CommentedMap, source: str) -> RigError:
    path = (*details["loc"], *_keys(details.get("ctx", {}).get("at", "")))
    what, mend = _what_and_mend(details)
    return RigError(source, _line(document, path), ".".join(map(str, path)), what, mend)


def _what_and_mend(details: ErrorDetails) -> tuple[str, str]:
    path, context = details["loc"], details.get("ctx", {})
    key = path[-1] if path else ""
    match details["type"]:
        case "rig_fault":
            return context["what"], context["mend"]
        case "missing":
            return "the key is missing", f"add '{key}: {_form(path)}'"
        case "extra_forbidden":
            known = _known_keys(path[:-1])
            return "unknown key", f"remove it or correct its name (known: {', '.join(known)})"
        case "literal_error":
            return f"{details['input']!r} is not accepted", f"use {context['expected']}"
        case "model_type" | "model_attributes_type" | "dict_type":
            return "a section is expected here", "write a mapping of keys and values"
        case "tuple_type" | "list_type":
            return "a list is expected here", "write [first, second, …]"
        case _:
            return f"{details['input']!r}: {details['msg']}", "correct the value"


def _section(path: Sequence[Key]) -> type[BaseModel] | None:
    """Return the schema's section at ``path``, None if there is a plain value."""
    section: type[BaseModel] | None = Rig
    for key in path:
        if isinstance(key, int):
            continue  # items of a list have the section that the list's own key led to
        field = _fields(section).get(key) if section else None
        section = _model_in(field.annotation) if field else None
    return section


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    models = (_model_in(argument) for argument in get_args(annotation))
    return next((model for model in models if model), None)


def _fields(section: type[BaseModel]) -> dict[str, Any]:
    return {field.alias or name: field for name, field in section.model_fields.items()}


def _known_keys(path: Sequence[Key]) -> list[str]:
    section = _section(path)
    # A quantity's unit is no key of the file: it stands with the value.
    return [key for key in _fields(section) if key != "unit"] if section else []


def _form(path: Sequence[Key]) -> str:
    """Return how the value at ``path`` is written: a number with unit, a mapping, or a value."""
    parent = _section(path[:-1])
    field = _fields(parent).get(path[-1]) if parent else None
    units = [item.unit for item in field.metadata if isinstance(item, SI)] if field else []
    if units:
        return "<number>" if units[0] == "1" else f"<number> {units[0]}"
    return "<section>" if _section(path) else "<value>"
