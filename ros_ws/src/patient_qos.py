# SPDX-License-Identifier: Apache-2.0
"""How a test listens to a stream: on a busy machine it is held up, and must miss nothing."""

from dataclasses import replace

from towtank_node.topics import Topic

_DEPTH = 5000
"""More than comes at 100 Hz in the 30 s that a test waits for something."""


def patiently(topic: Topic) -> Topic:
    """A topic to listen to: the depth of a subscription's queue is its own affair."""
    return replace(topic, qos=replace(topic.qos, depth=_DEPTH))
