# SPDX-License-Identifier: Apache-2.0
"""Reading study files: YAML text in, a validated study or a StudyError with file and line out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError
from pydantic_core import ErrorDetails
from towtank_rig import RigError
from towtank_rig.document import Document, keys

from towtank_study.errors import StudyError
from towtank_study.study import Study

_DESIGNS = "one_at_a_time, full_factorial, latin_hypercube, sobol"


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


def load_study(path: str | Path) -> StudyFile:
    """Read a study file; StudyError if it cannot be read, is not YAML, or breaks the schema."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise StudyError(f"{path}: {error.strerror}; check the path") from None
    except UnicodeDecodeError as error:
        raise StudyError(
            f"{path}: not UTF-8 text at byte {error.start}; save it as UTF-8"
        ) from None
    return parse_study(text, str(path))


def parse_study(text: str, source: str = "<text>") -> StudyFile:
    """Make a study from YAML text; `source` names it in errors. StudyError for its first fault."""
    try:
        document = Document(text, source)
    except RigError as error:
        raise StudyError(str(error)) from None
    try:
        study = Study.model_validate(document.data)
    except ValidationError as error:
        # A misspelt key is also a missing one: the misspelling comes first. A list whose items have
        # faults is also too short.
        order = {"extra_forbidden": 0, "too_short": 2}
        faults = [
            (order.get(details["type"], 1), *_fault(details, document))
            for details in error.errors()
        ]
        raise StudyError(min(faults)[-1]) from None
    return StudyFile(study, document)


def _fault(details: ErrorDetails, document: Document) -> tuple[int, str]:
    """Return line and text of a fault."""
    context = details.get("ctx", {})
    kinds = _DESIGNS.split(", ")
    # pydantic puts the tag of a union and the names of its variants into the path.
    location = [key for key in details["loc"] if key not in kinds and not _is_variant(key)]
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
            return f"no such design; give kind: one of {_DESIGNS}"
        case "literal_error":
            return f"{details['input']!r} is not accepted; use one of {context['expected']}"
        case "model_type" | "model_attributes_type" | "dict_type":
            return "a section is expected here; write a mapping of keys and values"
        case "tuple_type" | "list_type":
            return "a list is expected here; write [first, second, …]"
        case _:
            return f"{details['input']!r}: {details['msg']}; correct the value"
