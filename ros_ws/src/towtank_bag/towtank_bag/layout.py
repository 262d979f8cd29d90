# SPDX-License-Identifier: Apache-2.0
"""Names inside a bag directory, shared by writer and reader."""

RECORDING_MARKER = "RECORDING"
"""Present while a bag is written. Where it remains, the recording did not end cleanly."""

METADATA_FILE = "metadata.yaml"
"""rosbag2's index of the directory, written last."""

RIG_ATTACHMENT = "rig.yaml"
"""The rig file, letter for letter."""

CALIBRATION_ATTACHMENT = "calibration.json"
"""The rig's calibrations as they were at the time."""

RECORDER_METADATA = "towtank"
"""MCAP metadata record: software version, rig name, rig hash."""


class BagError(RuntimeError):
    """A bag cannot be written or read; the text names the cause and the mend in one line."""
