# SPDX-License-Identifier: Apache-2.0
"""A small synthetic trial as a bag: its motions are known in closed form."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from towtank_bag.recorder import bag_attachments, bag_metadata
from towtank_bag.writer import BagWriter, RawMessage
from towtank_interfaces.msg import (
    AdcScan,
    CableState,
    Depth,
    HeaveRatio,
    Inclination,
    SensorHealth,
    TrialEvent,
)
from towtank_node import names, topics
from towtank_rig import load_rig

RIG_FILE = Path(__file__).resolve().parents[4] / "hardware" / "rigs" / "nit_calicut_2012.yaml"
START_NS = 1_750_000_000_000_000_000
DURATION_S = 20.0
CRANK_HZ = 0.5
PITCH_AMPLITUDE = 0.02
MEASURED = {"fish": (0.012, -0.5), "depressor": (0.055, 0.3)}
SIMULATED = {"fish": (0.011, -0.4), "depressor": (0.056, 0.3)}
"""Heave amplitude, m, and phase, rad; of a simulated fish at its origin."""
MEAN_Z = {"fish": -1.2, "depressor": -1.0}
LATENCY_NS = 7_000_000
LOST_SCANS = (700, 701)
BAD_SCAN = 900
ZERO_DEPTH = {"fish": 0.3, "depressor": 0.2}
LOG = (2.0, 18.0)


@dataclass(frozen=True)
class Sample:
    """One message of the synthetic trial and when it was sampled."""

    topic: str
    stamp_ns: int
    message: object


def to_time(stamp_ns: int) -> Time:
    seconds, nanoseconds = divmod(int(stamp_ns), 1_000_000_000)
    return Time(sec=seconds, nanosec=nanoseconds)


def head(stamp_ns: int, frame: str) -> Header:
    return Header(stamp=to_time(stamp_ns), frame_id=frame)


def heave(motions, body: str, t: float) -> float:
    amplitude, phase = motions[body]
    return MEAN_Z[body] + amplitude * math.cos(2 * math.pi * CRANK_HZ * t + phase)


def pitch(t: float) -> float:
    """By REP-103: positive bow down."""
    return PITCH_AMPLITUDE * math.cos(2 * math.pi * CRANK_HZ * t + 1.0)


def odometry(stamp_ns: int, body: str, t: float) -> Odometry:
    message = Odometry(header=head(stamp_ns, "tank"), child_frame_id=body)
    message.pose.pose.position.x = t
    message.pose.pose.position.z = heave(SIMULATED, body, t)
    half = pitch(t) / 2 if body == "fish" else 0.0
    message.pose.pose.orientation.y = math.sin(half)
    message.pose.pose.orientation.w = math.cos(half)
    return message


def cable_state(stamp_ns: int, t: float) -> CableState:
    return CableState(
        header=head(stamp_ns, "tank"),
        line_names=["primary", "depressor", "secondary"],
        segment_counts=[2, 1, 2],
        x=[t + v for v in (0.0, -0.2, -0.4, -0.4, -0.5, -0.4, -0.9, -1.4)],
        y=[0.0] * 8,
        z=[0.2, -0.3, -0.8, -0.8, heave(SIMULATED, "depressor", t), -0.8, -1.0, -1.2],
        tension=[60.0, 55.0, 50.0, 5.0, 4.0],
    )


def trial_samples(
    noise_m: float = 2e-4,
    reset_s: float = math.inf,
    zeroed_s: float = math.inf,
    configured_mask: int = 0b11_1111,
) -> list[Sample]:
    """Everything that a trial publishes, in order of its instants; the crank turns steadily.

    reset_s: when the board is reset, which begins the counts anew; positions are not known then
    until zeroed_s, and nought there. configured_mask: channels of the scans; a bad one lacks one.
    """
    rng = np.random.default_rng(4)
    samples = []

    def add(topic, stamp_ns, message):
        samples.append(Sample(topic, int(stamp_ns), message))

    for i in range(int(DURATION_S * 100)):
        if i in LOST_SCANS:
            continue
        stamp = START_NS + i * 10_000_000
        t = i / 100
        angle, carriage = 2 * math.pi * CRANK_HZ * t, t
        counted_s = t - reset_s if t >= reset_s else t
        zero_s = zeroed_s if t >= zeroed_s else math.nan if t >= reset_s else 0.0
        add(
            topics.SCANS.name,
            stamp,
            AdcScan(
                header=head(stamp, "board"),
                sequence=i,
                configured_mask=configured_mask,
                valid_mask=configured_mask & (configured_mask - (i == BAD_SCAN)),
                codes=[0] * 6,
                crank_count=math.floor(4096 * CRANK_HZ * counted_s),
                carriage_count=math.floor(4096 * counted_s / 0.5),
                count_epoch=1 + (t >= reset_s),
            ),
        )
        add(
            topics.MEASURED_JOINTS.name,
            stamp,
            JointState(
                header=head(stamp, ""),
                name=[names.CRANK_JOINT, names.CARRIAGE_JOINT],
                position=[2 * math.pi * CRANK_HZ * (t - zero_s), t - zero_s],
                velocity=[2 * math.pi * CRANK_HZ, 1.0],
            ),
        )
        add(
            topics.PLANT_JOINTS.name,
            stamp,
            JointState(
                header=head(stamp, ""),
                name=[names.CARRIAGE_JOINT, names.CRANK_JOINT],
                position=[carriage, angle],
            ),
        )
        for body, delay_ns in (("fish", 546_000), ("depressor", 1_638_000)):
            z = heave(MEASURED, body, t + delay_ns * 1e-9) + noise_m * rng.standard_normal()
            add(
                topics.DEPTHS[body].name,
                stamp + delay_ns,
                Depth(
                    header=head(stamp + delay_ns, body),
                    depth=-z if i != BAD_SCAN else 99.0,
                    valid=i != BAD_SCAN,
                    zeroed=True,
                    zero_depth=ZERO_DEPTH[body],
                    health=SensorHealth(flags=fish_health(t) if body == "fish" else 0),
                ),
            )
            for source in ("twin", "plant"):
                add(topics.ODOMETRY.within(source, body).name, stamp, odometry(stamp, body, t))
        add(
            topics.INCLINATION.name,
            stamp,
            Inclination(header=head(stamp, "fish"), pitch=pitch(t), valid=True),
        )
        if i % 5 == 0:
            add(topics.TWIN_CABLES.name, stamp, cable_state(stamp, t))
        if i % 100 == 0:
            status = DiagnosticStatus(
                name=names.TWIN_NODE, values=[KeyValue(key="overruns", value=str(i // 1000))]
            )
            add(
                topics.DIAGNOSTICS.name,
                stamp,
                DiagnosticArray(header=head(stamp, ""), status=[status]),
            )
    for name, t, detail in (
        ("log_start", LOG[0], {}),
        ("log_stop", LOG[1], {}),
        ("resources", 19.0, {"cpu_cores": 0.9}),
    ):
        stamp = START_NS + int(t * 1e9)
        event = TrialEvent(header=head(stamp, ""), event=name, detail=json.dumps(detail))
        add(topics.EVENTS.name, stamp, event)
    return sorted(samples, key=lambda sample: sample.stamp_ns)


def fish_health(t: float) -> int:
    """Noisy from 5 s to 6 s, and open in the first tenth of that."""
    noisy = SensorHealth.NOISE if 5.0 <= t < 6.0 else 0
    return noisy | (SensorHealth.OPEN if 5.0 <= t < 5.1 else 0)


def write_trial(directory: Path, samples: list[Sample], ratios: list[HeaveRatio] = ()) -> Path:
    """A bag of these samples, each received LATENCY_NS after its instant."""
    rig = load_rig(RIG_FILE)
    index = {topic.name: i for i, topic in enumerate(topics.TRIAL)}
    with BagWriter(directory, topics.TRIAL, bag_attachments(rig), bag_metadata(rig)) as writer:
        writer.write(
            [
                RawMessage(
                    index[sample.topic],
                    sample.stamp_ns + LATENCY_NS,
                    sample.stamp_ns + LATENCY_NS,
                    serialize_message(sample.message),
                )
                for sample in samples
            ]
        )
        for ratio in ratios:
            end_ns = ratio.header.stamp.sec * 10**9 + ratio.header.stamp.nanosec
            topic = index[topics.HEAVE_RATIO.within(ratio.source).name]
            writer.write([RawMessage(topic, end_ns, end_ns, serialize_message(ratio))])
    return directory
