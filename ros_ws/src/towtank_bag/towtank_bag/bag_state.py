# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a bag, in words, and where in the recording something is lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from towtank_bag.bag_files import BagFiles
from towtank_bag.layout import METADATA_FILE, RECORDING_MARKER
from towtank_bag.mcap_scan import Scan

_STRETCHES_NAMED = 3


@dataclass(frozen=True)
class LostStretch:
    """A part of the recording in which messages are lost, or may be: between two log times, ns
    since the epoch. None: from the beginning, or to the end."""

    from_ns: int | None
    to_ns: int | None


@dataclass(frozen=True)
class BagState:
    """problem: what is damaged or missing, None for a whole bag. notes: what else should be known.
    lost: in no order. type_hashes: by topic, as metadata.yaml gives them."""

    problem: str | None
    notes: list[str]
    lost: list[LostStretch]
    type_hashes: dict[str, str]


def state_of(
    directory: Path, files: BagFiles, scans: Sequence[Scan], unreadable: Sequence[Path]
) -> BagState:
    """The state of a bag whose files have been scanned; unreadable: those that are no MCAP."""
    begin_ns = min((s.first_ns for s in scans if s.first_ns is not None), default=0)
    absent = [*files.missing, *(path.name for path in unreadable if files.listed)]
    problems = [text for scan in scans if (text := _damage_text(scan, begin_ns))]
    problems += [f"{name} is of the bag by its {METADATA_FILE} and lost" for name in absent]
    notes = [
        *files.notes,
        *(f"{path.name} is no MCAP file and was passed over" for path in unreadable),
        *(note for scan in scans for note in _notes(scan)),
    ]
    lost = [stretch for scan in scans for stretch in _lost_stretches(scan)]
    if absent:
        lost.append(LostStretch(None, None))
    if (directory / RECORDING_MARKER).exists() or any(scan.broke_off for scan in scans):
        problems.insert(0, "the recording broke off; the bag is read as far as it goes")
    elif not (directory / METADATA_FILE).exists():
        notes.append(f"{METADATA_FILE} is missing: whether all files are there cannot be told")
    counted = sum(scan.count + scan.repeated for scan in scans)
    if not problems and files.message_count is not None and counted < files.message_count:
        problems.append(
            f"{files.message_count - counted} of {files.message_count} messages are not there"
        )
        lost.append(LostStretch(None, None))
    if files.message_count is not None and counted > files.message_count:
        notes.append(
            f"the files hold {counted} messages, {files.message_count} by {METADATA_FILE}: one of "
            "them is of another recording, or damaged"
        )
    return BagState(
        f"{directory}: {'; '.join(problems)}" if problems else None, notes, lost, files.type_hashes
    )


def _damage_text(scan: Scan, begin_ns: int) -> str:
    """What is damaged in one file, and what that has cost; empty for a whole one."""
    facts = []
    if count := sum(damage.messages for damage in scan.damage):
        facts.append(f"{count} damaged {'places are' if count > 1 else 'place is'} left out")
    facts += [f"{name} is damaged" for damage in scan.damage for name in damage.names]
    if scan.nameless:
        facts.append(f"what topics {scan.nameless} of the messages are of is lost")
    if scan.summary_lost:
        facts.append("the end is damaged")
    if scan.data_crc_holds is False and not facts:
        facts.append("it does not agree with its checksum")
    if not facts and not scan.lost:
        return ""
    return f"{scan.path.name}: {', '.join([*facts, _cost(scan, begin_ns)])}"


def _cost(scan: Scan, begin_ns: int) -> str:
    if scan.lost == 0 or (scan.lost is None and not scan.damage and not scan.nameless):
        return "no message is lost"
    lost = "how many messages are lost is not known"
    if scan.lost is not None:
        lost = f"{scan.lost} of {scan.expected} messages are lost"
    stretches = _lost_stretches(scan)
    where = [_words(stretch, begin_ns) for stretch in stretches[:_STRETCHES_NAMED]]
    if len(stretches) > _STRETCHES_NAMED:
        where.append(f"and {len(stretches) - _STRETCHES_NAMED} times more")
    return f"{lost} ({', '.join(where)})"


def _words(stretch: LostStretch, begin_ns: int) -> str:
    """Where a stretch is, in s after the bag's first message."""
    begin, end = (
        None if ns is None else f"{(ns - begin_ns) * 1e-9:.2f} s"
        for ns in (stretch.from_ns, stretch.to_ns)
    )
    if begin is None and end is None:
        return "anywhere"
    if begin is None:
        return f"before {end}"
    return f"after {begin}" if end is None else f"between {begin} and {end} of the recording"


def _lost_stretches(scan: Scan) -> list[LostStretch]:
    stretches = []
    if scan.lost != 0:
        stretches = [
            LostStretch(damage.from_ns, damage.to_ns) for damage in scan.damage if damage.messages
        ]
        if not stretches and (scan.lost or scan.nameless):
            stretches = [LostStretch(None, None)]
    if scan.broke_off:
        stretches.append(LostStretch(scan.last_ns, None))
    return list(dict.fromkeys(stretches))


def _notes(scan: Scan) -> list[str]:
    notes = []
    if not scan.checked:
        notes.append(
            f"{scan.path.name}: its messages carry no checksums: damage to them is not noticed"
        )
    if scan.private_records:
        notes.append(
            f"{scan.path.name}: {scan.private_records} records of a kind that is not known were "
            "passed over"
        )
    if scan.repeated:
        notes.append(
            f"{scan.path.name}: {scan.repeated} of its messages are in another file too and count "
            "once"
        )
    return notes
