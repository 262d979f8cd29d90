# SPDX-License-Identifier: Apache-2.0
"""The recorder: a lifecycle node that writes the trial's topics into a bag.

configure opens the bag and subscribes; activate publishes the rig file on /rig and records;
deactivate stops recording; cleanup finishes the bag. If the disk fails, the node reports an error
on /diagnostics, goes back to inactive, and what was written stays, marked incomplete.
"""

from __future__ import annotations

import sys
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from rclpy.lifecycle import State, TransitionCallbackReturn
from std_msgs.msg import String
from towtank_node import topics
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.endpoints import publisher
from towtank_node.lifecycle import ManagedNode
from towtank_node.main import run_node
from towtank_node.names import RECORDER_NODE, split_name
from towtank_node.parameters import Parameter, read_parameters
from towtank_node.polling import PolledSubscription, Received
from towtank_node.qos import SENSOR
from towtank_node.senders import Senders
from towtank_node.stamps import SteadyTimes
from towtank_node.timers import create_steady_timer
from towtank_node.trial_clock import TrialClock
from towtank_rig import Rig, RigError, load_rig

from towtank_bag.definitions import DefinitionError
from towtank_bag.layout import (
    CALIBRATION_ATTACHMENT,
    RECORDER_METADATA,
    RIG_ATTACHMENT,
    BagError,
)
from towtank_bag.topics import TopicError, parse_topics, topic_line
from towtank_bag.writer import Attachment, BagWriter, RawMessage

POLL_PERIOD_S = 0.1
"""Ten samples of each 100 Hz topic: a fifth of what their queues hold."""

PARAMETERS = (
    Parameter("rig", str, "path of the rig file"),
    Parameter("uri", str, "directory of the new bag; it must not exist"),
    Parameter(
        "topics",
        list[str],
        "topics to record, each as '/name package/msg/Type sensor|reliable|latched'",
        default=[topic_line(topic) for topic in topics.TRIAL],
    ),
)


class Recorder(ManagedNode):
    """Shell around BagWriter."""

    def __init__(self) -> None:
        super().__init__(split_name(RECORDER_NODE)[1])
        parameters = read_parameters(self, PARAMETERS)
        self._rig = load_rig(parameters.rig)
        self._uri = parameters.uri
        self._topics = parse_topics(parameters.topics)
        self._writer: BagWriter | None = None
        self._polled: list[PolledSubscription] = []
        self._poll_timer: Any = None
        self._senders = Senders(self)
        self._times = SteadyTimes(TrialClock(self).offset_ns)
        self._rig_publisher = publisher(self, topics.RIG)
        self._diagnostics = NodeDiagnostics(self, POLL_PERIOD_S, self._counters)

    def on_configure(self, state: State) -> TransitionCallbackReturn:
        try:
            self._writer = BagWriter(
                self._uri, self._topics, bag_attachments(self._rig), bag_metadata(self._rig)
            )
        except (BagError, DefinitionError) as error:
            return self._fail(str(error))
        self._polled = [
            PolledSubscription(self, topic, self._senders, raw=True) for topic in self._topics
        ]
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: State) -> TransitionCallbackReturn:
        self._rig_publisher.publish(String(data=self._rig.text))
        self._poll_timer = create_steady_timer(self, POLL_PERIOD_S, self._poll)
        self._diagnostics.ready("recording")
        return super().on_activate(state)

    def on_deactivate(self, state: State) -> TransitionCallbackReturn:
        self._stop_polling()
        self._record_waiting()
        self._diagnostics.stop("not recording: deactivated")
        return super().on_deactivate(state)

    def on_cleanup(self, state: State) -> TransitionCallbackReturn:
        try:
            self._finish_bag()
        except BagError as error:
            return self._fail(str(error))
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: State) -> TransitionCallbackReturn:
        return self.on_cleanup(state)

    def close(self) -> None:
        """Finish the bag when the process ends without a transition, on Ctrl-C for example."""
        try:
            self._finish_bag()
        except BagError as error:
            self.get_logger().error(str(error))

    def _finish_bag(self) -> None:
        """Record what is waiting and finish the bag. Raises BagError if the disk failed."""
        self._stop_polling()
        self._record_waiting()
        for subscription in self._polled:
            subscription.close()
        self._polled = []
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def _poll(self) -> None:
        with self._diagnostics.cycle():
            self._record_waiting()
        if self._writer is not None and self._writer.error is not None:
            self._fail(str(self._writer.error))
            self.trigger_deactivate()

    def _record_waiting(self) -> None:
        if self._writer is None or self._writer.error is not None:
            return
        before = self._writer.overflowed + self._lost()
        taken = [
            (index, received)
            for index, subscription in enumerate(self._polled)
            for received in subscription.take()
        ]
        self._times.look()
        self._writer.write([self._raw_message(*each) for each in taken])
        self._diagnostics.overrun(self._writer.overflowed + self._lost() - before)

    def _raw_message(self, index: int, received: Received) -> RawMessage:
        log_time_ns = self._times.received(received.received_ns)
        published_ns = self._times.published(received.published_ns, log_time_ns)
        return RawMessage(index, log_time_ns, published_ns, received.message)

    def _lost(self) -> int:
        """Messages that the middleware lost, on the topics where that can be: those without
        repetition."""
        return sum(
            subscription.lost
            for topic, subscription in zip(self._topics, self._polled, strict=False)
            if topic.qos == SENSOR
        )

    def _stop_polling(self) -> None:
        if self._poll_timer is not None:
            self.destroy_timer(self._poll_timer)
            self._poll_timer = None

    def _counters(self) -> dict[str, Any]:
        if self._writer is None:
            return {}
        return {
            "messages": self._writer.messages,
            "bytes": self._writer.bytes_written,
            "lost_in_transport": self._lost(),
            "left_out": sum(self._senders.left_out.values()),
            "queue_overflowed": self._writer.overflowed,
            "queue_high_water": self._writer.queue_high_water,
        }

    def _fail(self, reason: str) -> TransitionCallbackReturn:
        self.get_logger().error(reason)
        self._diagnostics.fail(reason)
        return TransitionCallbackReturn.FAILURE


def bag_attachments(rig: Rig) -> list[Attachment]:
    """The rig file, letter for letter, the calibrations in force, and the records behind them."""
    return [
        Attachment(RIG_ATTACHMENT, "application/yaml", rig.text.encode()),
        Attachment(
            CALIBRATION_ATTACHMENT,
            "application/json",
            rig.calibrations.model_dump_json(indent=2).encode(),
        ),
        *(
            Attachment(name, "application/yaml", text.encode())
            for name, text in rig.calibration_records.items()
        ),
    ]


def bag_metadata(rig: Rig) -> dict[str, dict[str, str]]:
    """What recorded the bag, and which rig file."""
    return {
        RECORDER_METADATA: {
            "software": "towtank",
            "version": _software_version(),
            "rig": rig.name,
            "rig_sha256": rig.sha256,
        }
    }


def _software_version() -> str:
    try:
        return version("towtank_bag")
    except PackageNotFoundError:
        return "not installed"


def main() -> None:
    """Run the node until it is told to end."""
    sys.exit(run_node(Recorder, (RigError, TopicError, BagError)))


if __name__ == "__main__":
    main()
