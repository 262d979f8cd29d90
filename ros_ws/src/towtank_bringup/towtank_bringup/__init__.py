# SPDX-License-Identifier: Apache-2.0
"""The graph of a trial, the launch file and the `towtank` command."""
