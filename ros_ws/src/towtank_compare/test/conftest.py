# SPDX-License-Identifier: Apache-2.0
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # the tests share synthetic_trial

from synthetic_trial import trial_samples, write_trial


@pytest.fixture(scope="session")
def trial_bag(tmp_path_factory) -> Path:
    """The synthetic trial as a bag directory."""
    return write_trial(tmp_path_factory.mktemp("trial") / "bag", trial_samples())
