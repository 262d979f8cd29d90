# SPDX-License-Identifier: Apache-2.0
"""What is made of a trial's bag once it is closed, and the mark that its directory gets."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from typing import Any

from towtank_bag.reader import BagError
from towtank_compare.report import write_report
from towtank_compare.trial_result import trial_result
from towtank_rig import RigError

from towtank_bringup.conductor import TrialError
from towtank_bringup.processes import ProcessError
from towtank_bringup.ros_domain import DomainError
from towtank_bringup.run_file import RunFileError
from towtank_bringup.trial_directory import TrialDirectory, TrialDirectoryError
from towtank_bringup.twin_discretisation import twin_discretisation


class IncompleteTrial(RuntimeError):
    """The trial did not end well; its directory is marked. One line: cause and mend."""


FAULTS = (
    *(TrialError, ProcessError, TrialDirectoryError),
    *(RigError, BagError, RunFileError, DomainError),
)
"""What a trial can meet, each told in one line."""


@contextlib.contextmanager
def marked(directory: TrialDirectory) -> Iterator[None]:
    """Around a trial: its directory is marked by how the trial ends.

    Raises IncompleteTrial for the faults that a trial can meet; others pass as they are.
    """
    try:
        yield
        directory.complete()
    except BaseException as error:
        done = directory.incomplete()
        if isinstance(error, FAULTS):
            raise IncompleteTrial(f"{error} ({done})") from error
        if isinstance(error, OSError):
            place = error.filename or directory.path
            raise IncompleteTrial(
                f"{place}: {error.strerror}: mend that and start again ({done})"
            ) from error
        raise


def close_trial(directory: TrialDirectory, say: Callable[[str], None]) -> dict[str, Any]:
    """Compute result.json and report.html from the bag. Returns the result."""
    if directory.renamed:
        say(f"warning: the trial's directory was renamed meanwhile: it is {directory.path} now")
    say("computing the heave ratios and the report")
    result = trial_result(directory.bag)
    result["twin_discretisation"] = twin_discretisation(directory.bag, result["window"])
    directory.result.write_text(json.dumps(result, indent=2) + "\n")
    write_report(directory.bag, result, directory.report)
    return result
