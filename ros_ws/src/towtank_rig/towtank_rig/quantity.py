# SPDX-License-Identifier: Apache-2.0
"""Physical quantities of a rig file: a number with its SI unit, range, basis and source.

In YAML a quantity is a short string, ``2.84 m``, or a mapping::

    length: {value: 2.84 m, range: [2.80, 2.90], basis: assumed, source: "scaled from a photograph"}

A dimensionless quantity has the unit ``1`` and is written as a plain number.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

Basis = Literal["stated", "measured", "data_sheet", "derived", "assumed"]

# Expanded uncertainty at 95 % of a normal distribution over its standard uncertainty.
NORMAL_95 = 1.959963984540054


def rig_fault(what: str, mend: str, at: str = "") -> PydanticCustomError:
    """Return a validation error whose text is ``what; mend``, the form of every rig error.

    Args:
        what: The fault.
        mend: What to do about it.
        at: Dotted path of the faulty key below the section that is being validated.
    """
    # pydantic formats braces in the template, so the parts travel as context.
    return PydanticCustomError(
        "rig_fault", "{what}; {mend}", {"what": what, "mend": mend, "at": at}
    )


class Quantity(BaseModel):
    """One physical number of a rig.

    Attributes:
        value: The number in SI units.
        unit: The SI unit, as the schema writes it; ``1`` for a dimensionless number.
        range: Lowest and highest plausible value in the same unit, or None.
        basis: Where the number comes from. ``stated`` (the default) is a setting or a definition.
        source: Document, page, or reasoning behind it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    value: float
    unit: str
    range: tuple[float, float] | None = None
    basis: Basis = "stated"
    source: str = ""

    def __str__(self) -> str:
        return f"{self.value:g}" if self.unit == "1" else f"{self.value:g} {self.unit}"

    @model_validator(mode="after")
    def _range_holds_value(self) -> "Quantity":
        if self.range is not None:
            low, high = self.range
            if low > high:
                raise rig_fault(f"range [{low:g}, {high:g}] runs backwards", "put the lower first")
            if not low <= self.value <= high:
                raise rig_fault(
                    f"value {self.value:g} lies outside its range [{low:g}, {high:g}]",
                    "correct the value or the range",
                )
        if self.basis == "assumed" and self.range is None:
            raise rig_fault("assumed without a range", "add 'range: [lowest, highest]'")
        if self.basis == "assumed" and not self.source.strip():
            raise rig_fault("assumed without a source", "add 'source:' with the reasoning")
        return self


class Tolerance(Quantity):
    """A systematic error of unknown sign: zero expected, ``value`` is its limit.

    ``rectangular``: the error lies within ±value, anywhere (GUM 4.3.7). ``normal``: value is the
    half-width of the 95 % interval.
    """

    distribution: Literal["rectangular", "normal"] = "rectangular"

    @property
    def standard_uncertainty(self) -> float:
        """Return the standard deviation of the error, in the quantity's unit."""
        return self.value / (math.sqrt(3.0) if self.distribution == "rectangular" else NORMAL_95)


@dataclass(frozen=True)
class SI:
    """Unit and bounds of a Quantity field: ``Annotated[Quantity, SI("m", gt=0)]``."""

    unit: str
    gt: float = -math.inf
    ge: float = -math.inf
    le: float = math.inf

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        read = core_schema.no_info_before_validator_function(self._read, handler(source))
        return core_schema.no_info_after_validator_function(self._check_range, read)

    def _read(self, data: Any) -> Any:
        """Turn the YAML form into the fields of a Quantity; refuse any other unit than this one."""
        if isinstance(data, Quantity):
            return data
        if isinstance(data, Mapping):
            if "unit" in data:
                raise rig_fault(
                    "the unit is a key of its own", f"write it with the value, {self._example}"
                )
            if "value" not in data:
                raise rig_fault("the value is missing", f"add 'value: {self._example}'")
            return {**data, "value": self._number(data["value"]), "unit": self.unit}
        return {"value": self._number(data), "unit": self.unit}

    @property
    def _example(self) -> str:
        return "1.5" if self.unit == "1" else f"1.5 {self.unit}"

    def _number(self, data: Any) -> float:
        # bool is an int in Python, but 'yes' is no number in a rig file.
        not_a_number = rig_fault(
            f"{data!r} is not a number with its unit", f"write it like {self._example}"
        )
        if isinstance(data, bool) or not isinstance(data, (int, float, str)):
            raise not_a_number
        if isinstance(data, str):
            number, _, unit = data.strip().partition(" ")
            unit = unit.strip() or "1"
        else:
            number, unit = data, "1"
        try:
            value = float(number)
        except ValueError:
            raise not_a_number from None
        if not math.isfinite(value):
            raise not_a_number
        if unit != self.unit:
            found = "no unit is given" if unit == "1" else f"unit {unit!r} is not accepted here"
            mend = "a plain number" if self.unit == "1" else f"the value in {self.unit!r}"
            raise rig_fault(found, f"give {mend}")
        self._check_bounds(value)
        return value

    def _check_range(self, quantity: Quantity) -> Quantity:
        for limit in quantity.range or ():
            self._check_bounds(limit)
        return quantity

    def _check_bounds(self, value: float) -> None:
        if value <= self.gt:
            raise rig_fault(f"{value:g} is impossible", f"it must be greater than {self.gt:g}")
        if value < self.ge:
            raise rig_fault(f"{value:g} is impossible", f"it must be at least {self.ge:g}")
        if value > self.le:
            raise rig_fault(f"{value:g} is impossible", f"it must be at most {self.le:g}")


class Section(BaseModel):
    """A mapping of the rig file: every key known, nothing changes after loading."""

    model_config = ConfigDict(frozen=True, extra="forbid")


Coordinate = Annotated[Quantity, SI("m")]


class Vector(Section):
    """A point or an offset in the axes of its body, each component a quantity in m."""

    x: Coordinate
    y: Coordinate
    z: Coordinate

    @property
    def value(self) -> tuple[float, float, float]:
        """Return the three components in m."""
        return (self.x.value, self.y.value, self.z.value)
