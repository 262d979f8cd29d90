# SPDX-License-Identifier: Apache-2.0
"""The driver of the ADC board: what is said to it, and what its scans mean in host time.

All waiting goes through the transport's read() and all time through `monotonic_ns`, so that the
same code drives a serial port in real time and a virtual board without a clock. Not thread-safe:
one thread at a time may call it.

Scans are handed to `on_scan` the moment that their frame is complete, also while the driver waits
for an answer. Lost scans are known exactly: the board numbers its ticks, sent or not, and tells at
the stop how many there were. Nothing is ever put in their place.

A board that was reset has begun its encoder counts anew, and what the shafts turned while it was
down is not known: its scans carry another `count_epoch`. The first epoch is the board's boot count,
so that a host that is started again goes on in the epoch of the counts, which the board keeps while
no host is there. (The boot count begins anew with the power, which a host that was not there then
cannot know.)

Nothing is said to a board that is not heard (link.py says why), but for the drive's orders to stop.

What a run survives, and how, is told in run.py.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

from towtank_daq.board.drive import Drive, DriveState, name_of
from towtank_daq.board.errors import BoardError, Refused
from towtank_daq.board.intake import Intake
from towtank_daq.board.link import (
    ANSWER_TIMEOUT_S,
    ATTEMPTS,
    CONNECT_TIMEOUT_S,
    Link,
    Transport,
)
from towtank_daq.board.recovery import Recovery
from towtank_daq.board.run import RESET_TIMEOUT_S, Run
from towtank_daq.board.snapshot import Snapshot
from towtank_daq.board.stream import Scan, Statistics, Stream
from towtank_daq.board.synchroniser import Synchroniser
from towtank_daq.clock import BoardClock, SyncExchange
from towtank_daq.configuration import (
    Configuration,
    ConfigurationError,
    configuration_at,
    configuration_of,
)
from towtank_daq.identity import StoredIdentity
from towtank_daq.protocol import Protocol
from towtank_daq.protocol_records import (
    CONFIGURATION,
    COUNTERS,
    IDENTITY,
    RESET,
    SELF_TEST,
    STOP,
    HealthFrame,
    IdentifyResponse,
    SetIdentityArguments,
    configure,
    set_identity,
)
from towtank_daq.self_test import SelfTest, judge

_SELF_TEST_TIMEOUT_S = 1.0  # it takes 0.26 s
_PATIENCE_S = 30.0  # time to find a plug that has come out and put it in again


class AdcBoard:
    """One board on one line: connect(), configure(), start(), poll() again and again, stop()."""

    def __init__(
        self,
        transport: Transport,
        protocol: Protocol,
        on_scan: Callable[[Scan], None],
        on_warning: Callable[[str], None],
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
        patience_s: float = _PATIENCE_S,
        on_drive: Callable[[DriveState], None] = lambda state: None,
    ) -> None:
        """patience_s: how long a run waits for a line or a board that has gone."""
        self.on_scan = on_scan
        self.on_warning = on_warning
        self._now_ns = monotonic_ns
        self._protocol = protocol
        self._board = protocol.board
        self._stream = Stream()
        self._link = Link(
            transport,
            protocol,
            lambda record, received_ns: self._intake.take(record, received_ns),
            self._warn,
            monotonic_ns,
            lambda: self.streaming,
        )
        self._synchroniser = Synchroniser(self._link, protocol)
        self._recovery = Recovery(patience_s, self._warn, monotonic_ns)
        self._drive = Drive(self._link, self._board)
        self._intake = Intake(
            protocol,
            self._link,
            self._synchroniser,
            self._stream,
            self._recovery,
            self._drive,
            lambda scan: self.on_scan(scan),
            self._warn,
            on_drive,
        )
        self.identity: IdentifyResponse | None = None
        self._run = Run(
            self._link,
            self._synchroniser,
            self._stream,
            self._recovery,
            self._intake,
            self.connect,
            lambda: self.configure(self._configuration),
            self._warn,
        )
        self._keep(configuration_at(self._board, self._board.sampling.rate_hz.default))

    # -- how it is

    @property
    def statistics(self) -> Statistics:
        """What has happened since start()."""
        return self._link.statistics

    @property
    def health(self) -> HealthFrame | None:
        """The board's counters, as told last."""
        return self._intake.health

    @property
    def clock(self) -> BoardClock:
        """The board's, as it is known now."""
        return self._synchroniser.clock

    @property
    def drive_state(self) -> DriveState | None:
        """Of the crank's drive, as told last; None since a reset of the board."""
        return self._drive.state

    @property
    def silence_s(self) -> float:
        """How long the driver has waited for a good frame since the last one, s."""
        return self._link.silent_s

    @property
    def streaming(self) -> bool:
        """Whether the board streams, as far as it has said."""
        return self._stream.running

    def snapshot(self) -> Snapshot:
        """How driver and board are now; it does not change any more."""
        return Snapshot(
            state=self._recovery.state,
            why=self._recovery.why,
            streaming=self.streaming,
            silence_s=self.silence_s,
            count_epoch=self._intake.counts.epoch,
            boot_count=self._intake.counts.boot_count,
            configuration=self._configuration,
            statistics=dataclasses.replace(
                self.statistics, frames=dataclasses.replace(self.statistics.frames)
            ),
            identity=self.identity,
            health=self.health,
            drive=self.drive_state,
        )

    # -- an idle board

    def use(self, transport: Transport) -> None:
        """Go on with the board on a line that was opened anew; connect() comes next.

        Who has known the board before sees a power cut, which its boot count does not tell.
        """
        self._link.use(transport)
        self._stream.running = False
        self._recovery.end_run()

    def connect(self, timeout_s: float = CONNECT_TIMEOUT_S) -> IdentifyResponse:
        """Find the board and make sure that it speaks this protocol; leaves it idle.

        A board that runs is heard within a second. One that resets because its port was opened is
        left in peace until its bootloader is through: it then reports its boot. A silent one is
        reset by DTR; where that does nothing, it is waited for as for a bootloader that is held.
        """
        self.identity = self._link.identify(timeout_s)
        self._link.command(STOP)
        counters = self.counters()
        if self._intake.counts.tells_of_reset(counters.boot_count):
            self._intake.board_was_reset(counters.reset_cause)
        if self._intake.counts.known and not self._synchroniser.has_run_on(self.board_time()):
            self._intake.forget()  # also where neither boot frame nor boot count tell of a reset
        self._intake.tell_of_adc(counters)
        self._intake.counts.found(counters.boot_count)
        return self.identity

    def configure(self, configuration: Configuration) -> None:
        """Set how the idle board scans; it keeps that over resets and power cuts.

        Raises BoardError, and nothing has changed, for what the board cannot do.
        """
        try:
            arguments = configuration.arguments(self._board)
        except ConfigurationError as error:
            raise BoardError(str(error)) from error
        try:
            self._link.command(configure(arguments))
        except Refused as error:
            # A crank that still comes to rest is no reason to wait with what is in force already
            if error.status != "drive_turns" or self.configuration() != configuration:
                raise
        self._keep(configuration)

    def _keep(self, configuration: Configuration) -> None:
        self._configuration = configuration
        self._stream.configured_mask = configuration.configured_mask(self._board)

    def configuration(self) -> Configuration:
        """How the board would scan now, whoever configured it."""
        return configuration_of(self._link.command(CONFIGURATION), self._board)

    def counters(self) -> HealthFrame:
        """The board's counters as they stand now."""
        return self._link.command(COUNTERS)

    def stored_identity(self) -> StoredIdentity:
        """What the board has stored of itself, read now."""
        record = self._link.command(IDENTITY)
        return StoredIdentity(
            name_of(self._board.identity_state, record.state),
            record.board_serial,
            record.calibration_id,
        )

    def store_identity(self, board_serial: int, calibration_id: int) -> None:
        """Give the idle board a serial number and a calibration id, each below 2^32 - 1, for good.

        Raises BoardError, also where its EEPROM does not hold them.
        """
        for name, number in (("serial number", board_serial), ("calibration id", calibration_id)):
            if not 0 <= number < 2**32 - 1:
                raise BoardError(f"{name} {number}: give one from 0 to {2**32 - 2}")
        self._link.command(set_identity(SetIdentityArguments(board_serial, calibration_id)))

    def self_test(self) -> SelfTest:
        """Let the idle board measure itself (0.3 s), and judge what it found."""
        record = self._link.command(SELF_TEST, timeout_s=_SELF_TEST_TIMEOUT_S)
        return judge(record, self._board)

    def reset(self) -> float:
        """Let the board reset itself, by its watchdog, and wait until it is up again, idle.

        A stream ends with it: its scans are those received so far. Returns the time taken, s.
        """
        self._stream.running = False
        self._recovery.end_run()
        self._intake.booted = False
        for _ in range(ATTEMPTS):
            asked_ns = self._now_ns()
            response = self._link.exchange(RESET, ANSWER_TIMEOUT_S)
            if response is not None:
                self._link.accepted(RESET, response)
            # Also without an answer, which may have been lost: to ask again would reset it again
            until_ns = self._now_ns() + round(1e9 * RESET_TIMEOUT_S)
            self._link.wait(until_ns, lambda: self._intake.booted)
            if self._intake.booted:
                return (self._now_ns() - asked_ns) / 1e9
        raise BoardError(
            "the board does not come back from a reset: switch its power off and on (a Mega's "
            "bootloader of before 2012 does not survive the watchdog: burn a newer one)"
        )

    def board_time(self) -> SyncExchange:
        """One exchange of times with the board, which the clock does not learn from."""
        return self._synchroniser.board_time()

    def drive(self, action: str, speed_rpm: float = 0.0, counts_per_revolution: int = 0) -> None:
        """Ask the crank's drive for an action of board.yaml's `drive_action`.

        speed_rpm: for `run`. counts_per_revolution: of the crank's encoder, for `run` and `watch`;
        negative where it counts backwards. Within each of the board's `command_timeout_s` it wants
        a `keep`.
        Raises BoardError for what the drive cannot do.
        """
        self._drive.ask(action, speed_rpm, counts_per_revolution)

    # -- a run

    def start(self) -> None:
        """Learn the board's clock and start the stream; scans count from 0."""
        self._run.start(self.identity)

    def poll(self, timeout_s: float) -> None:
        """Take in what comes within `timeout_s`; keeps clock and board alive meanwhile.

        Raises NoAnswer or OSError when the board has been silent, or the line gone, for longer than
        the driver's patience; BoardError for a board that cannot be started again, or whose scans
        have had no valid channel for that long.
        """
        self._run.poll(timeout_s)

    def stop(self) -> None:
        """Stop the stream and settle the account of the scans.

        A stream that had ended, with the board reset or gone idle, is charged with what would have
        come up to this call. Raises NoAnswer or OSError, the account settled, when there is no
        board to stop.
        """
        self._run.stop()

    def _warn(self, text: str) -> None:
        self.on_warning(text)
