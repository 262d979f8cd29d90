# SPDX-License-Identifier: Apache-2.0
"""The error that every fault of a study becomes."""


class StudyError(Exception):
    """A fault of a study, one line that names the place, the cause and the mend."""
