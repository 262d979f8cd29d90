# SPDX-License-Identifier: Apache-2.0
"""The simulator in its two roles, plant and twin, and the virtual bench."""
