# SPDX-License-Identifier: Apache-2.0
"""Settings of all tests: the installed simulation core, and one hypothesis profile."""

# Imported before pytest puts the repository's root on the path, where the folder sim_core would
# stand in for the installed package.
from hypothesis import settings

import sim_core  # noqa: F401

# A loaded machine may be slow: time limits an example in no test.
settings.register_profile("towtank", deadline=None)
settings.load_profile("towtank")
