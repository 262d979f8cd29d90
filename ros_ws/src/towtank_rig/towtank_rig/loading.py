# SPDX-License-Identifier: Apache-2.0
"""Reading rig files: YAML text in, a validated Rig or a RigError with file and line out; and quick
copies with other values."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from towtank_rig.calibration_files import resolve
from towtank_rig.document import Document, Key, keys
from towtank_rig.errors import RigError
from towtank_rig.quantity import SI, Section
from towtank_rig.schema import Rig

AnySection = TypeVar("AnySection", bound=Section)


def load_rig(path: str | Path) -> Rig:
    """Read a rig file.

    Raises:
        RigError: the file cannot be read, is not YAML, or breaks the schema.
    """
    rig, faults = validate(read_rig_text(path), str(path), Path(path).parent)
    if rig is None:
        raise faults[0]
    return rig


def read_rig_text(path: str | Path) -> str:
    """Return the text of a rig file; RigError if it cannot be read."""
    source = str(path)
    try:
        return Path(path).read_bytes().decode("utf-8")
    except FileNotFoundError:
        raise RigError(source, None, "", "no such file", "check the path") from None
    except UnicodeDecodeError as error:
        what = f"not UTF-8 text at byte {error.start}"
        raise RigError(source, None, "", what, "save it as UTF-8") from None
    except OSError as error:
        what = f"cannot be read ({error.strerror})"
        raise RigError(source, None, "", what, "give a readable file") from None


def parse_rig(text: str, source: str = "<text>") -> Rig:
    """Make a Rig from YAML text that refers to no files; ``source`` names it in errors.

    Raises:
        RigError: the text is not YAML or breaks the schema (the first fault is reported).
    """
    rig, faults = validate(text, source)
    if rig is None:
        raise faults[0]
    return rig


def load_section(path: str | Path, schema: type[AnySection]) -> AnySection:
    """Read a YAML file of another kind that is written in the manner of rig files.

    Raises:
        RigError: the file cannot be read, is not YAML, or breaks the schema (its first fault).
    """
    document = Document(read_rig_text(path), str(path))
    try:
        return schema.model_validate(document.data)
    except ValidationError as error:
        faults = [_fault(details, document, schema) for details in error.errors()]
        raise min(faults, key=lambda fault: fault.line or 0) from None


def validate(
    text: str, source: str, folder: Path | None = None
) -> tuple[Rig | None, list[RigError]]:
    """Return the rig and no faults, or None and every fault of the text in order of the file.

    ``folder`` is where the paths of calibration files begin.
    """
    try:
        document, records = resolve(Document(text, source), folder)
    except RigError as fault:
        return None, [fault]
    try:
        rig = Rig.model_validate(document.data)
    except ValidationError as error:
        faults = [_fault(details, document) for details in error.errors()]
        return None, sorted(faults, key=lambda fault: fault.line or 0)
    rig._document = document
    rig._calibration_records = records
    return rig, []


def replaced(rig: Rig, changes: dict[str, object]) -> Rig:
    """Return a copy with other values, validated like a file, with a text of its own.

    Args:
        rig: The rig to copy.
        changes: Dotted path to new value: ``{"lines.primary.length": 1.3}``. A number for a
            quantity is in its SI unit and keeps range, basis and source; a mapping or a string
            takes the quantity's place as it would stand in the file.

    Raises:
        RigError: unknown path, or a value that the schema refuses.
    """
    source = f"{rig.source.removesuffix(' (changed)')} (changed)"
    changed = parse_rig(rig._document.replaced(changes), source)
    changed._calibration_records = rig._calibration_records
    return changed


def vary(rig: Rig, values: Mapping[str, object]) -> Rig:
    """Return a copy with other values at paths that the file has, validated like a file.

    For many copies: some ten times as fast as ``replaced``, but the copy has no text of its own.

    Args:
        rig: The rig to copy.
        values: Dotted path to new value, as it would stand in the file: it takes the place of the
            whole quantity, ``{"lines.primary.length": "1.3 m"}``.

    Raises:
        RigError: unknown path, or a value that the schema refuses.
    """
    document = rig._document
    data = document.data
    for path, value in values.items():
        try:
            data = _with_value(data, keys(path), value)
        except LookupError:
            what = "no such key in the rig"
            raise RigError(rig.source, None, path, what, "correct the path") from None
    try:
        return Rig.model_validate(data)
    except ValidationError as error:
        raise _fault(error.errors()[0], document) from None


def _with_value(node: Any, path: Sequence[Key], value: object) -> Any:
    """Return a copy of a tree of dicts and lists with another value at a path that is there."""
    if not path:
        return value
    if not isinstance(node, dict | list):
        raise LookupError(path[0])
    key = path[0] if isinstance(node, list) else str(path[0])
    changed = _with_value(node[key], path[1:], value)
    if isinstance(node, dict):
        return {**node, key: changed}
    return [*node[:key], changed, *node[key + 1 :]]


def _fault(details: ErrorDetails, document: Document, schema: type[BaseModel] = Rig) -> RigError:
    path = (*details["loc"], *keys(details.get("ctx", {}).get("at", "")))
    what, mend = _what_and_mend(details, schema)
    where = ".".join(map(str, path))
    return RigError(document.source, document.line(path), where, what, mend)


def _what_and_mend(details: ErrorDetails, schema: type[BaseModel]) -> tuple[str, str]:
    path, context = details["loc"], details.get("ctx", {})
    key = path[-1] if path else ""
    match details["type"]:
        case "rig_fault":
            return context["what"], context["mend"]
        case "missing":
            return "the key is missing", f"add '{key}: {_form(path, schema)}'"
        case "extra_forbidden":
            known = _known_keys(path[:-1], schema)
            return "unknown key", f"remove it or correct its name (known: {', '.join(known)})"
        case "literal_error":
            return f"{details['input']!r} is not accepted", f"use {context['expected']}"
        case "model_type" | "model_attributes_type" | "dict_type":
            return "a section is expected here", "write a mapping of keys and values"
        case "tuple_type" | "list_type":
            return "a list is expected here", "write [first, second, …]"
        case _:
            return f"{details['input']!r}: {details['msg']}", "correct the value"


def _section(path: Sequence[Key], schema: type[BaseModel]) -> type[BaseModel] | None:
    """Return the schema's section at ``path``, None if there is a plain value."""
    section: type[BaseModel] | None = schema
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


def _known_keys(path: Sequence[Key], schema: type[BaseModel]) -> list[str]:
    section = _section(path, schema)
    # A quantity's unit is no key of the file: it stands with the value.
    return [key for key in _fields(section) if key != "unit"] if section else []


def _form(path: Sequence[Key], schema: type[BaseModel]) -> str:
    """Return how the value at ``path`` is written: a number with unit, a mapping, or a value."""
    parent = _section(path[:-1], schema)
    field = _fields(parent).get(path[-1]) if parent else None
    units = [item.unit for item in field.metadata if isinstance(item, SI)] if field else []
    if units:
        return "<number>" if units[0] == "1" else f"<number> {units[0]}"
    return "<section>" if _section(path, schema) else "<value>"
