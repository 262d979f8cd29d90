# SPDX-License-Identifier: Apache-2.0
"""Lifecycle node that owns the ADC board and publishes its scans.

configure: open the port, find the board, check its schema; activate: start the stream;
deactivate: stop it; cleanup: close the port. While active, one thread of its own sits in the
serial port's read and publishes each scan, and the drive's state, as its frame is complete
(rclpy's publish may be called from any thread, and handing over to the executor would cost a
wake-up a scan). The thread is the only user of the driver as long as it runs, and so it also
serves the crank's drive. Between runs transitions use the driver, and stops of the crank; a lock
keeps these apart. When the board fails, the node goes back to unconfigured, says why, and
can be configured again.
"""

from __future__ import annotations

import functools
import math
import statistics
import sys
import threading
import time
from array import array
from collections.abc import Callable
from typing import Any

from rclpy.experimental import EventsExecutor
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from towtank_interfaces.msg import AdcScan
from towtank_node.diagnostics import NodeDiagnostics
from towtank_node.endpoints import qos_profile
from towtank_node.lifecycle import ManagedNode
from towtank_node.main import run_nodes
from towtank_node.names import BOARD_FRAME, BOARD_NODE, split_name
from towtank_node.parameters import Parameter, read_parameters
from towtank_node.stamps import set_stamp
from towtank_node.topics import SCANS
from towtank_node.trial_clock import TrialClock
from towtank_rig import RigError, load_rig
from towtank_rig.conversion import crank_encoder

from towtank_daq.board import AdcBoard, BoardError, DriveState, Scan
from towtank_daq.board_thread import FAILURES, BoardThread
from towtank_daq.configuration import configuration_at
from towtank_daq.crank_drive import CrankDrive
from towtank_daq.crank_drive_node import CrankDriveNode
from towtank_daq.description import (
    BoardDescription,
    DescriptionError,
    installed_description,
    load_description,
)
from towtank_daq.identity import calibration_mismatch, number_text
from towtank_daq.protocol import Protocol, ProtocolError, troubles
from towtank_daq.serial_port import SerialPort

_CLOCK_STEP_S = 0.01  # reading one clock after the other costs microseconds
EXPECTED_ERRORS = (RigError, DescriptionError, ProtocolError)
"""That making the node may end with: a rig or a board that does not fit."""
_NOT_ACTIVE = "the board's node is not active any more"
_STOP_S = 1.0  # what a stop between runs waits for a transition that goes on


def _alone(transition: Callable[..., Any]) -> Callable[..., Any]:
    """No stop of the crank from another thread comes in between."""

    @functools.wraps(transition)
    def held(self: AdcBoardNode, *arguments: Any) -> Any:
        with self._between_runs:
            return transition(self, *arguments)

    return held


class AdcBoardNode(ManagedNode):
    """The ADC board on a serial port, node /measured/adc_board.

    on_scan: gets each scan too, once it is published, in the serial thread; it may neither raise
    nor keep the message.
    """

    def __init__(self, on_scan: Callable[[AdcScan], None] = lambda scan: None) -> None:
        namespace, name = split_name(BOARD_NODE)
        super().__init__(name, namespace=namespace)
        self._on_scan = on_scan
        board = load_description(installed_description())
        rates = board.sampling.rate_hz
        parameters = read_parameters(
            self,
            [
                Parameter("port", str, "path of the board's serial port"),
                Parameter(
                    "rate_hz",
                    int,
                    "scans per second",
                    rates.default,
                    minimum=rates.minimum,
                    maximum=rates.maximum,
                ),
                Parameter("rig", str, "path of the rig file"),
                Parameter(
                    "any_calibration",
                    bool,
                    "whether a board of another calibration than the rig's is taken",
                    False,
                ),
                Parameter(
                    "patience_s",
                    float,
                    "how long a run waits for a port or a board that has gone, s",
                    30.0,
                    minimum=0.0,
                    maximum=3600.0,
                ),
                Parameter(
                    "drives_crank",
                    bool,
                    "whether the board's drive may turn the crank, or something else does",
                    True,
                ),
            ],
        )
        _check_channels(parameters.rig, board)
        rig = load_rig(parameters.rig)
        crank = crank_encoder(rig)
        counts = round(math.copysign(crank.counts_per_revolution, crank.per_count))
        self._drive = CrankDrive(counts, self._on_warning)
        self._trial_clock = TrialClock(self)
        self._between_runs = threading.RLock()  # by whom the driver is used without the thread
        self.drive_node = (
            CrankDriveNode(board, self._trial_clock, self._stop_between_runs)
            if parameters.drives_crank
            else None
        )
        self._calibration_id = rig.board.calibration_id
        self._any_calibration = parameters.any_calibration
        self._protocol = Protocol(board)
        self._port_path = parameters.port
        self._patience_s = parameters.patience_s
        self._rate_hz = parameters.rate_hz
        self._port: SerialPort | None = None
        self._board: AdcBoard | None = None
        self._driver: AdcBoard | None = None  # kept where _board is not: it knows the counts' epoch
        self._thread = BoardThread(self._drive, self.get_logger().error, self._on_thread_ended)
        self._failure = ""
        self._told_step_s = 0.0
        self._latencies_s: list[float] = []
        self._scans = self.create_lifecycle_publisher(
            SCANS.type, SCANS.name, qos_profile(SCANS.qos)
        )
        self._message = AdcScan()
        self._message.header.frame_id = BOARD_FRAME
        self._configuration = configuration_at(board, self._rate_hz)
        self._message.channel_delay_ns = self._configuration.channel_delays_ns(board)
        self._diagnostics = NodeDiagnostics(self, 1.0 / self._rate_hz, self._details)

    # -- transitions

    @_alone
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self._failure = ""
        try:
            self._port = SerialPort(self._port_path, self._protocol.board.wire.baud)
            if self._driver is None:
                self._driver = AdcBoard(
                    self._port,
                    self._protocol,
                    self._publish,
                    self._on_warning,
                    patience_s=self._patience_s,
                    on_drive=self._on_drive,
                )
            else:
                self._driver.use(self._port)
            self._board = self._driver
            identity = self._board.connect()
            self._check_calibration()
            self._board.configure(self._configuration)
        except FAILURES as error:
            self._fail(str(error))
            return TransitionCallbackReturn.FAILURE
        version = ".".join(map(str, identity.firmware_version))
        self.get_logger().info(
            f"board {number_text(identity.board_serial)} on {self._port_path}: firmware {version}, "
            f"calibration {number_text(identity.calibration_id)}"
        )
        return super().on_configure(state)

    @_alone
    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        # Taken once: slewing moves the system's and the monotonic clock alike, and a later step of
        # the system's clock must not tear the record
        if not self._trial_clock.given:
            self._trial_clock.offset_ns = self._trial_clock.measured_offset_ns()
        self._told_step_s = 0.0
        result = super().on_activate(state)
        try:
            board = self._connected()
            board.start()
        except FAILURES as error:
            self._failure = str(error)
            return TransitionCallbackReturn.ERROR
        self._diagnostics.ready(f"streaming at {self._rate_hz} Hz")  # the thread may have warnings
        self._thread.start(board)
        self._attend(self._drive)
        return result

    @_alone
    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        self._join()
        try:
            if not self._failure:
                board = self._connected()
                self._drive.release(board)
                board.stop()
        except FAILURES as error:
            self._failure = str(error)
        self._drive.refuse(_NOT_ACTIVE)
        if self._failure:
            return TransitionCallbackReturn.ERROR
        self._diagnostics.stop("not streaming: deactivated")
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.close()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.close()
        return super().on_shutdown(state)

    @_alone
    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Back to unconfigured, from where the node can be configured again."""
        super().on_deactivate(state)
        self._fail(self._failure or f"fault in the transition from '{state.label}'")
        return TransitionCallbackReturn.SUCCESS

    @_alone
    def close(self) -> None:
        """Leave the board idle and give the port back."""
        self._join()
        if self._board is not None and self._board.streaming and not self._failure:
            try:
                self._drive.release(self._board)
                self._board.stop()
            except FAILURES as error:
                self.get_logger().warning(str(error))
        self._drive.refuse(_NOT_ACTIVE)
        if self._port is not None:
            self._port.close()
        self._port = self._board = None

    # -- the serial thread

    def _on_thread_ended(self, failure: str) -> None:
        self._failure = failure
        self.executor.create_task(self._on_thread_failed)

    def _publish(self, scan: Scan) -> None:
        with self._diagnostics.cycle():
            message = self._message
            set_stamp(message.header.stamp, scan.stamp_ns + self._trial_clock.offset_ns)
            message.sequence = scan.sequence
            message.board_ticks = scan.ticks
            message.configured_mask = scan.configured_mask
            message.valid_mask = scan.valid_mask
            message.flags = scan.flags
            message.codes = array("I", scan.codes)
            message.crank_count = scan.crank
            message.carriage_count = scan.carriage
            message.count_epoch = scan.count_epoch
            self._scans.publish(message)
            self._latencies_s.append((time.monotonic_ns() - scan.stamp_ns) * 1e-9)
        self._on_scan(message)

    def _on_warning(self, text: str) -> None:
        """What the driver has to say in a run, which it goes on with."""
        self.get_logger().warning(text)
        self._diagnostics.warn(text)

    # -- the crank's drive

    def _on_drive(self, state: DriveState) -> None:
        if self.drive_node is not None:
            self.drive_node.publish(state)

    def _attend(self, drive: CrankDrive | None) -> None:
        if self.drive_node is not None:
            self.drive_node.attend(drive)

    def _stop_between_runs(self, action: str) -> str | None:
        """Ask a board that is connected, but does not stream, for a stop. From any thread.

        Returns why it has not stopped, '' if it has, None if the serial thread serves the drive.
        """
        if not self._between_runs.acquire(timeout=_STOP_S):
            return "the board is just being connected or started: ask again"
        try:
            if self._thread.serves:
                return None
            self._connected().drive(action)
        except FAILURES as error:
            return str(error)
        finally:
            self._between_runs.release()
        return ""

    # -- the rest

    def _connected(self) -> AdcBoard:
        """The board. Raises BoardError if there is none."""
        if self._board is None:
            raise BoardError("the board's node is not connected: configure it first")
        return self._board

    def _check_calibration(self) -> None:
        """Refuse a board that the rig's calibrations are not of, or warn of it."""
        mismatch = calibration_mismatch(self._connected().stored_identity(), self._calibration_id)
        if mismatch and not self._any_calibration:
            raise BoardError(mismatch)
        if mismatch:
            self._on_warning(mismatch)

    def _watch_host_clock(self) -> float:
        """How far the host's clock has stepped in the run, s; a step is told once."""
        if not self._thread.serves:
            return 0.0
        step_s = (self._trial_clock.measured_offset_ns() - self._trial_clock.offset_ns) * 1e-9
        if abs(step_s - self._told_step_s) > _CLOCK_STEP_S:
            self._told_step_s = step_s
            self._on_warning(
                f"the host's clock has stepped by {step_s:+.3f} s: the stamps of this run keep the "
                "clock that it began with; let the host's time settle before the next"
            )
        return step_s

    def _on_thread_failed(self) -> None:
        if self._failure and self._thread.serves:
            self.trigger_deactivate()

    def _join(self) -> None:
        self._attend(None)
        self._thread.join()

    def _fail(self, message: str) -> None:
        self._failure = message
        self.get_logger().error(message)
        self._diagnostics.fail(message)
        self.close()

    def _details(self) -> dict[str, object]:
        board = self._board
        if board is None:
            return {}
        latencies, self._latencies_s = self._latencies_s, []
        counted, clock, health = board.statistics, board.clock, board.health
        details: dict[str, object] = {
            "scans_scheduled": counted.scans_scheduled,
            "scans_received": counted.scans_received,
            "scans_lost": counted.scans_lost,
            "scans_bad": counted.scans_bad,
            "restarts": counted.restarts,
            "reconnections": counted.reconnections,
            "line_repairs": counted.line_repairs,
            "silence_s": f"{board.silence_s:.1f}",
            "bad_frames": counted.frames.bad,
            "unknown_frames": counted.unknown_frames,
            "sync_failures": counted.sync_failures,
            "clock_rate_ppm": f"{clock.rate_ppm:.1f}",
            "clock_u95_us": f"{1e6 * clock.u95_s:.1f}",
            "host_clock_step_s": f"{self._watch_host_clock():.3f}",
            "clock_residual_us": f"{1e6 * clock.residual_s:.1f}",
            "clock_round_trip_us": f"{1e6 * clock.round_trip_s:.1f}",
        }
        if latencies:
            details["latency_median_ms"] = f"{1e3 * statistics.median(latencies):.2f}"
            details["latency_max_ms"] = f"{1e3 * max(latencies):.2f}"
        if health is not None:
            details["board_reset_cause"] = self._protocol.reset_causes(health.reset_cause)
            details["board_boot_count"] = health.boot_count
            details["board_stack_low_water"] = health.stack_low_water
            details["board_configuration"] = self._protocol.configuration_origin(
                health.configuration_origin
            )
            details["board_adc_told_of"] = self._protocol.adc_errors(health.adc_error_bits)
            details |= {f"board_{name}": count for name, count in troubles(health).items()}
        return details


def _check_channels(rig_path: str, board: BoardDescription) -> None:
    """Refuse a rig whose board is wired otherwise than the firmware scans it."""
    wired = list(load_rig(rig_path).board.channels)
    if wired != board.channel_names:
        raise RigError(
            rig_path,
            None,
            "board.channels",
            f"the rig has {', '.join(wired)}",
            f"give them as the board scans them: {', '.join(board.channel_names)}",
        )


def make_nodes(on_scan: Callable[[AdcScan], None] = lambda scan: None) -> list[Node]:
    """Make the board's node, and that of the crank's drive on it, if there is one."""
    board = AdcBoardNode(on_scan)
    return [board] if board.drive_node is None else [board, board.drive_node]


def main() -> None:
    sys.exit(run_nodes(make_nodes, EXPECTED_ERRORS, make_executor=EventsExecutor))
