# SPDX-License-Identifier: Apache-2.0
"""Damaged bags by the thousand: `towtank bench bag-fuzz`.

The reference bag is damaged as sticks, disks and power cuts do it, and evaluated. Right is: the
result of the undamaged bag, bit for bit; or another one with a word on what is lost; or one line
that says why there is none. An exception of another kind is wrong, and so is another result without
a word. Each case follows from the seed and its number.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import click
from rich.console import Console
from rich.table import Table
from towtank_bag import bag_files
from towtank_bag.layout import BagError
from towtank_compare import compare
from towtank_compare.compare import CompareError, compare_bag
from towtank_compare.trial_result import trial_result
from towtank_rig import parse_rig

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "bags" / "reference"
SECTOR = 512
SAME, SAME_TOLD, LESS_TOLD, REFUSED = "as undamaged", "as undamaged, told", "less, told", "refused"
RIGHT = (SAME, SAME_TOLD, LESS_TOLD, REFUSED)
SILENT, CRASHED = "other result, not a word", "exception"
_AT_A_TIME = 50


def _flip_bits(data: bytearray, chance: random.Random) -> None:
    for _ in range(chance.choice((1, 1, 1, 2, 8, 64))):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)


def _sectors(data: bytearray, chance: random.Random) -> slice:
    first = SECTOR * chance.randrange(len(data) // SECTOR + 1)
    return slice(first, min(len(data), first + SECTOR * chance.choice((1, 1, 1, 2, 8, 40))))


def _zero_sectors(data: bytearray, chance: random.Random) -> None:
    place = _sectors(data, chance)
    data[place] = bytes(place.stop - place.start)


def _swap_sectors(data: bytearray, chance: random.Random) -> None:
    """What belongs elsewhere was written here."""
    place = _sectors(data, chance)
    source = SECTOR * chance.randrange(len(data) // SECTOR)
    other = bytes(data[source : source + place.stop - place.start])
    data[place.start : place.start + len(other)] = other


def _cut(data: bytearray, chance: random.Random) -> None:
    del data[chance.randrange(len(data)) :]


def _zero_tail(data: bytearray, chance: random.Random) -> None:
    """A power cut after the length had reached the disk, and before the content."""
    start = chance.randrange(len(data))
    data[start:] = bytes(len(data) - start)


def _lose_bytes(data: bytearray, chance: random.Random) -> None:
    start = chance.randrange(len(data))
    del data[start : start + chance.randrange(1, 2000)]


def _insert_bytes(data: bytearray, chance: random.Random) -> None:
    start = chance.randrange(len(data))
    data[start:start] = chance.randbytes(chance.randrange(1, 2000))


DAMAGE: dict[str, Callable[[bytearray, random.Random], None]] = {
    "bits flipped": _flip_bits,
    "sectors zeroed": _zero_sectors,
    "sectors swapped": _swap_sectors,
    "cut off": _cut,
    "tail zeroed": _zero_tail,
    "bytes lost": _lose_bytes,
    "bytes inserted": _insert_bytes,
}
_KINDS = [*DAMAGE, *("bits flipped", "sectors zeroed", "cut off")]  # these twice as often
_METADATA_EVERY = 20  # one case in so many damages metadata.yaml too


@dataclass(frozen=True)
class Outcome:
    """What became of one case. text: the line or the exception."""

    number: int
    kind: str
    verdict: str
    text: str


@contextmanager
def damaged_bag(seed: int, number: int) -> Iterator[tuple[str, Path]]:
    """Kind of the damage of a case, and the bag, for a while."""
    chance = random.Random(f"{seed}/{number}")
    kind = chance.choice(_KINDS)
    with tempfile.TemporaryDirectory(prefix="towtank-fuzz-") as folder:
        bag = Path(folder) / REFERENCE.name
        shutil.copytree(REFERENCE, bag)
        names = [f"{REFERENCE.name}_0.mcap"]
        if chance.randrange(_METADATA_EVERY) == 0:
            names.append("metadata.yaml")
        for name in names:
            data = bytearray((bag / name).read_bytes())
            DAMAGE[kind](data, chance)
            (bag / name).write_bytes(data)
        yield kind, bag


def _evaluated(bag: Path, number: int) -> dict[str, Any]:
    """The result as both ways to it give it by turns; text, for NaN equals itself there."""
    return compare_bag(bag) if number % 2 else trial_result(bag)


@lru_cache
def _undamaged(odd: int) -> str:
    return _comparable(_evaluated(REFERENCE, odd))


def _comparable(result: dict[str, Any]) -> str:
    return json.dumps({k: v for k, v in result.items() if k not in ("bag_problem", "bag_notes")})


def judge(seed: int, number: int) -> Outcome:
    """One case."""
    with damaged_bag(seed, number) as (kind, bag):
        try:
            result = _evaluated(bag, number)
        except (BagError, CompareError) as error:
            line = str(error)
            return Outcome(number, kind, REFUSED if "\n" not in line else CRASHED, line)
        except Exception:  # noqa: BLE001 - whatever it is: that is what is looked for
            return Outcome(number, kind, CRASHED, traceback.format_exc())
    told = "; ".join([*filter(None, (result["bag_problem"],)), *result["bag_notes"]])
    if _comparable(result) == _undamaged(number % 2):
        return Outcome(number, kind, SAME_TOLD if told else SAME, told)
    # A note alone does not say that something is lost
    return Outcome(number, kind, LESS_TOLD if result["bag_problem"] else SILENT, told)


def parse_once() -> None:
    """Let no text be parsed twice: that takes three quarters of a case, and is not on trial."""
    parse = lru_cache(parse_rig)
    patch.object(compare, "parse_rig", lambda text, source: parse(text)).start()
    patch.object(bag_files, "_information", lru_cache(bag_files._information)).start()


def _judge_some(seed: int, numbers: range) -> list[Outcome]:
    return [judge(seed, number) for number in numbers]


def fuzz(cases: int, seed: int, workers: int | None = None) -> Iterator[Outcome]:
    """Every case, on all cores."""
    batches = [range(i, min(i + _AT_A_TIME, cases)) for i in range(0, cases, _AT_A_TIME)]
    with ProcessPoolExecutor(workers or os.cpu_count(), initializer=parse_once) as pool:
        for outcomes in pool.map(partial(_judge_some, seed), batches):
            yield from outcomes


def _table(counts: Counter[tuple[str, str]]) -> Table:
    verdicts = [*RIGHT, SILENT, CRASHED]
    table = Table("damage", *verdicts, title="cases by damage and outcome")
    for kind in DAMAGE:
        table.add_row(kind, *(str(counts[kind, verdict]) for verdict in verdicts))
    table.add_row("all", *(str(sum(counts[k, v] for k in DAMAGE)) for v in verdicts))
    return table


@click.command()
@click.option("--cases", type=click.IntRange(min=1), default=10_000, show_default=True)
@click.option("--seed", type=int, default=1, show_default=True)
@click.option("--only", type=click.IntRange(min=0), help="One case by its number, and its text.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def main(cases: int, seed: int, only: int | None, as_json: bool) -> None:
    """Damage the reference bag in many ways and look what the evaluation makes of it."""
    if only is not None:
        outcome = judge(seed, only)
        click.echo(f"{outcome.kind}: {outcome.verdict}\n{outcome.text}")
        sys.exit(outcome.verdict not in RIGHT)
    counts: Counter[tuple[str, str]] = Counter()
    wrong = []
    with click.progressbar(fuzz(cases, seed), length=cases, file=sys.stderr) as outcomes:
        for outcome in outcomes:
            counts[outcome.kind, outcome.verdict] += 1
            if outcome.verdict not in RIGHT:
                wrong.append(outcome)
    if as_json:
        found = [{"damage": k, "outcome": v, "cases": n} for (k, v), n in sorted(counts.items())]
        click.echo(json.dumps({"cases": cases, "seed": seed, "found": found}, indent=2))
    else:
        Console().print(_table(counts))
    for outcome in wrong[:20]:
        last = outcome.text.strip().splitlines()[-1:] or [""]
        click.echo(
            f"case {outcome.number} ({outcome.kind}): {outcome.verdict}: {last[0]}", err=True
        )
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
