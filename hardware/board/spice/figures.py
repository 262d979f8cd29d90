# SPDX-License-Identifier: Apache-2.0
"""Prints what the front ends' ngspice decks give, beside board.yaml: the tables of README.md."""

from __future__ import annotations

import math
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path += [str(Path(__file__).parent), str(ROOT / "firmware" / "protocol")]

from front_ends import CHANNELS, SpiceError, conversion_noise, run_deck, worst_case  # noqa: E402
from schema_hash import load_board  # noqa: E402

LOWEST_HZ = 0.01  # a trial's length after zeroing, 100 s


def front_end_noise(board: dict, deck: str) -> float:
    """Noise of one conversion at the ADC's input, less the ADC's, V; at the default filter."""
    adc = board["adc"]
    chosen = adc["filter"]
    rate = adc["master_clock_hz"] / (32 * chosen["fs"]["default"])
    order = chosen["types"][chosen["type"]]["order"]
    return conversion_noise(run_deck(deck), order, rate, LOWEST_HZ)


def tables() -> str:
    """Both tables in Markdown. Raises SpiceError, OSError."""
    board = load_board(ROOT / "firmware" / "protocol" / "board.yaml")
    by_name = {channel["name"]: channel for channel in board["channels"]}
    lines = [
        "| front end | gain | board.yaml | −3 dB, Hz | board.yaml | lag at 0.5 Hz "
        "| attenuation at 0.5 Hz |",
        "|---|---|---|---|---|---|---|",
    ]
    for deck, names in CHANNELS.items():
        found, channel = run_deck(deck).measured, by_name[names[0]]
        lines.append(
            f"| {deck} | {found['gain']:.5g} | {channel['gain']:g} | {found['pole_hz']:.4g} "
            f"| {channel['pole_hz']:g} | {-math.degrees(found['phase_rad']):.2f}° "
            f"| {1e6 * found['attenuation']:.0f} ppm |"
        )
    lines += [
        "",
        "| front end | gain, worst case | −3 dB, worst case, Hz | noise of a conversion, µV "
        "| board.yaml, µV | left for the ADC, µV |",
        "|---|---|---|---|---|---|",
    ]
    for deck, names in CHANNELS.items():
        nominal, spread = run_deck(deck).measured["gain"], worst_case(deck)
        low, high = (100 * (gain / nominal - 1) for gain in spread["gain"])
        slow, fast = spread["pole_hz"]
        noise, stated = front_end_noise(board, deck), by_name[names[0]]["noise_volts"]
        # The accelerometer's own noise is the rig's; board.yaml has the ADC's alone.
        left = stated if deck == "accelerometer" else math.sqrt(max(stated**2 - noise**2, 0.0))
        lines.append(
            f"| {deck} | {low:+.2f} … {high:+.2f} % | {slow:.3g} … {fast:.3g} "
            f"| {1e6 * noise:.3g} | {1e6 * stated:g} | {1e6 * left:.3g} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    try:
        print(tables())
    except (SpiceError, OSError) as error:
        sys.exit(f"error: {error}")
