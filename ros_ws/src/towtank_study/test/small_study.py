# SPDX-License-Identifier: Apache-2.0
"""A small study of a rig that comes with the project."""

SMALL = """\
name: small
description: Three lengths of the secondary cable, a short run.
rig: wu_chwang_2001
parameters:
  - path: lines.secondary.length
    values: [1.0, 1.5, 2.0]
design: {kind: full_factorial}
simulation: {settling_time: 5 s, periods: 2, segments: 6}
outputs: [heave_ratio_nose, depressor_heave, top_tension]
"""
