# SPDX-License-Identifier: Apache-2.0
"""The worst case of the stack, on an image small enough to count by hand."""

import unittest

from stack_use import StackError, deepest, frames, functions

DISASSEMBLY = """
000000e4 <__trampolines_start>:
  e4:\t0c 94 00 00 \tjmp\t0x400\t; 0x400 <handler>
00000100 <main>:
 100:\t0e 94 00 00 \tcall\t0x200\t; 0x200 <poll>
00000200 <poll>:
 200:\t0e 94 00 00 \tcall\t0x300\t; 0x300 <__mulsi3>
 204:\t19 95       \teicall
00000300 <__mulsi3>:
 300:\t0f 93       \tpush\tr16
 302:\t08 95       \tret
00000400 <handler>:
 400:\t0e 94 00 00 \tcall\t0x300\t; 0x300 <__mulsi3>
00000500 <__vector_1>:
 500:\t1f 92       \tpush\tr1
"""
STATED = "a.c:1:5:main\t3\tstatic\na.c:9:6:poll\t10\tstatic\na.c:20:6:handler\t40\tstatic\n"


class StackUse(unittest.TestCase):
    def test_deepest_path_goes_through_the_pointer(self):
        """3 + 10 + 40 + (3 + 1); an interrupt without a statement pushes one byte."""
        found = deepest(functions(DISASSEMBLY), frames(STATED))
        self.assertEqual(found, {"main": 57, "__vector_1": 4})

    def test_recursion_has_no_bound(self):
        looped = DISASSEMBLY.replace("0x300 <__mulsi3>\n00000500", "0x200 <poll>\n00000500")
        with self.assertRaisesRegex(StackError, "recursion"):
            deepest(functions(looped), frames(STATED))

    def test_frame_of_unknown_size_is_refused(self):
        with self.assertRaisesRegex(StackError, "give it a fixed size"):
            frames("a.c:1:5:f\t30\tdynamic\n")


if __name__ == "__main__":
    unittest.main()
