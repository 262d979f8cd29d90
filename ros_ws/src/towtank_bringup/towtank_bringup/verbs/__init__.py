# SPDX-License-Identifier: Apache-2.0
"""The verbs of the `towtank` command, one a file."""
