# SPDX-License-Identifier: Apache-2.0
"""The flags of a sensor's health are those of the message, all of them."""

from towtank_interfaces.msg import SensorHealth
from towtank_node.health import Health


def test_every_flag_of_the_message_has_its_name():
    # What rosidl makes a message class's constants of
    constants = type(SensorHealth).__prepare__(SensorHealth.__name__, ())
    bits = {name: value for name, value in constants.items() if not name.endswith("__DEFAULT")}
    assert {flag.name: flag.value for flag in Health} == bits
    assert len(bits) > 5


def test_flags_are_told_in_words():
    assert (Health.OPEN | Health.NOISE).names == ["open", "noise"]
    assert Health(0).names == []
