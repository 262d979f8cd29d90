# SPDX-License-Identifier: Apache-2.0
"""Uncertainty of what a rig measures: error terms, budgets, combination, Monte Carlo (GUM)."""
