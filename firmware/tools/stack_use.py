# SPDX-License-Identifier: Apache-2.0
"""Print what a firmware image needs of flash, variables and stack, and fail if it does not fit.

    python stack_use.py ELF SU_FOLDER --flash BYTES --ram BYTES

The stack is the worst case of all paths: frames as the compiler states them (-fstack-usage, the
return address included), calls from the disassembly, and one interrupt upon the deepest path of
the main loop, for interrupts do not nest. A call through a pointer may go to every function whose
address is taken: the linker lists these as trampolines, a pointer being too short for this chip's
flash. Functions of the compiler's library, which state no frame, count with what they push.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

RETURN_ADDRESS = 3  # bytes: the chip's program counter has more than 16 bits
_FUNCTION = re.compile(r"^[0-9a-f]+ <([^>]+)>:$")
_CALL = re.compile(r"\t(?:r?call|r?jmp)\t.*<([^>+]+)>")
_INDIRECT = re.compile(r"\te?i(?:call|jmp)\b")
_PUSH = re.compile(r"\tpush\t")
_ENTRY = re.compile(r"main|__vector_\d+")
_TRAMPOLINES = "__trampolines_start"


class StackError(Exception):
    """The stack has no bound, or there is no room for it."""


@dataclass
class Function:
    """One function of the image: whom it calls, and what it pushes."""

    calls: set[str] = field(default_factory=set)
    indirect: bool = False
    pushes: int = 0


def functions(disassembly: str) -> dict[str, Function]:
    """Return the functions of `avr-objdump -d`."""
    found: dict[str, Function] = {}
    current = Function()
    for line in disassembly.splitlines():
        if start := _FUNCTION.match(line):
            name = start[1]
            current = found.setdefault(name, Function())
        elif call := _CALL.search(line):
            current.calls.add(call[1])
        elif _INDIRECT.search(line):
            current.indirect = True
        elif _PUSH.search(line):
            current.pushes += 1
    for name, function in found.items():
        function.calls = {callee for callee in function.calls if callee in found} - {name}
    return found


def frames(stack_usage: str) -> dict[str, int]:
    """Return the bytes of each function's frame from the lines of .su files.

    Raises StackError for a frame whose size the compiler does not know.
    """
    found: dict[str, int] = {}
    for line in stack_usage.splitlines():
        place, size, kind = line.split("\t")
        name = place.rsplit(":", 1)[1]
        if "static" not in kind and "bounded" not in kind:
            raise StackError(f"{place}: its frame is {kind}: give it a fixed size")
        found[name] = max(int(size), found.get(name, 0))
    return found


def deepest(image: Mapping[str, Function], sizes: Mapping[str, int]) -> dict[str, int]:
    """Return the worst case of the stack below main and below each interrupt, bytes.

    Raises StackError for functions that call themselves.
    """
    pointed_at = image[_TRAMPOLINES].calls if _TRAMPOLINES in image else set()
    path: list[str] = []

    @cache
    def below(name: str) -> int:
        if name in path:
            raise StackError(f"{' → '.join(path)} → {name}: recursion has no bound: unroll it")
        path.append(name)
        function = image[name]
        callees = function.calls | (pointed_at if function.indirect else set())
        own = sizes.get(name, RETURN_ADDRESS + function.pushes)
        total = own + max((below(callee) for callee in callees), default=0)
        path.pop()
        return total

    return {name: below(name) for name in image if _ENTRY.fullmatch(name)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("elf", type=Path)
    parser.add_argument("su_folder", type=Path)
    parser.add_argument("--flash", type=int, required=True)
    parser.add_argument("--ram", type=int, required=True)
    given = parser.parse_args()
    sections = _run("avr-size", "-A", given.elf)
    size = {line.split()[0]: int(line.split()[1]) for line in sections.splitlines()[2:] if line}
    flash = size.get(".text", 0) + size.get(".data", 0)
    variables = sum(size.get(section, 0) for section in (".data", ".bss", ".noinit"))
    stated = "".join(path.read_text() for path in sorted(given.su_folder.rglob("*.su")))
    try:
        depths = deepest(functions(_run("avr-objdump", "-d", given.elf)), frames(stated))
    except StackError as error:
        print(f"stack: {error}", file=sys.stderr)
        return 1
    loop = depths.pop("main")
    interrupt = max(depths, key=depths.__getitem__)
    stack = loop + depths[interrupt]
    free = given.ram - variables - stack
    print(
        f"flash {flash} of {given.flash} bytes; RAM {given.ram}: variables {variables}, stack at "
        f"most {stack} (main loop {loop}, {interrupt} {depths[interrupt]}), {free} free"
    )
    if flash > given.flash or free < 0:
        print("the firmware does not fit its chip: make it smaller", file=sys.stderr)
        return 1
    return 0


def _run(*command: object) -> str:
    return subprocess.run(
        [str(word) for word in command], check=True, capture_output=True, text=True
    ).stdout


if __name__ == "__main__":
    sys.exit(main())
