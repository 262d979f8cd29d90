# SPDX-License-Identifier: Apache-2.0
"""Topics to record, as lines of text: the form of the recorder's parameter."""

from __future__ import annotations

from collections.abc import Sequence

from towtank_node.qos import LATCHED, RELIABLE, SENSOR
from towtank_node.topics import Topic

QOS = {"sensor": SENSOR, "reliable": RELIABLE, "latched": LATCHED}


class TopicError(ValueError):
    """A line of the topic list cannot be used."""


def topic_line(topic: Topic) -> str:
    """A topic of the graph as `parse_topics` reads it."""
    (word,) = (word for word, qos in QOS.items() if qos == topic.qos)
    return f"{topic.name} {topic.type_name} {word}"


def parse_topics(lines: Sequence[str]) -> list[Topic]:
    """Topics from lines `name package/msg/Type sensor|reliable|latched`; raises TopicError."""
    topics = []
    for line in lines:
        words = line.split()
        if len(words) != 3 or not words[0].startswith("/") or words[2] not in QOS:
            raise TopicError(
                f"topic '{line}': write it as '/name package/msg/Type {'|'.join(QOS)}'"
            )
        topics.append(Topic(words[0], words[1], QOS[words[2]]))
    names = [topic.name for topic in topics]
    for name in names:
        if names.count(name) > 1:
            raise TopicError(f"topic '{name}' is listed twice: list it once")
    return topics
