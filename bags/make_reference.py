# SPDX-License-Identifier: Apache-2.0
"""Writes the reference bag: python bags/make_reference.py DIRECTORY

A trial whose motions are known in closed form, made as the tests make theirs, at 5 scans a second
so that it is small, in chunks of 16 kB so that there are many.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "ros_ws" / "src" / "towtank_compare" / "test"))

from std_msgs.msg import String  # noqa: E402
from synthetic_trial import RIG_FILE, START_NS, Sample, trial_samples, write_trial  # noqa: E402
from towtank_bag import writer  # noqa: E402
from towtank_interfaces.msg import AdcScan  # noqa: E402
from towtank_node import topics  # noqa: E402
from towtank_rig import load_rig  # noqa: E402

EVERY = 20  # of 100 scans a second
CHUNK_BYTES = 16_000


def thinned(samples: list[Sample]) -> list[Sample]:
    """One scan in twenty and what belongs to it, numbered without a gap."""
    kept = []
    for sample in samples:
        tick = round((sample.stamp_ns - START_NS) / 10_000_000)
        if tick % EVERY == 0 or sample.topic in (topics.EVENTS.name, topics.DIAGNOSTICS.name):
            if isinstance(sample.message, AdcScan):
                sample.message.sequence //= EVERY
                sample.message.board_ticks = 20_000 * tick
            kept.append(sample)
    return kept


def main() -> None:
    """Write the bag into a new directory."""
    rig = Sample(topics.RIG.name, START_NS, String(data=load_rig(RIG_FILE).text))
    writer.CHUNK_BYTES = CHUNK_BYTES
    write_trial(Path(sys.argv[1]), [rig, *thinned(trial_samples())])


if __name__ == "__main__":
    main()
