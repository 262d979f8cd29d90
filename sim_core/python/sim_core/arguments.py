# SPDX-License-Identifier: Apache-2.0
"""How arguments are refused: by name, in one line.

Importing this module makes constructors and functions of the compiled library refuse numbers that
are not finite, and say which argument is missing, misspelt or of a wrong type. By itself the
library would show all its signatures.
"""

from __future__ import annotations

import difflib
import functools
import math
import numbers
import re
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sim_core import _core

# The depth of the water, when a contact ended that lasts, the aspect ratio without induced drag
MAY_BE_INFINITE = {"depth", "released", "aspect_ratio"}
CALLED = {"_record_run": "run"}


def require_finite(owner: str, name: str, value: object) -> None:
    """Raise InvalidInput naming owner and value unless all numbers in a value are finite.

    value: a number, or numbers in arrays, sequences or mappings; anything else is left alone.
    """
    if isinstance(value, Mapping):
        for key, item in value.items():
            require_finite(owner, f"{name}[{key!r}]", item)
    elif isinstance(value, list | tuple):
        for item in value:
            require_finite(owner, name, item)
    elif getattr(getattr(value, "dtype", None), "kind", "") == "f" and getattr(value, "ndim", 0):
        require_finite(owner, name, value.tolist())  # type: ignore[attr-defined]
    elif isinstance(value, numbers.Real):
        infinite = name in MAY_BE_INFINITE and value == math.inf
        if not math.isfinite(value) and not infinite:
            raise _core.InvalidInput(f"{owner}: {name} must be finite, not {float(value)}")


@dataclass(frozen=True)
class Signature:
    """What a compiled function can be called with.

    types: by name, as the stubs have them; positional: names that may go by place; defaults: by
    name; what has none is needed.
    """

    types: dict[str, str]
    positional: list[str]
    defaults: dict[str, object]

    @staticmethod
    def of(text: str, defaults: Sequence[object]) -> Signature:
        """From what the library keeps: ``def f(self, a: int, *, b: float = \\0) -> None``."""
        listed = text[text.index("(") + 1 : text.rindex(") -> ")]
        types, positional, named_defaults = {}, [], {}
        by_keyword = False
        for argument in split(listed, ", "):
            if argument == "*":
                by_keyword = True
                continue
            name, _, rest = argument.partition(": ")
            if name == "self":
                continue
            types[name], _, default = rest.partition(" = \\")
            if default:
                named_defaults[name] = defaults[int(default)]
            if not by_keyword:
                positional.append(name)
        return Signature(types, positional, named_defaults)

    def given(self, args: Sequence[object], kwargs: Mapping[str, object]) -> dict[str, object]:
        """The arguments of a call by name."""
        return dict(zip(self.positional, args, strict=False)) | dict(kwargs)

    def faults(self, args: Sequence[object], kwargs: Mapping[str, object]) -> list[str]:
        """What is wrong with a call, in words."""
        given = self.given(args, kwargs)
        missing = [n for n in self.types if n not in self.defaults and n not in given]
        unknown = [name for name in given if name not in self.types]
        found = []
        if len(args) > len(self.positional):
            named = f"takes {', '.join(self.positional)} by place" if self.positional else "takes"
            found.append(f"{named} {'and all else' if self.positional else 'all'} by name")
        for name in unknown:
            close = difflib.get_close_matches(name, [n for n in self.types if n not in given], 1)
            if close:
                found.append(f"has no '{name}': did you mean '{close[0]}'?")
                missing = [other for other in missing if other != close[0]]
            else:
                found.append(f"has no '{name}', it has {', '.join(self.types)}")
        if missing:
            found.append(f"needs {', '.join(missing)}")
        for name, value in given.items():
            if name in self.types and not fits(value, self.types[name]):
                found.append(f"cannot take {described(value)} as {name}: {short(self.types[name])}")
        return found or self._odd_values(given)

    def _odd_values(self, given: Mapping[str, object]) -> list[str]:
        """What is left if all are there and of a possible type: rows of a wrong length."""
        rows = {name: row for name, row in given.items() if isinstance(row, list | tuple)}
        odd = {
            name: row
            for name, row in rows.items()
            if isinstance(usual := self.defaults.get(name), list) and len(row) != len(usual) > 0
        }
        suspects = odd or {name: rows[name] for name in rows if name not in self.defaults} or given
        return [f"cannot take {', '.join(f'{n}={described(v)}' for n, v in suspects.items())}"]


def split(text: str, separator: str) -> list[str]:
    """The parts of a text between separators outside of brackets."""
    parts, depth, start = [], 0, 0
    for i, sign in enumerate(text):
        depth += (sign in "[(") - (sign in "])")
        if depth == 0 and text.startswith(separator, i):
            parts.append(text[start:i])
            start = i + len(separator)
    return [part for part in [*parts, text[start:]] if part]


def fits(value: object, annotation: str) -> bool:
    """Whether a value is of a type, as far as its annotation tells: not how long a row must be."""
    return any(_fits_one(value, kind) for kind in split(annotation, " | "))


def _fits_one(value: Any, kind: str) -> bool:
    name, _, rest = kind.rpartition("]")[0].partition("[") if "[" in kind else (kind, "", "")
    inner = split(rest, ", ")
    row = hasattr(value, "__len__") and not isinstance(value, str | bytes | Mapping)
    match name.rpartition(".")[2]:
        case "float":
            return hasattr(value, "__float__") and not (row and len(value) != 1)
        case "int":
            return hasattr(value, "__index__")
        case "str":
            return isinstance(value, str)
        case "None":
            return value is None
        case "Sequence":
            return row and all(fits(item, inner[0]) for item in value)
        case "tuple":
            return row and len(value) == len(inner) and all(map(fits, value, inner))
        case "Mapping":
            mapping = isinstance(value, Mapping)
            return mapping and all(
                fits(k, inner[0]) and fits(v, inner[1]) for k, v in value.items()
            )
        case "ndarray" | "NDArray":
            return hasattr(value, "dtype")
        case cls:
            return any(base.__name__ == cls for base in type(value).__mro__)


def described(value: object) -> str:
    """A value, or its type where it is long."""
    text = repr(value)
    return text if len(text) <= 30 else f"a {type(value).__name__}"


def short(annotation: str) -> str:
    """A type without modules, and without the arrays that may stand for sequences."""
    kinds = [kind for kind in split(annotation, " | ") if not kind.startswith("numpy.typing")]
    text = " | ".join(kinds).replace(" | numpy.typing.NDArray[numpy.float64]", "")
    return re.sub(r"[\w.]+\.(?=\w+)", "", text)


def refusal(signatures: Sequence[Signature], args: Sequence[Any], kwargs: Mapping[str, Any]) -> str:
    """Why a call was refused."""
    faults = [signature.faults(args, kwargs) for signature in signatures]
    fewest = min(faults, key=len)
    return "; ".join(fewest)


def guarded(function: Any, owner: str) -> Callable[..., Any]:
    """A compiled function that refuses by name; owner: what it is called in messages."""

    @functools.cache
    def signatures() -> list[Signature]:  # read when first needed: there are many functions
        return [Signature.of(text, defaults or ()) for text, _, defaults in overloads]

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        own = args[method:]
        for name, value in signatures()[0].given(own, kwargs).items():
            require_finite(owner, name, value)
        try:
            return function(*args, **kwargs)
        except TypeError as error:
            if "incompatible function arguments" not in str(error):
                raise
            why = f"{owner} {refusal(signatures(), own, kwargs)}"
        raise TypeError(why)

    overloads = function.__nb_signature__
    method = int("(self" in overloads[0][0])
    call.__nb_signature__ = overloads  # type: ignore[attr-defined]
    return call


def is_compiled(item: object) -> bool:
    """Whether something is a function or a method of the library."""
    return type(item).__name__ in ("nb_func", "nb_method")


def guard(library: types.ModuleType) -> None:
    """Make constructors and functions of the library, and the builder's methods, refuse by name."""
    for name, item in list(vars(library).items()):
        if not isinstance(item, type):
            if is_compiled(item):
                setattr(library, name, guarded(item, CALLED.get(name, name.lstrip("_"))))
            continue
        construct = vars(item).get("__init__")
        if is_compiled(construct):
            setattr(item, "__init__", guarded(construct, name))  # noqa: B010 (for mypy)
            library._construct_by_init(item)
    for name, item in list(vars(library.ModelBuilder).items()):
        if name.startswith("add_"):
            setattr(library.ModelBuilder, name, guarded(item, name))


guard(_core)
