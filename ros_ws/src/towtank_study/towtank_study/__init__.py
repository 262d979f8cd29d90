# SPDX-License-Identifier: Apache-2.0
"""Parameter studies of a rig's tow: which samples, their simulation on many cores, what comes out.

`running.run_study` does a whole study. Its parts serve other work on the same rigs: `execution`
evaluates any function over many samples, `tow_run.simulate` gives the outputs of one rig.
"""
