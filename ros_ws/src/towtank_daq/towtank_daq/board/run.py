# SPDX-License-Identifier: Apache-2.0
"""A run: from start to stop, over all that may interrupt its stream.

When the board resets in the middle of a run, or has gone idle because the host was held up, the
driver starts it again. The numbers of the scans then go on by the time that has passed, so that
the gap shows as so many lost scans (also one that the stop ends).

When the line goes in the middle of a run, the driver opens it again as soon as it is there. A board
that has run on meanwhile (its time tells) is just listened to again: its numbers say to the scan
what was lost. One that has not is started again as above.

Life is judged by what is wanted: valid channels, in scans, in good frames. Bytes alone are none.
What is done, from the least to the last:

1. A damaged frame is dropped, and the next zero byte begins a frame. Many of them are told.
2. The port's settings are looked at four times a second, and written anew when another program has
   changed them.
3. No scan for 2.5 s though the board is heard, or a board that says that it is idle or was reset:
   the stream is started again, from `identify` on. Scans without a valid channel are the board's to
   mend (it sets its ADC up anew); they are told after a second, from when on they are waited for.
4. No good frame for 2.5 s: the port is closed, and opened again with a pulse of DTR, which resets a
   board that hangs; then the driver is quiet, longer than any bootloader is held (10.5 s).
5. After `patience_s` the run ends with the error; also one that is started again so long without
   that a scan comes, or whose scans have no valid channel so long (a record of the crank alone is
   not worth the tank's time). An ADC that cannot be set up at a restart may get its supply later
   than the board: it is waited for likewise. Another board than the run's is refused.
"""

from __future__ import annotations

from collections.abc import Callable

from towtank_daq.adc_watch import OUTAGE_MEND, OUTAGE_S
from towtank_daq.board.errors import BoardError, NoAnswer, Refused, Silence
from towtank_daq.board.intake import Intake
from towtank_daq.board.link import (
    ANSWER_TIMEOUT_S,
    ATTEMPTS,
    CONNECT_TIMEOUT_S,
    FRESH_IDLE_S,
    FRESH_S,
    HELD_S,
    LOOK_AROUND_NS,
    SILENCE_S,
    Link,
)
from towtank_daq.board.recovery import Recovery, State
from towtank_daq.board.stream import Stream
from towtank_daq.board.synchroniser import Synchroniser
from towtank_daq.identity import number_text
from towtank_daq.protocol_records import COUNTERS, START, STOP, IdentifyResponse

RESET_TIMEOUT_S = 4.0
"""The watchdog's 0.5 s of a board that is reset, and the bootloader's 0.9 s."""
SCANLESS_S = 2.5
"""Scans come ten times a second at least."""


class Run:
    """Runs of one board, one after the other.

    connect: finds the board within a time, s, and leaves it idle; configure: sets it as it was.
    """

    def __init__(
        self,
        link: Link,
        synchroniser: Synchroniser,
        stream: Stream,
        recovery: Recovery,
        intake: Intake,
        connect: Callable[[float], IdentifyResponse],
        configure: Callable[[], None],
        on_warning: Callable[[str], None],
    ) -> None:
        self._link = link
        self._synchroniser = synchroniser
        self._stream = stream
        self._recovery = recovery
        self._intake = intake
        self._connect = connect
        self._configure = configure
        self._on_warning = on_warning
        self._board_of_run: IdentifyResponse | None = None

    def start(self, identity: IdentifyResponse | None) -> None:
        """Learn the board's clock and start the stream; scans count from 0."""
        self._link.begin_account()
        self._stream.begin_run()
        self._recovery.begin_run()
        self._board_of_run = identity
        self._intake.adc.reset()
        self._begin()

    def poll(self, timeout_s: float) -> None:
        """Take in what comes within `timeout_s`; keeps clock and board alive meanwhile.

        Raises NoAnswer or OSError when the board has been silent, or the line gone, for longer than
        the driver's patience; BoardError for a board that cannot be started again, or whose scans
        have had no valid channel for that long.
        """
        end_ns = self._link.now_ns() + round(1e9 * timeout_s)
        while True:
            try:
                self._recover(end_ns)
                now_ns = self._link.now_ns()
                if self._stream.running:
                    self._synchroniser.go_on(now_ns)
                if now_ns >= end_ns:
                    return
                self._link.receive(min(end_ns, now_ns + LOOK_AROUND_NS))
                self._link.look_after()
                self._judge_life()
            except (NoAnswer, OSError) as error:
                self._recovery.failed(error)
                if self._link.now_ns() >= end_ns:
                    return

    def stop(self) -> None:
        """Stop the stream and settle the account of the scans.

        A stream that had ended, with the board reset or gone idle, is charged with what would have
        come up to this call. Raises NoAnswer or OSError, the account settled, when there is no
        board to stop.
        """
        asked_ns = self._link.now_ns()
        scheduled = 0
        try:
            if not self._recovery.why:
                self._intake.take_health(
                    self._link.command(COUNTERS)
                )  # what no frame may have told yet, as of a reset
            scheduled = self._link.command(STOP).scans_scheduled
        except (NoAnswer, OSError) as error:
            self._recovery.why = self._recovery.why or str(error)
        ended = self._recovery.end_run()
        if not ended:
            self._link.statistics.scans_lost += self._stream.due_by_count(scheduled)
            return
        # The board knows nothing of the scans that it would have made since
        lost = self._stream.due_by_time(asked_ns, self._synchroniser.clock)
        self._link.statistics.scans_lost += lost
        self._on_warning(
            f"{ended}: the stream had ended before it was stopped; scans lost up to the stop: "
            f"{lost}"
        )
        self._connect(RESET_TIMEOUT_S)

    def _begin(self) -> None:
        """From an idle board to a stream whose clock is known."""
        self._synchroniser.learn()
        self._recovery.about_to_start()
        for _ in range(ATTEMPTS):
            response = self._link.exchange(START, ANSWER_TIMEOUT_S)
            if response is not None:
                self._link.accepted(START, response)
                return
            self._link.command(STOP)  # the answer may have been lost; a second start is refused
        raise NoAnswer("the board does not answer 'start': check its cable")

    # -- what keeps it from going on

    def _recover(self, end_ns: int) -> None:
        """Take the next steps from a state in which no scan comes."""
        recovery = self._recovery
        if recovery.state is State.LINE_GONE:
            left_s = max(0.0, (recovery.until_ns(end_ns) - self._link.now_ns()) / 1e9)
            self._link.reopen(left_s, reset=recovery.resets_line)
            recovery.reopened()
        if recovery.state is State.REOPENED and self._link.is_heard(FRESH_S):
            # One that has run on meanwhile streams on
            exchange = None
            if recovery.in_run and self._stream.running and not recovery.why:
                exchange = self._synchroniser.ask()
            recovery.rejoined(exchange is not None and self._synchroniser.has_run_on(exchange))
        if recovery.why and self._link.is_heard(FRESH_IDLE_S):
            self._resume()

    def _resume(self) -> None:
        self._recovery.about_to_restart()
        self._stream.running = False
        self._refuse_another_board(self._connect(CONNECT_TIMEOUT_S))
        self._configure()
        try:
            self._begin()
        except Refused as error:
            if error.status != "adc_fault":
                raise
            raise NoAnswer(str(error)) from error  # its supply may come later than the board's
        self._link.statistics.restarts += 1
        self._recovery.restarted()

    def _refuse_another_board(self, identity: IdentifyResponse) -> None:
        known = _which(self._board_of_run)
        found = _which(identity)
        if found != known:
            raise BoardError(
                f"the board {found} is not the one that the run began with {known}: begin another "
                "run"
            )

    def _judge_life(self) -> None:
        """Whether board and line do what is wanted of them; the ladder of this module's text."""
        recovery, link = self._recovery, self._link
        limit_s = HELD_S if recovery.state is State.REOPENED else SILENCE_S
        if link.silent_s >= limit_s or (recovery.is_impatient and not link.is_heard(SILENCE_S)):
            raise Silence(link.silence())
        scanless_s = (link.waited_ns - self._intake.waited_at_scan_ns) / 1e9
        if self._stream.running and not recovery.why and scanless_s >= SCANLESS_S:
            self._intake.waited_at_scan_ns = link.waited_ns
            recovery.stream_ended(
                f"the board has sent no scan for {SCANLESS_S:g} s, but other frames"
            )
        outage_s = self._intake.adc.outage_s
        if outage_s >= OUTAGE_S + recovery.patience_ns / 1e9:
            raise BoardError(
                f"the ADC has given no valid value for {outage_s:.0f} s: {OUTAGE_MEND}"
            )


def _which(identity: IdentifyResponse | None) -> str:
    """A board for people, by its numbers."""
    if identity is None:
        return "(unknown)"
    serial, calibration = number_text(identity.board_serial), number_text(identity.calibration_id)
    return f"(serial number {serial}, calibration {calibration})"
