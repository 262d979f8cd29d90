# SPDX-License-Identifier: Apache-2.0
"""The rig file that a bag was recorded with, believed only if it is shown to be that."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from towtank_node.topics import RIG

from towtank_bag.layout import RECORDER_METADATA, RIG_ATTACHMENT, BagError
from towtank_bag.reader import Bag


@dataclass(frozen=True)
class RecordedRig:
    """text: of the rig file, letter for letter. note: what was wrong with the other copies, or that
    nothing shows that this one is right; None where all is well."""

    text: str
    note: str | None


def recorded_rig(bag: Bag) -> RecordedRig:
    """The rig of a bag, from its attachment or from the topic /rig.

    The recorder notes the rig's SHA-256: the copy that agrees with it is the rig. Where it noted
    none, an intact copy counts; where no copy agrees, one counts that is there twice, for then the
    note is damaged. Raises BagError where no copy can be believed.
    """
    attached = bag.attached_files.get(RIG_ATTACHMENT)
    published = _published(bag)
    noted = bag.metadata.get(RECORDER_METADATA, {}).get("rig_sha256")
    copies = ([attached.data] if attached is not None else []) + published
    if not copies:
        raise BagError(f"{bag.directory}: the bag holds no rig file; give it with --rig FILE")
    spoilt = f"the attached {RIG_ATTACHMENT} is damaged: the rig is that of {RIG.name}"
    twice = attached is not None and attached.data in published
    if noted is not None:
        for copy in copies:
            if hashlib.sha256(copy).hexdigest() == noted:
                right = attached is None or copy == attached.data
                return RecordedRig(_text(bag, copy), None if right else spoilt)
        if twice:
            note = "the recorder's note of the rig's hash is damaged; both copies of the rig agree"
            return RecordedRig(_text(bag, copies[0]), note)
    elif attached is not None and (attached.intact or twice):
        return RecordedRig(_text(bag, attached.data), None)
    elif attached is not None and attached.intact is None and not published:
        note = f"nothing shows whether the attached {RIG_ATTACHMENT} is undamaged"
        return RecordedRig(_text(bag, attached.data), note)
    elif len(published) == 1 and (attached is None or attached.intact is False):
        return RecordedRig(_text(bag, published[0]), None if attached is None else spoilt)
    raise BagError(
        f"{bag.directory}: the rig file in the bag is damaged or not the one that it was recorded "
        "with; give that with --rig FILE"
    )


def _published(bag: Bag) -> list[bytes]:
    """The different texts on the topic; none where it holds something else."""
    try:
        messages = [message for _, message in bag.messages(RIG.name)]
    except BagError:
        return []
    texts = [message.data for message in messages if isinstance(getattr(message, "data", 0), str)]
    return [text.encode() for text in dict.fromkeys(texts)]


def _text(bag: Bag, copy: bytes) -> str:
    try:
        return copy.decode()
    except UnicodeDecodeError as error:
        raise BagError(
            f"{bag.directory}: the rig file in the bag is no UTF-8 text; give it with --rig FILE"
        ) from error
