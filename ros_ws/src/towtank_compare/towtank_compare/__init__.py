# SPDX-License-Identifier: Apache-2.0
"""Heave ratios, live and from bags, their uncertainty, and the report of a trial.

`heave.analyse_window` is the one analysis that everything here goes through.
"""
