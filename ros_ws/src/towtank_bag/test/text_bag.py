# SPDX-License-Identifier: Apache-2.0
"""Numbered messages of text, and what else a bag for a test needs."""

from __future__ import annotations

import time
from collections.abc import Callable

from towtank_bag.writer import Attachment, RawMessage
from towtank_node.qos import RELIABLE
from towtank_node.topics import Topic

TOPIC = Topic("/text", "std_msgs/msg/String", RELIABLE)
RIG = Attachment("rig.yaml", "application/yaml", b"name: any\n")


def text_message(number: int, text: bytes) -> RawMessage:
    """A std_msgs/String in CDR: encapsulation, length with the closing zero, text. Its times are
    its number, ns."""
    data = b"\0\1\0\0" + (len(text) + 1).to_bytes(4, "little") + text + b"\0"
    return RawMessage(0, number, number, data)


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait, for as long as it takes."""
    while not condition():
        time.sleep(0.01)
