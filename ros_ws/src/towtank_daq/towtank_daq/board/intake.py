# SPDX-License-Identifier: Apache-2.0
"""What the board tells, by itself or as an answer, and what follows from it for a run."""

from __future__ import annotations

from collections.abc import Callable

from towtank_daq.adc_watch import AdcWatch
from towtank_daq.board.advice import CONFIGURATION_LOST
from towtank_daq.board.counts import Counts
from towtank_daq.board.drive import Drive, DriveState
from towtank_daq.board.link import Link
from towtank_daq.board.recovery import Recovery
from towtank_daq.board.stream import Scan, Stream
from towtank_daq.board.synchroniser import Synchroniser
from towtank_daq.protocol import Protocol, Response
from towtank_daq.protocol_records import (
    START,
    BootFrame,
    DataFrame,
    DriveFrame,
    HealthFrame,
    StartResponse,
    StreamFrame,
)


class Intake:
    """Takes records in their order; scans and states of the drive go out at once."""

    def __init__(
        self,
        protocol: Protocol,
        link: Link,
        synchroniser: Synchroniser,
        stream: Stream,
        recovery: Recovery,
        drive: Drive,
        on_scan: Callable[[Scan], None],
        on_warning: Callable[[str], None],
        on_drive: Callable[[DriveState], None],
    ) -> None:
        self._protocol = protocol
        self._link = link
        self._synchroniser = synchroniser
        self._stream = stream
        self._recovery = recovery
        self._drive = drive
        self._on_scan = on_scan
        self._on_warning = on_warning
        self._on_drive = on_drive
        self.counts = Counts()
        self.adc = AdcWatch(protocol)
        self.health: HealthFrame | None = None
        """The board's counters, as told last."""
        self.booted = False
        """Whether a boot frame has come since this was put back."""
        self.waited_at_scan_ns = 0
        """What the link's wait was when the last scan came, or the stream began."""

    def take(self, record: StreamFrame | Response, received_ns: int) -> None:
        """The next record, with the host time at which it was read, ns."""
        match record:
            case DataFrame():
                self._take_data(record, received_ns)
            case Response():
                # Done as the answer is read: a scan may be in the same bytes
                if record.command == START.command and self._protocol.is_ok(record.status):
                    self._take_started(self._link.accepted(START, record))
            case HealthFrame():
                self.take_health(record)
            case DriveFrame():
                self._on_drive(self._drive.take(record, received_ns, self._synchroniser.clock))
            case BootFrame():
                self._take_boot(record)

    def _take_started(self, answer: StartResponse) -> None:
        self._stream.started(answer, self._synchroniser.clock)
        self._recovery.started()
        self.waited_at_scan_ns = self._link.waited_ns

    def _take_data(self, record: DataFrame, received_ns: int) -> None:
        if not self._stream.running:
            return  # the tail of an earlier host's stream
        statistics, clock = self._link.statistics, self._synchroniser.clock
        try:
            number, ticks, missing = self._stream.scan(
                record, received_ns, self._synchroniser.clock
            )
        except ValueError:
            statistics.unknown_frames += 1
            return
        self.waited_at_scan_ns = self._link.waited_ns
        stamp_ns = clock.host_ns(ticks)
        crank, carriage = self.counts.scan(record.crank, record.carriage)
        scan = Scan(
            sequence=number,
            ticks=ticks,
            stamp_ns=stamp_ns,
            codes=record.codes,
            configured_mask=self._stream.configured_mask,
            valid_mask=record.valid_mask,
            flags=record.flags,
            crank=crank,
            carriage=carriage,
            count_epoch=self.counts.epoch,
        )
        statistics.scans_received += 1
        statistics.scans_lost += missing
        statistics.scans_bad += not scan.complete
        for text in self.adc.scan(record.flags, record.valid_mask, stamp_ns):
            self._on_warning(text)
        self._synchroniser.scan_seen()
        self._recovery.scan_came()
        self._on_scan(scan)

    def take_health(self, record: HealthFrame) -> None:
        """The board's counters, told or asked for."""
        idle = self._stream.running and record.state == self._protocol.board.board_state["idle"]
        if self.counts.tells_of_reset(record.boot_count):
            self.board_was_reset(record.reset_cause)
        elif idle and not record.scans_scheduled:
            # A power cut begins the boot count anew, and its boot frame may not have got through;
            # a board that has only gone idle still knows of its scans
            self.board_was_reset(record.reset_cause)
        elif idle:
            self._recovery.stream_ended(
                "the board has gone idle, having heard nothing from the host for too long"
            )
        self.health = record
        self.tell_of_adc(record)

    def tell_of_adc(self, record: HealthFrame) -> None:
        """Warn of what is new in the ADC's errors."""
        for text in self.adc.health(record):
            self._on_warning(text)

    def _take_boot(self, record: BootFrame) -> None:
        self.counts.boot_count = record.boot_count
        self.booted = True
        origin = self._protocol.configuration_origin(record.configuration_origin)
        if origin in CONFIGURATION_LOST:
            self._on_warning(f"{CONFIGURATION_LOST[origin]} until it is configured again")
        self.board_was_reset(record.reset_cause)

    def board_was_reset(self, cause: int) -> None:
        """A reset is told, of board.yaml's reset causes."""
        self.forget()
        if self._stream.running:
            causes = self._protocol.reset_causes(cause)
            self._recovery.stream_ended(f"the board was reset ({causes})")

    def forget(self) -> None:
        """What was known of a board that was reset."""
        self._drive.state = None
        self.adc.board_was_reset()
        self.counts.begin_anew()
