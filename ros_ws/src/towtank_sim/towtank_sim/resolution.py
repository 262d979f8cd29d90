# SPDX-License-Identifier: Apache-2.0
"""How finely plant and twin are resolved where nobody says otherwise."""

SEGMENTS = 40
"""Of all lines together. `towtank bench segments` prints what they cost of the heave ratio."""

STEP = 0.005
"""Longest time step, s."""
