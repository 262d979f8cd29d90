# SPDX-License-Identifier: Apache-2.0
"""Reading study files: YAML text in, a validated study or a StudyError with file and line out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails
from towtank_rig import RigError
from towtank_rig.document import Document, keys

from towtank_study.errors import StudyError
from towtank_study.study import Study

_KINDS = (
    "one_at_a_time",
    "full_factorial",
    "latin_hypercube",
    "sobol",
    "optimisation",
    "turn",
    "stop",
)
"""Tags of the unions in study files."""

Schema = TypeVar("Schema", bound=BaseModel)


@dataclass(frozen=True)
class StudyFile:
    """A study and the text that it was read from. source: the file's name."""

    study: Study
    document: Document

    @property
    def text(self) -> str:
        return self.document.text

    def error(self, where: str, what: str, mend: str) -> StudyError:
        """Return the error for a fault at a dotted path of the file."""
        line = self.document.line(keys(where))
        return StudyError(f"{self.document.source}:{line}: {where}: {what}; {mend}")


def read_document(path: str | Path) -> Document:
    """Read a YAML file; StudyError if it cannot be read or is not YAML."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise StudyError(f"{path}: {error.strerror}; check the path") from None
    except UnicodeDecodeError as error:
        raise StudyError(
            f"{path}: not UTF-8 text at byte {error.start}; save it as UTF-8"
        ) from None
    return _document(text, str(path))


def _document(text: str, source: str) -> Document:
    try:
        return Document(text, source)
    except RigError as error:
        raise StudyError(str(error)) from None


def parse_study(text: str, source: str = "<text>") -> StudyFile:
    """Make a study from YAML text; `source` names it in errors. StudyError for its first fault."""
    document = _document(text, source)
    return StudyFile(validate(document, Study), document)


def validate(document: Document, schema: type[Schema]) -> Schema:
    """Return what a document holds; StudyError for its first fault."""
    try:
        return schema.model_validate(document.data)
    except ValidationError as error:
        # A misspelt key is also a missing one: the misspelling comes first. A list whose items have
        # faults is also too short.
        order = {"extra_forbidden": 0, "too_short": 2}
        faults = [
            (order.get(details["type"], 1), *_fault(details, document))
            for details in error.errors()
        ]
        raise StudyError(min(faults)[-1]) from None


def _fault(details: ErrorDetails, document: Document) -> tuple[int, str]:
    """Return line and text of a fault."""
    context = details.get("ctx", {})
    # pydantic puts the tag of a union and the names of its variants into the path.
    location = [key for key in details["loc"] if key not in _KINDS and not _is_variant(key)]
    location += keys(str(context.get("at", "")))
    line = document.line(location)
    where = ".".join(map(str, location))
    subject = f" {where}:" if where else ""
    return line, f"{document.source}:{line}:{subject} {_what_and_mend(details, where)}"


def _is_variant(key: str | int) -> bool:
    return isinstance(key, str) and (key in ("float", "str") or "[" in key)


def _what_and_mend(details: ErrorDetails, where: str) -> str:
    context = details.get("ctx", {})
    match details["type"]:
        case "rig_fault":
            return f"{context['what']}; {context['mend']}"
        case "missing":
            return f"the key is missing; add '{where.rpartition('.')[2]}:'"
        case "extra_forbidden":
            return "unknown key; remove it or correct its name"
        case "union_tag_not_found" | "union_tag_invalid":
            expected = context.get("expected_tags", "those in the README")
            return f"no such kind; give kind: one of {expected}"
        case "literal_error":
            return f"{details['input']!r} is not accepted; use one of {context['expected']}"
        case "model_type" | "model_attributes_type" | "dict_type":
            return "a section is expected here; write a mapping of keys and values"
        case "tuple_type" | "list_type":
            return "a list is expected here; write [first, second, …]"
        case _:
            return f"{details['input']!r}: {details['msg']}; correct the value"
