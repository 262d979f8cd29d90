# SPDX-License-Identifier: Apache-2.0
"""Restores saved states and pickles with damage in every byte; prints what became of them.

A program of its own, since what it looks for ends the interpreter: see test_saved_states.py.
"""

from __future__ import annotations

import json
import pickle
import random
import resource
import struct
from collections import Counter
from collections.abc import Callable, Iterator

import sim_core as sc

STILL = sc.SteadyTow(position=(0, 0, -1))
NUMBERS = (float("nan"), float("inf"), 0.0, -1.0, 5e-324, 1e-160, 1e30, 1e300)
MARKS = (2, 2**31, 2**32, 2**63, 2**64 - 1)


def simulator() -> sc.Simulator:
    """In waves, a winch with segments on its drum; a fish below it."""
    cable = sc.LineProperties(
        length=3.0, diameter=0.01, mass_per_length=0.2, axial_stiffness=1e5, axial_damping=50.0
    )
    fish = sc.Body(
        mass=5.0, inertia=(0.02, 0.4, 0.4), volume=5e-3, diameter=0.1, length=1.0,
        axial_drag=0.3, cross_flow_drag=1.1,
    )  # fmt: skip
    system = sc.System(
        water=sc.Water(waves=sc.regular_waves(height=0.1, period=2.0)),
        points={"top": sc.PrescribedPoint(), "weight": sc.FreePoint(mass=5.0)},
        bodies={"fish": fish},
        lines={
            "wound": sc.Line("top", "weight", cable, segments=4, paid_out=1.6),
            "other": sc.Line("weight", "fish", cable, segments=2, attachment=(0.5, 0, 0)),
        },
    )
    model = system.build()
    made = sc.Simulator(model, sc.steady_tow(model, position=(0, 0, -1)), max_step=0.01)
    made.step(0.02, STILL)
    return made


def checksum(data: bytes) -> bytes:
    """FNV-1a, as the states carry it at their end."""
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return struct.pack("<Q", value)


def damaged(good: bytes, rng: random.Random) -> Iterator[bytes]:
    """Every byte with all bits turned, with one bit turned, and with any other value."""
    for place, byte in enumerate(good):
        for value in (
            byte ^ 0xFF,
            byte ^ 1 << rng.randrange(8),
            (byte + rng.randrange(1, 256)) % 256,
        ):
            yield good[:place] + bytes([value]) + good[place + 1 :]


def with_odd_words(good: bytes) -> Iterator[bytes]:
    """Every word as each of the odd numbers and marks."""
    for place in range(0, len(good), 8):
        for word in (
            *(struct.pack("<d", x) for x in NUMBERS),
            *(struct.pack("<Q", x) for x in MARKS),
        ):
            yield good[:place] + word + good[place + 8 :]


def outcomes(use: Callable[[bytes], None], cases: Iterator[bytes]) -> Counter[str]:
    found: Counter[str] = Counter()
    for case in cases:
        try:
            use(case)
            found["runs"] += 1
        except Exception as error:  # noqa: BLE001 (of a damaged pickle anything comes)
            found[type(error).__name__] += 1
    return found


def main() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (4 * 2**30, 4 * 2**30))  # a count may ask for it all
    rng = random.Random(1)
    user = simulator()
    saved = user.save()
    body = saved[:-8]

    def restore_and_step(data: bytes) -> None:
        user.restore(data)
        user.step(user.time + 0.01, STILL)
        user.restore(saved)

    def unpickle_and_step(data: bytes) -> None:
        state = pickle.loads(data)
        twin = sc.Simulator(state.model, state, max_step=0.01)
        twin.step(twin.time + 0.01, STILL)

    found = {
        "as it is": outcomes(restore_and_step, iter([saved])),
        "bytes": outcomes(restore_and_step, damaged(saved, rng)),
        "bytes, checksum mended": outcomes(
            restore_and_step, (case + checksum(case) for case in damaged(body, rng))
        ),
        "words, checksum mended": outcomes(
            restore_and_step, (case + checksum(case) for case in with_odd_words(body))
        ),
        "pickle": outcomes(unpickle_and_step, damaged(pickle.dumps(user.state), rng)),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
