# SPDX-License-Identifier: Apache-2.0
"""What the drive's node makes of the board's word on a trip."""

from types import SimpleNamespace

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from towtank_daq.board import TRIP_ADVICE, DriveState
from towtank_daq.crank_drive_node import CrankDriveNode
from towtank_interfaces.msg import CrankDrive
from towtank_node.trial_clock import TrialClock


def state(name: str, trip: str) -> DriveState:
    return DriveState(0, name, trip, 0.0, 0.0, 30.0, 0.0, emergency_stop_closed=True)


@pytest.fixture
def node(description):
    rclpy.init()
    process = rclpy.create_node("process")
    made = CrankDriveNode(description, TrialClock(process), lambda action: "no board")
    yield made
    made.destroy_node()
    process.destroy_node()
    rclpy.try_shutdown()


def test_a_crank_that_turns_on_after_its_trip_is_an_error_that_says_what_to_do(node):
    told = []
    node.diagnostics._publisher = SimpleNamespace(publish=lambda array: told.extend(array.status))
    for each in (
        state("running", "none"),
        state("tripped", "overspeed"),
        state("tripped", "runaway"),
        state("stopped", "none"),
    ):
        node.publish(each)
    assert [status.level for status in told] == [
        DiagnosticStatus.ERROR,
        DiagnosticStatus.ERROR,
        DiagnosticStatus.OK,
    ]
    assert told[0].message.startswith("overspeed: see what let the crank run ahead")
    assert "cut the motor's supply at the main switch" in told[1].message
    assert node._message.trip == CrankDrive.NONE


def test_a_trip_that_the_board_has_forgotten_stays_an_error_until_it_is_cleared(node):
    told = []
    node.diagnostics._publisher = SimpleNamespace(publish=lambda array: told.extend(array.status))
    drive = SimpleNamespace(trip="runaway")
    node.attend(drive)
    node.publish(state("tripped", "runaway"))
    node.publish(state("stopped", "none"))  # after a reset
    assert [status.level for status in told] == [DiagnosticStatus.ERROR]
    drive.trip = "none"
    node.publish(state("stopped", "none"))
    assert told[-1].level == DiagnosticStatus.OK


def test_every_trip_has_its_advice_and_its_constant(description):
    for name, number in description.drive_trip.items():
        assert getattr(CrankDrive, name.upper()) == number
        assert name == "none" or name in TRIP_ADVICE
