# SPDX-License-Identifier: Apache-2.0
"""The error that every fault of a rig file becomes."""


class RigError(Exception):
    """A fault of a rig file, one line: ``file:line: where: what; mend``.

    Attributes:
        source: File name, or what stands for it.
        line: Line counted from 1, or None if the fault has no place in the text.
        where: Dotted path of the faulty key, empty for the whole file.
        what: The fault.
        mend: What to do about it.
    """

    def __init__(self, source: str, line: int | None, where: str, what: str, mend: str) -> None:
        self.source = source
        self.line = line
        self.where = where
        self.what = " ".join(what.split())
        self.mend = " ".join(mend.split())
        place = source if line is None else f"{source}:{line}"
        subject = f" {where}:" if where else ""
        super().__init__(f"{place}:{subject} {self.what}; {self.mend}")
