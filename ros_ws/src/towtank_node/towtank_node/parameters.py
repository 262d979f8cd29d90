# SPDX-License-Identifier: Apache-2.0
"""Declared parameters: type, description and limits in one place, refused with one clear line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterUninitializedException,
)
from rclpy.parameter import Parameter as RosParameter


class ParameterError(ValueError):
    """A parameter is missing or has a value that the node cannot work with."""


@dataclass(frozen=True)
class Parameter:
    """One read-only parameter of a node.

    `kind` is str, int, float, bool or list[str]; without a `default` the parameter must be given.
    `minimum` and `maximum` are inclusive and bound numbers; `choices` bounds text.
    """

    name: str
    kind: Any
    description: str
    default: Any = None
    minimum: float | None = None
    maximum: float | None = None
    choices: Sequence[str] = ()

    def descriptor(self) -> ParameterDescriptor:
        """The ROS descriptor, with the range where both limits are given."""
        descriptor = ParameterDescriptor(
            name=self.name, description=self.description, read_only=True
        )
        if self.choices:
            descriptor.additional_constraints = "one of " + ", ".join(self.choices)
        if self.minimum is not None and self.maximum is not None:
            if self.kind is int:
                descriptor.integer_range = [
                    IntegerRange(from_value=int(self.minimum), to_value=int(self.maximum))
                ]
            else:
                descriptor.floating_point_range = [
                    FloatingPointRange(from_value=float(self.minimum), to_value=float(self.maximum))
                ]
        return descriptor


_ROS_TYPES = {
    str: RosParameter.Type.STRING,
    int: RosParameter.Type.INTEGER,
    float: RosParameter.Type.DOUBLE,
    bool: RosParameter.Type.BOOL,
    list[str]: RosParameter.Type.STRING_ARRAY,
}


def read_parameters(node: Any, parameters: Sequence[Parameter]) -> SimpleNamespace:
    """Declare `parameters` on `node` and return their values as attributes.

    Raises ParameterError, in one line, for a missing value or one outside its limits.
    """
    return SimpleNamespace(**{p.name: _read(node, p) for p in parameters})


def _read(node: Any, parameter: Parameter) -> Any:
    start = _ROS_TYPES[parameter.kind] if parameter.default is None else parameter.default
    try:
        value = node.declare_parameter(parameter.name, start, parameter.descriptor()).value
    except ParameterUninitializedException:
        value = None
    except (InvalidParameterTypeException, InvalidParameterValueException) as error:
        raise ParameterError(
            f"{node.get_fully_qualified_name()}: parameter '{parameter.name}' "
            f"({parameter.description}){_limits(parameter)}: {error}"
        ) from error
    if value is None:
        raise ParameterError(
            f"{node.get_fully_qualified_name()}: parameter '{parameter.name}' is missing: "
            f"give {parameter.description}"
        )
    if parameter.choices and value not in parameter.choices:
        raise ParameterError(
            f"{node.get_fully_qualified_name()}: parameter '{parameter.name}' is '{value}': "
            f"give one of {', '.join(parameter.choices)}"
        )
    return value


def _limits(parameter: Parameter) -> str:
    if parameter.minimum is None or parameter.maximum is None:
        return ""
    return f" must lie in [{parameter.minimum:g}, {parameter.maximum:g}]"
