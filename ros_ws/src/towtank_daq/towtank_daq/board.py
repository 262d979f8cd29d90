# SPDX-License-Identifier: Apache-2.0
"""The driver of the ADC board: what is said to it, and what its scans mean in host time.

All waiting goes through the transport's read() and all time through `monotonic_ns`, so that the
same code drives a serial port in real time and a virtual board without a clock. Not thread-safe:
one thread at a time may call it.

Scans are handed to `on_scan` the moment that their frame is complete, also while the driver waits
for an answer. Lost scans are known exactly: the board numbers its ticks, sent or not, and tells at
the stop how many there were. Nothing is ever put in their place.

When the board resets in the middle of a run, or has gone idle because the host was held up, the
driver starts it again. The numbers of the scans then go on by the time that has passed, so that
the gap shows as so many lost scans (also one that the stop ends).

A board that was reset has begun its encoder counts anew, and what the shafts turned while it was
down is not known: its scans carry another `count_epoch`. The first epoch is the board's boot count,
so that a host that is started again goes on in the epoch of the counts, which the board keeps while
no host is there. (The boot count begins anew with the power, which a host that was not there then
cannot know.)

When the line goes in the middle of a run, the driver opens it again as soon as it is there. A board
that has run on meanwhile (its time tells) is just listened to again: its numbers say to the scan
what was lost. One that has not is started again as above.

Nothing is said to a board that is not heard. A Mega that was reset for whatever cause is in its
bootloader for a second, where one byte holds it for nine more; a request is therefore sent right
behind one of the board's own frames, which come with every scan, or else once a second. What has
waited in the port while the host was held up does not count: it may be of before a reset. (The
drive's orders to stop are sent in any case.)

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

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any
from typing import Protocol as Interface

from towtank_daq.adc_watch import OUTAGE_MEND, OUTAGE_S, AdcWatch
from towtank_daq.clock import BoardClock, SyncExchange, unwrap
from towtank_daq.configuration import (
    Configuration,
    ConfigurationError,
    configuration_at,
    configuration_of,
)
from towtank_daq.framing import FrameCounters, FrameReader
from towtank_daq.identity import StoredIdentity, number_text
from towtank_daq.protocol import Protocol, ProtocolError, Response
from towtank_daq.protocol_records import (
    CONFIGURATION,
    COUNTERS,
    IDENTIFY,
    IDENTITY,
    RESET,
    SELF_TEST,
    START,
    STOP,
    SYNC,
    AnswerT,
    BootFrame,
    DataFrame,
    DriveArguments,
    DriveFrame,
    HealthFrame,
    IdentifyResponse,
    Request,
    SetIdentityArguments,
    StartResponse,
    configure,
    drive,
    set_identity,
)
from towtank_daq.self_test import SelfTest, judge

CONNECT_TIMEOUT_S = 13.0  # a bootloader that is held when the port is opened, and some
_HELD_S = 10.5  # so long after the last byte no bootloader is held any more: a Mega's is for 9 s
_IDENTIFY_TIMEOUT_S = 0.3
_ANSWER_TIMEOUT_S = 0.5
_SELF_TEST_TIMEOUT_S = 1.0  # it takes 0.26 s
_RESET_TIMEOUT_S = 4.0  # its watchdog's 0.5 s, and the bootloader's 0.9 s
_ATTEMPTS = 3
_SYNC_TRIES = 3
_SYNC_TIMEOUT_S = 0.05
_SYNC_PERIOD_S = 1.0
_FIRST_SYNC_ROUNDS = 4
_FIRST_SYNC_ATTEMPTS = 20
_FIRST_SYNC_SPACING_S = 0.15  # with 50 us of jitter the slope is then known to about 100 ppm
_SCAN_PATIENCE_S = 0.1  # how long a due sync try waits for a scan to go just behind it
_LOOK_AROUND_NS = 100_000_000  # longest wait for bytes before sync and silence are looked at
_SILENCE_S = 2.5  # health frames come once a second, and a reset Mega's boot frame after 0.95 s
_SCANLESS_S = 2.5  # scans come ten times a second at least
_FRESH_S = 0.05  # since a frame: the UART of a board that was reset behind it is still off (65 ms)
_FRESH_IDLE_S = 1.2  # of an idle board, which is heard once a second
_HEAR_S = 0.15  # until the next frame of a board that streams
_HEAR_IDLE_S = 1.1
_LINE_CHECK_S = 0.25
_DAMAGE_PERIOD_S = 2.0
_DAMAGED_SHARE = 0.05  # of the frames, from which on it is told
_DAMAGE_AGAIN_S = 30.0
_PATIENCE_S = 30.0  # time to find a plug that has come out and put it in again
_RAN_ON_S = 0.5  # a board's time this far from what it should be: it was reset (that takes longer)


class Transport(Interface):
    """The line to the board. What derives from it need not have what a simple line has not."""

    def read(self, timeout_s: float) -> bytes:
        """Block until at least one byte is there or the time is over; all bytes there are.

        Raises OSError, in one line with the mend, when the line is gone.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all of `data`. Raises OSError when the line is gone."""
        ...

    def reopen(self, timeout_s: float, reset: bool) -> None:
        """Close the line and open it anew, and wait so long for it to be there again.

        reset: with a pulse of DTR, which resets a board that is wired so; else without.
        Raises OSError when it is not there.
        """
        raise OSError("the board's line is lost, and cannot be opened anew")

    def look_after(self) -> str:
        """Put right what another program has changed about the line: what that was, or ''.

        Cheap: called several times a second. Raises OSError when the line is gone.
        """
        return ""

    def suspects(self) -> str:
        """Who else has the line open, as the subject of a sentence, or '' if nobody is known."""
        return ""


class BoardError(Exception):
    """The board does not do what it should; one line with cause and mend."""


class NoAnswer(BoardError):
    """Nothing comes from the board; that may change."""


class _Silence(NoAnswer):
    """No good frame for too long."""


class Refused(BoardError):
    """The board refuses a command; `status`: board.yaml's name for the reason."""

    def __init__(self, command: str, status: str) -> None:
        super().__init__(
            f"the board refuses '{command}': {status.replace('_', ' ')}{_MENDS.get(status, '')}"
        )
        self.status = status


@dataclass(frozen=True, slots=True)
class Scan:
    """One scan in host terms."""

    sequence: int
    """Number since start(), unwrapped; a gap is so many lost scans."""
    ticks: int
    """Board time of the sampling tick, unwrapped."""
    stamp_ns: int
    """Estimated host time of the sampling tick, ns of CLOCK_MONOTONIC."""
    codes: tuple[int, ...]
    configured_mask: int
    """Bit i: channel i is configured to be converted in every scan."""
    valid_mask: int
    """Bit i: channel i has a good conversion in this one."""
    flags: int
    crank: int
    carriage: int
    """Encoder counts at the tick, unwrapped."""
    count_epoch: int
    """Counts of different epochs have no known relation: the board was reset in between."""

    @property
    def complete(self) -> bool:
        """Whether all channels that are configured have a good conversion."""
        return self.valid_mask == self.configured_mask


@dataclass(frozen=True, slots=True)
class DriveState:
    """How the crank's drive is. Names of state and trip are those of board.yaml."""

    ticks: int
    """Board time, unwrapped."""
    state: str
    trip: str
    target_rpm: float
    setpoint_rpm: float
    """On its ramp to the target."""
    speed_rpm: float
    """Of the crank, measured."""
    duty: float
    """Of the PWM, 0 to 1."""
    emergency_stop_closed: bool


@dataclass(slots=True)
class Statistics:
    """What has happened since start()."""

    scans_received: int = 0
    scans_lost: int = 0
    scans_bad: int = 0
    """Received, but with at least one channel that is configured not valid."""
    restarts: int = 0
    reconnections: int = 0
    line_repairs: int = 0
    """How often another program had changed the line's settings."""
    sync_failures: int = 0
    unknown_frames: int = 0
    frames: FrameCounters = field(default_factory=FrameCounters)

    @property
    def scans_scheduled(self) -> int:
        return self.scans_received + self.scans_lost


class _Counter:
    """A shaft's 32-bit count, unwrapped from 0, where a reset of the board begins it."""

    def __init__(self) -> None:
        self._last = 0

    def update(self, count: int) -> int:
        self._last = unwrap(count, 32, self._last)
        return self._last


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
        self._transport = transport
        self._protocol = protocol
        self._on_scan = on_scan
        self._on_warning = on_warning
        self._on_drive = on_drive
        self._now_ns = monotonic_ns
        self._patience_ns = round(1e9 * patience_s)
        self._board = protocol.board
        self._reader = FrameReader(self._board.wire.maximum_payload)
        self.clock = self._new_clock()
        self.statistics = Statistics(frames=self._reader.counters)
        self._adc_watch = AdcWatch(protocol)
        self.health: HealthFrame | None = None
        self.drive_state: DriveState | None = None
        self.identity: IdentifyResponse | None = None
        self._heard_ns: int | None = None  # when the last good frame came that was not old
        self._read_ns = monotonic_ns()  # when the line was last read, or opened
        self._behind = False  # what is read has waited for an unknown time
        self._spoke_ns = 0  # when the last byte went out, or the line was opened
        self._silent_s = self._scanless_s = 0.0  # of waiting
        self._silent_bytes = 0
        self._line_check_ns = 0
        self._damage_ns = 0
        self._damage_told_ns: int | None = None
        self._frames_before = (0, 0)
        self._boot_count: int | None = None
        self._booted = False

        self._request_id = 0
        self._waiting_for: int | None = None
        self._response: Response | None = None
        self._response_ns = 0

        self._configuration = configuration_at(self._board, self._board.sampling.rate_hz.default)
        self._configured_mask = self._configuration.configured_mask(self._board)
        self._streaming = False
        self._down = ""  # why the stream must be started again
        self._line_gone = False
        self._reset_wanted = False  # with a pulse of DTR, when the line is opened again
        self._reopened = False  # and the board not yet heard on it
        self._lost_ns: int | None = None  # since when the run waits for line or board
        self._barren_ns: int | None = None  # since when it is started again without any scan
        self._board_of_run: tuple[int, int] | None = None  # serial number, calibration id
        self._crank, self._carriage = _Counter(), _Counter()
        self._count_epoch = 0
        self._last_scan_epoch = 0
        self._first_tick = 0
        self._period_ticks = 0
        self._base = 0  # number of the board's scan 0
        self._last_sequence = -1
        self._last_stamp_ns: int | None = None  # of the scan of that number, come or not

        self._tries: list[SyncExchange] = []
        self._tries_left = 0
        self._next_sync_ns = 0
        self._scan_seen = False

    # -- states

    def use(self, transport: Transport) -> None:
        """Go on with the board on a line that was opened anew; connect() comes next.

        Who has known the board before sees a power cut, which its boot count does not tell.
        """
        self._transport = transport
        self._read_ns = self._now_ns()
        self._streaming = False
        self._line_gone = self._reopened = False
        self._heard_ns = None
        self._down = ""

    def connect(self, timeout_s: float = CONNECT_TIMEOUT_S) -> IdentifyResponse:
        """Find the board and make sure that it speaks this protocol; leaves it idle.

        A board that runs is heard within a second. One that resets because its port was opened is
        left in peace until its bootloader is through: it then reports its boot. A silent one is
        reset by DTR; where that does nothing, it is waited for as for a bootloader that is held.
        """
        self.identity = self._identified(self._find(timeout_s))
        self._command(STOP)
        counters = self.counters()
        self._take_boot_count(counters)
        if self._last_scan_epoch and not self._has_run_on(self.board_time()):
            self._forget_counts()  # also where neither boot frame nor boot count tell of a reset
        self._tell_of_adc(counters)
        self._count_epoch = max(self._count_epoch, self._boot_count)
        return self.identity

    def _find(self, timeout_s: float) -> Response:
        """The board's answer to `identify`."""
        begun_ns = self._spoke_ns = self._now_ns()
        pulsed = False
        while True:
            may_be_held = self._now_ns() - self._spoke_ns < 1e9 * _HELD_S
            response = self._exchange(
                IDENTIFY, _IDENTIFY_TIMEOUT_S, fresh_s=_FRESH_S if may_be_held else math.inf
            )
            if response is not None:
                return response
            passed_s = (self._now_ns() - begun_ns) / 1e9
            if passed_s >= timeout_s:
                raise NoAnswer(self._no_answer(timeout_s))
            heard = self._heard_ns is not None and self._heard_ns >= begun_ns
            if passed_s >= _SILENCE_S and not heard and not pulsed:
                self._transport.reopen(0.0, reset=True)
                pulsed = True

    def configure(self, configuration: Configuration) -> None:
        """Set how the idle board scans; it keeps that over resets and power cuts.

        Raises BoardError, and nothing has changed, for what the board cannot do.
        """
        try:
            arguments = configuration.arguments(self._board)
        except ConfigurationError as error:
            raise BoardError(str(error)) from error
        try:
            self._command(configure(arguments))
        except Refused as error:
            # A crank that still comes to rest is no reason to wait with what is in force already
            if error.status != "drive_turns" or self.configuration() != configuration:
                raise
        self._configuration = configuration
        self._configured_mask = configuration.configured_mask(self._board)

    def configuration(self) -> Configuration:
        """How the board would scan now, whoever configured it."""
        return configuration_of(self._command(CONFIGURATION), self._board)

    def counters(self) -> HealthFrame:
        """The board's counters as they stand now."""
        return self._command(COUNTERS)

    def stored_identity(self) -> StoredIdentity:
        """What the board has stored of itself, read now."""
        record = self._command(IDENTITY)
        return StoredIdentity(
            _name(self._board.identity_state, record.state),
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
        self._command(set_identity(SetIdentityArguments(board_serial, calibration_id)))

    def self_test(self) -> SelfTest:
        """Let the idle board measure itself (0.3 s), and judge what it found."""
        record = self._command(SELF_TEST, timeout_s=_SELF_TEST_TIMEOUT_S)
        return judge(record, self._board)

    def reset(self) -> float:
        """Let the board reset itself, by its watchdog, and wait until it is up again, idle.

        A stream ends with it: its scans are those received so far. Returns the time taken, s.
        """
        self._streaming = False
        self._down = ""
        self._booted = False
        for _ in range(_ATTEMPTS):
            asked_ns = self._now_ns()
            response = self._exchange(RESET, _ANSWER_TIMEOUT_S)
            if response is not None:
                self._accepted(RESET, response)
            # Also without an answer, which may have been lost: to ask again would reset it again
            self._wait(self._now_ns() + round(1e9 * _RESET_TIMEOUT_S), lambda: self._booted)
            if self._booted:
                return (self._now_ns() - asked_ns) / 1e9
        raise BoardError(
            "the board does not come back from a reset: switch its power off and on (a Mega's "
            "bootloader of before 2012 does not survive the watchdog: burn a newer one)"
        )

    def board_time(self) -> SyncExchange:
        """One exchange of times with the board, which the clock does not learn from."""
        for _ in range(_ATTEMPTS):
            exchange = self._sync_try()
            if exchange is not None:
                return exchange
        raise NoAnswer("the board does not answer 'sync': check its cable")

    def drive(self, action: str, speed_rpm: float = 0.0, counts_per_revolution: int = 0) -> None:
        """Ask the crank's drive for an action of board.yaml's `drive_action`.

        speed_rpm: for `run`. counts_per_revolution: of the crank's encoder, for `run` and `watch`;
        negative where it counts backwards. Within each of the board's `command_timeout_s` it wants
        a `keep`.
        Raises BoardError for what the drive cannot do.
        """
        limits = self._board.drive.speed_rpm
        if action == "run" and not limits.minimum <= speed_rpm <= limits.maximum:
            raise BoardError(
                f"the crank cannot be driven at {speed_rpm:g} rpm: give {limits.minimum:g} to "
                f"{limits.maximum:g} rpm"
            )
        if action in _DRIVE_KNOWS_ENCODER and not 512 <= abs(counts_per_revolution) < 2**15:
            raise BoardError(
                f"the drive cannot be led by an encoder of {abs(counts_per_revolution)} counts a "
                "revolution: use one of 512 to 32767"
            )
        try:
            self._command(
                drive(
                    DriveArguments(
                        action=self._board.drive_action[action],
                        speed=round(100 * speed_rpm),
                        counts_per_revolution=counts_per_revolution,
                    )
                ),
                blind=action in _DRIVE_STOPS,
            )
        except Refused as error:
            if error.status != "drive_tripped":
                raise
            self._wait(self._now_ns() + round(1e9 * _ANSWER_TIMEOUT_S), self._trip_is_known)
            trip = self.drive_state.trip if self.drive_state else "none"
            advice = TRIP_ADVICE.get(trip, "look at the drive, then clear the trip")
            raise BoardError(
                f"the drive is stopped ({trip.replace('_', ' ')}): {advice}"
            ) from error

    def _trip_is_known(self) -> bool:
        return self.drive_state is not None and self.drive_state.trip != "none"

    def start(self) -> None:
        """Learn the board's clock and start the stream; scans count from 0."""
        self._reader.counters = FrameCounters()
        self.statistics = Statistics(frames=self._reader.counters)
        self._base = 0
        self._last_sequence = -1
        self._last_stamp_ns = None
        self._line_gone = self._reopened = False
        self._lost_ns = self._barren_ns = None
        self._board_of_run = _numbers(self.identity)
        self._adc_watch.reset()
        self._damage_ns, self._damage_told_ns, self._frames_before = self._now_ns(), None, (0, 0)
        self._begin()

    def poll(self, timeout_s: float) -> None:
        """Take in what comes within `timeout_s`; keeps clock and board alive meanwhile.

        Raises NoAnswer or OSError when the board has been silent, or the line gone, for longer than
        the driver's patience; BoardError for a board that cannot be started again, or whose scans
        have had no valid channel for that long.
        """
        end_ns = self._now_ns() + round(1e9 * timeout_s)
        while True:
            try:
                if self._line_gone:
                    self._reopen(end_ns)
                if self._reopened and self._is_heard(_FRESH_S):
                    self._rejoin()
                if self._down and self._is_heard(_FRESH_IDLE_S):
                    self._resume()
                now_ns = self._now_ns()
                self._synchronise(now_ns)
                if now_ns >= end_ns:
                    return
                self._receive(min(end_ns, now_ns + _LOOK_AROUND_NS))
                self._look_after_line()
                self._judge_life()
            except (NoAnswer, OSError) as error:
                self._wait_for(error)
                if self._now_ns() >= end_ns:
                    return

    def stop(self) -> None:
        """Stop the stream and settle the account of the scans.

        A stream that had ended, with the board reset or gone idle, is charged with what would have
        come up to this call. Raises NoAnswer or OSError, the account settled, when there is no
        board to stop.
        """
        asked_ns = self._now_ns()
        try:
            if not self._down:
                self._take_health(self.counters())  # what no frame may have told yet, as of a reset
            due = self._base + self._command(STOP).scans_scheduled - 1 - self._last_sequence
        except (NoAnswer, OSError) as error:
            self._down = self._down or str(error)
        self._streaming = False
        ended, self._down = self._down, ""
        if ended:  # the board knows nothing of the scans that it would have made since
            due = math.floor(self._periods_since_last_scan(asked_ns))
        lost = max(0, due)
        self.statistics.scans_lost += lost
        self._last_sequence += lost
        if ended:
            self._on_warning(
                f"{ended}: the stream had ended before it was stopped; scans lost up to the stop: "
                f"{lost}"
            )
            self.connect(_RESET_TIMEOUT_S)

    @property
    def silence_s(self) -> float:
        """How long the driver has waited for a good frame since the last one, s."""
        return self._silent_s

    @property
    def streaming(self) -> bool:
        return self._streaming

    # -- commands

    def _command(
        self,
        request: Request[AnswerT],
        timeout_s: float = _ANSWER_TIMEOUT_S,
        blind: bool = False,
    ) -> AnswerT:
        """The board's answer to a request; every request may be repeated safely.

        blind: said also to a board that is not heard.
        """
        fresh_s = math.inf if blind else None
        for _ in range(_ATTEMPTS):
            response = self._exchange(request, timeout_s, fresh_s)
            if response is not None:
                return self._accepted(request, response)
        raise NoAnswer(
            f"the board does not answer '{request.command}': check its cable, or reset it and try "
            "again"
        )

    def _exchange(
        self, request: Request[Any], timeout_s: float, fresh_s: float | None = None
    ) -> Response | None:
        """One request and its response; None if none comes in time, or the board is not heard.

        fresh_s: how old its last frame may be when the request is sent.
        """
        if fresh_s is None:
            fresh_s = _FRESH_S if self._streaming else _FRESH_IDLE_S
        if not self._is_heard(fresh_s):
            patience_s = max(timeout_s, _HEAR_S if self._streaming else _HEAR_IDLE_S)
            until_ns = self._now_ns() + round(1e9 * patience_s)
            self._wait(until_ns, lambda: self._is_heard(fresh_s))
            if not self._is_heard(fresh_s):
                return None
        self._request_id = (self._request_id + 1) % 256
        self._response = None
        self._waiting_for = self._request_id
        self._transport.write(self._protocol.request(request, self._request_id))
        self._spoke_ns = self._now_ns()
        self._wait(self._now_ns() + round(1e9 * timeout_s), lambda: self._response is not None)
        self._waiting_for = None
        return self._response

    def _is_heard(self, fresh_s: float) -> bool:
        if math.isinf(fresh_s):
            return True
        return self._heard_ns is not None and self._now_ns() - self._heard_ns <= 1e9 * fresh_s

    def _accepted(self, request: Request[AnswerT], response: Response) -> AnswerT:
        if not self._protocol.is_ok(response.status):
            raise Refused(response.command, self._protocol.status_name(response.status))
        try:
            return self._protocol.answer(request, response)
        except ProtocolError as error:
            raise BoardError(f"{error}: flash the firmware that belongs to this driver") from error

    def _identified(self, response: Response) -> IdentifyResponse:
        ours = self._board
        if response.data and response.data[0] != ours.protocol:
            raise BoardError(
                f"the board speaks protocol {response.data[0]}, this driver {ours.protocol}: flash "
                "the firmware that belongs to this driver"
            )
        identity = self._accepted(IDENTIFY, response)
        if identity.schema_hash != ours.schema_hash:
            raise BoardError(
                f"the board has schema 0x{identity.schema_hash:08x}, this driver "
                f"0x{ours.schema_hash:08x}: flash the firmware that belongs to this driver"
            )
        return identity

    def _no_answer(self, timeout_s: float) -> str:
        if self.statistics.frames.bad and not self.statistics.frames.frames:
            return (
                f"what comes from the board is not readable at {self._board.wire.baud} baud: is "
                "this port the ADC board's?"
            )
        return (
            f"the board has not answered within {timeout_s:g} s: check that it has power, that "
            "this port is the ADC board's and that its firmware is flashed"
        )

    # -- the stream

    def _new_clock(self) -> BoardClock:
        return BoardClock(
            self._board.microcontroller.tick_hz,
            self._protocol.request_wire_ns(SYNC),
            self._protocol.answer_wire_ns(SYNC),
        )

    def _begin(self) -> None:
        """From an idle board to a stream whose clock is known."""
        # The old one stays until the new one is known: it tells whether the board has run on
        clock = self._new_clock()
        for _ in range(_FIRST_SYNC_ATTEMPTS):
            tries = [t for t in (self._sync_try() for _ in range(_SYNC_TRIES)) if t is not None]
            if not tries:
                raise NoAnswer("the board does not answer 'sync': check its cable")
            clock.add_round(tries)
            if clock.points == _FIRST_SYNC_ROUNDS:
                break
            self._wait(self._now_ns() + round(1e9 * _FIRST_SYNC_SPACING_S), lambda: False)
        else:
            raise BoardError(
                "the board's time cannot be told, for its answers come faster than its line is: "
                "a virtual board needs a less busy computer"
            )
        self.clock = clock
        self._down = ""
        self._tries_left = 0
        self._next_sync_ns = self._now_ns() + round(1e9 * _FIRST_SYNC_SPACING_S)
        for _ in range(_ATTEMPTS):
            response = self._exchange(START, _ANSWER_TIMEOUT_S)
            if response is not None:
                self._accepted(START, response)
                return
            self._command(STOP)  # the answer may have been lost, and a second start is refused
        raise NoAnswer("the board does not answer 'start': check its cable")

    def _take_started(self, started: StartResponse) -> None:
        """The stream is on. Done as the answer is read: a scan may be in the same bytes."""
        self._first_tick, self._period_ticks = started.first_tick, started.period_ticks
        if self._last_stamp_ns is None:
            self._last_stamp_ns = self.clock.host_ns(self._first_tick - self._period_ticks)
        passed = self._periods_since_last_scan(self.clock.host_ns(self._first_tick))
        self._base = self._last_sequence + max(1, round(passed))
        self._streaming = True
        self._scanless_s = 0.0

    def _periods_since_last_scan(self, host_ns: int) -> float:
        """How many of the board's own periods lie between the last scan and a host time."""
        begun_ns = self.clock.host_ns(self._first_tick)
        period_ns = self.clock.host_ns(self._first_tick + self._period_ticks) - begun_ns
        return (host_ns - self._last_stamp_ns) / period_ns

    def _wait_for(self, error: NoAnswer | OSError) -> None:
        """Note that line or board are gone; raises the error when that has lasted too long."""
        now_ns = self._now_ns()
        if isinstance(error, OSError | _Silence):
            self._line_gone = True
            self._reset_wanted = isinstance(error, _Silence)
        else:
            self._down = str(error)
        if self._lost_ns is None:
            self._lost_ns = now_ns
            if self._patience_ns > 0:
                self._on_warning(f"{error}; waiting for it {self._patience_ns / 1e9:g} s")
        if now_ns - self._lost_ns >= self._patience_ns:
            self._lost_ns = None
            raise error

    def _reopen(self, end_ns: int) -> None:
        """Open the line again, and be quiet until the board is heard."""
        until_ns = min(end_ns, self._lost_ns + self._patience_ns)
        left_s = max(0.0, (until_ns - self._now_ns()) / 1e9)
        self._transport.reopen(left_s, reset=self._reset_wanted)
        self._line_gone, self._reopened = False, True
        self._heard_ns, self._silent_s, self._silent_bytes = None, 0.0, 0
        self._read_ns = self._now_ns()
        self._reader.reset()
        self.statistics.reconnections += 1

    def _rejoin(self) -> None:
        """The board is heard on the line that was opened again; one that has run on streams on."""
        self._reopened = False
        if self._down:
            return
        exchange = self._sync_try()
        if exchange is None or not self._has_run_on(exchange):
            self._down = self._down or "the line was gone"

    def _look_after_line(self) -> None:
        now_ns = self._now_ns()
        if now_ns - self._line_check_ns < 1e9 * _LINE_CHECK_S:
            return
        self._line_check_ns = now_ns
        repaired = self._transport.look_after()
        if repaired:
            self.statistics.line_repairs += 1
            self._on_warning(repaired)
        if now_ns - self._damage_ns >= 1e9 * _DAMAGE_PERIOD_S:
            self._judge_damage(now_ns)

    def _judge_damage(self, now_ns: int) -> None:
        """Tell when many frames were damaged since the last call."""
        counters = self._reader.counters
        good, bad = (
            now - before
            for now, before in zip(
                (counters.frames, counters.bad), self._frames_before, strict=True
            )
        )
        self._damage_ns, self._frames_before = now_ns, (counters.frames, counters.bad)
        told_ns = self._damage_told_ns
        if told_ns is not None and now_ns - told_ns < 1e9 * _DAMAGE_AGAIN_S:
            return
        if bad > _DAMAGED_SHARE * (good + bad):
            self._damage_told_ns = now_ns
            self._on_warning(
                f"{bad} of {good + bad} frames in {_DAMAGE_PERIOD_S:g} s were damaged: "
                + self._line_advice("check the cable and its ground")
            )

    def _line_advice(self, otherwise: str) -> str:
        """What to do about bytes that are damaged or do not come."""
        suspects = self._transport.suspects()
        if not suspects:
            return otherwise
        return f"{suspects} has the port open as well and takes bytes: stop it"

    def _judge_life(self) -> None:
        """Whether board and line do what is wanted of them; the ladder of this module's text."""
        limit_s = _HELD_S if self._reopened else _SILENCE_S
        lost_ns = self._lost_ns
        impatient = lost_ns is not None and self._now_ns() - lost_ns >= self._patience_ns
        if self._silent_s > limit_s or (impatient and not self._is_heard(_SILENCE_S)):
            raise _Silence(self._silence())
        if self._streaming and not self._down and self._scanless_s > _SCANLESS_S:
            self._scanless_s = 0.0
            self._down = f"the board has sent no scan for {_SCANLESS_S:g} s, but other frames"
        outage_s = self._adc_watch.outage_s
        if outage_s >= OUTAGE_S + self._patience_ns / 1e9:
            raise BoardError(
                f"the ADC has given no valid value for {outage_s:.0f} s: {OUTAGE_MEND}"
            )

    def _silence(self) -> str:
        """What is wrong when nothing readable comes."""
        seconds = max(self._silent_s, _SILENCE_S)
        if not self._silent_bytes:
            return f"the board has sent nothing for {seconds:.1f} s: " + self._line_advice(
                "check its power and cable"
            )
        return (
            f"nothing readable has come from the board for {seconds:.1f} s "
            f"({self._silent_bytes} bytes): "
            + self._line_advice(
                "another program (ModemManager, a serial monitor) may read the port, or its cable "
                "is bad"
            )
        )

    def _has_run_on(self, exchange: SyncExchange) -> bool:
        """Whether the board's time is where it must be, or else it was reset."""
        apart = exchange.board_received - self.clock.ticks(exchange.sent_ns)
        return abs(apart) < _RAN_ON_S * self._board.microcontroller.tick_hz

    def _resume(self) -> None:
        if self._lost_ns is None:  # else that has been said
            self._on_warning(
                f"{self._down}: starting it again; the gap counts as lost scans, and after a reset "
                "of the board crank and carriage must be zeroed again"
            )
        if self._barren_ns is not None and self._now_ns() - self._barren_ns >= self._patience_ns:
            raise BoardError(
                f"{self._down}, and no scan has come since it was started again: look at what else "
                "it tells of, or replace it"
            )
        self._streaming = False
        self._refuse_another_board(self.connect())
        self.configure(self._configuration)
        try:
            self._begin()
        except Refused as error:
            if error.status != "adc_fault":
                raise
            raise NoAnswer(str(error)) from error  # its supply may come later than the board's
        self.statistics.restarts += 1
        if self._barren_ns is None:
            self._barren_ns = self._now_ns()

    def _refuse_another_board(self, identity: IdentifyResponse) -> None:
        known, found = (
            f"(serial number {number_text(serial)}, calibration {number_text(calibration)})"
            for serial, calibration in (self._board_of_run, _numbers(identity))
        )
        if found != known:
            raise BoardError(
                f"the board {found} is not the one that the run began with {known}: begin another "
                "run"
            )

    def _synchronise(self, now_ns: int) -> None:
        """Make the next sync try when it is due, just behind a scan if these are coming: the
        line is then free, and tries of one round lie at different phases of other traffic."""
        if not self._streaming or now_ns < self._next_sync_ns or not self._is_heard(_FRESH_S):
            return
        if self._tries_left == 0:
            self._tries, self._tries_left, self._scan_seen = [], _SYNC_TRIES, False
        late = now_ns - self._next_sync_ns > 1e9 * _SCAN_PATIENCE_S
        if not self._scan_seen and not late:
            return
        self._scan_seen = False
        self._tries_left -= 1
        done = self._sync_try()
        if done is None:
            self.statistics.sync_failures += 1
        else:
            self._tries.append(done)
        if self._tries_left == 0:
            if self._tries:
                self.clock.add_round(self._tries)
            self._next_sync_ns = now_ns + round(1e9 * _SYNC_PERIOD_S)

    def _sync_try(self) -> SyncExchange | None:
        sent_ns = self._now_ns()
        response = self._exchange(SYNC, _SYNC_TIMEOUT_S)
        if response is None:
            return None
        answer = self._accepted(SYNC, response)
        return SyncExchange(sent_ns, self._response_ns, answer.received_ticks, answer.sent_ticks)

    def _wait(self, until_ns: int, done: Callable[[], bool]) -> None:
        while not done() and self._now_ns() < until_ns:
            self._receive(until_ns)

    def _receive(self, until_ns: int) -> bool:
        """Take in what has come; False if nothing comes before `until_ns`."""
        begun_ns = self._now_ns()
        # Behind a stall all that waits is read first, until there is nothing
        timeout_s = 0.0 if self._behind else max(0.0, (until_ns - begun_ns) / 1e9)
        data = self._transport.read(timeout_s)
        received_ns = self._now_ns()
        stalled = received_ns - self._read_ns > 1e9 * (timeout_s + _FRESH_S)
        self._behind = bool(data) and (self._behind or stalled)
        self._read_ns = received_ns
        # Silence is counted in waiting: a host that was held up has all that was sent meanwhile
        # still to read
        waited_s = min(received_ns - begun_ns, _LOOK_AROUND_NS) / 1e9
        self._silent_s += waited_s
        self._scanless_s += waited_s
        self._silent_bytes += len(data)
        if not data:
            return False
        payloads = self._reader.feed(data)
        if payloads:
            if not self._behind:
                self._heard_ns = received_ns
            self._silent_s, self._silent_bytes = 0.0, 0
        for payload in payloads:
            try:
                record = self._protocol.decode(payload)
            except ProtocolError:
                self.statistics.unknown_frames += 1
                continue
            match record:
                case DataFrame():
                    self._take_data(record, received_ns)
                case Response():
                    self._take_response(record, received_ns)
                case HealthFrame():
                    self._take_health(record)
                case DriveFrame():
                    self._take_drive(record, received_ns)
                case BootFrame():
                    self._take_boot(record)
        return True

    def _take_response(self, record: Response, received_ns: int) -> None:
        if record.request_id != self._waiting_for:
            return  # of a request that was given up
        self._response, self._response_ns = record, received_ns
        if record.command == START.command and self._protocol.is_ok(record.status):
            self._take_started(self._accepted(START, record))

    def _take_data(self, record: DataFrame, received_ns: int) -> None:
        if not self._streaming:
            return  # the tail of an earlier host's stream
        ticks = unwrap(record.ticks, 32, self.clock.ticks(received_ns))
        # The tick tells the number; the 16-bit sequence then only has to confirm the nearest
        near = round((ticks - self._first_tick) / self._period_ticks)
        sequence = self._base + unwrap(record.sequence, 16, near)
        if sequence <= self._last_sequence:
            self.statistics.unknown_frames += 1
            return
        self._scanless_s = 0.0
        self.statistics.scans_received += 1
        self.statistics.scans_lost += sequence - self._last_sequence - 1
        if record.valid_mask != self._configured_mask:
            self.statistics.scans_bad += 1
        self._last_sequence = sequence
        self._last_stamp_ns = stamp_ns = self.clock.host_ns(ticks)
        for text in self._adc_watch.scan(record.flags, record.valid_mask, stamp_ns):
            self._on_warning(text)
        self._scan_seen = True
        self._lost_ns = self._barren_ns = None
        self._last_scan_epoch = self._count_epoch
        self._on_scan(
            Scan(
                sequence=sequence,
                ticks=ticks,
                stamp_ns=stamp_ns,
                codes=record.codes,
                configured_mask=self._configured_mask,
                valid_mask=record.valid_mask,
                flags=record.flags,
                crank=self._crank.update(record.crank),
                carriage=self._carriage.update(record.carriage),
                count_epoch=self._count_epoch,
            )
        )

    def _take_health(self, record: HealthFrame) -> None:
        idle = self._streaming and record.state == self._board.board_state["idle"]
        reset = self._take_boot_count(record)
        if idle and not reset and not record.scans_scheduled:
            # A power cut begins the boot count anew, and its boot frame may not have got through;
            # a board that has only gone idle still knows of its scans
            self._board_was_reset(record.reset_cause)
        elif idle and not reset:
            self._down = "the board has gone idle, having heard nothing from the host for too long"
        self.health = record
        self._tell_of_adc(record)

    def _tell_of_adc(self, record: HealthFrame) -> None:
        for text in self._adc_watch.health(record):
            self._on_warning(text)

    def _take_boot_count(self, record: HealthFrame) -> bool:
        """Whether it tells of a reset whose boot frame did not get through."""
        known, self._boot_count = self._boot_count, record.boot_count
        if known in (None, record.boot_count):
            return False
        self._board_was_reset(record.reset_cause)
        return True

    def _take_drive(self, record: DriveFrame, received_ns: int) -> None:
        board = self._board
        # Before the clock is known, the low half as it came
        near = self.clock.ticks(received_ns) if self.clock.points else record.ticks
        self.drive_state = DriveState(
            ticks=unwrap(record.ticks, 32, near),
            state=_name(board.drive_state, record.state),
            trip=_name(board.drive_trip, record.trip),
            target_rpm=record.target / 100,
            setpoint_rpm=record.setpoint / 100,
            speed_rpm=record.speed / 100,
            duty=record.duty / 10_000,
            emergency_stop_closed=bool(record.emergency_stop_closed),
        )
        self._on_drive(self.drive_state)

    def _take_boot(self, record: BootFrame) -> None:
        self._boot_count = record.boot_count
        self._booted = True
        origin = self._protocol.configuration_origin(record.configuration_origin)
        if origin in _CONFIGURATION_LOST:
            self._on_warning(f"{_CONFIGURATION_LOST[origin]} until it is configured again")
        self._board_was_reset(record.reset_cause)

    def _board_was_reset(self, cause: int) -> None:
        self._forget_counts()
        if self._streaming:
            self._down = f"the board was reset ({self._protocol.reset_causes(cause)})"

    def _forget_counts(self) -> None:
        self.drive_state = None
        self._adc_watch.board_was_reset()
        self._crank, self._carriage = _Counter(), _Counter()
        # One reset is told in several ways: the epoch is a new one beside the last scan's
        self._count_epoch = max(self._last_scan_epoch + 1, self._boot_count)


def _numbers(identity: IdentifyResponse) -> tuple[int, int]:
    return identity.board_serial, identity.calibration_id


def _name(names: dict[str, int], number: int) -> str:
    """What board.yaml calls a number."""
    return next((name for name, value in names.items() if value == number), f"number {number}")


TRIP_ADVICE = {
    "emergency_stop": "close the emergency-stop loop, then clear the trip",
    "overspeed": "see what let the crank run ahead (a lost load?), then clear the trip",
    "stall": "free the crank, check motor supply and encoder, then clear the trip",
    "host_silence": "see why the host went silent, then clear the trip",
    "encoder": "the encoder counts against the rig's direction, or on one track only: exchange A "
    "and B or correct the rig, or mend the dead track, then clear the trip",
    "overload": "the crank does not reach its speed: check load, motor supply and whether the "
    "encoder slips, then clear the trip",
    "runaway": "the crank turns although the board gives its motor no power: cut the motor's "
    "supply at the main switch, see what turns it (a shorted motor driver, a tow that drives it, a "
    "hand), then clear the trip",
}
"""What to do about a trip of the drive, by its name in board.yaml."""

_DRIVE_KNOWS_ENCODER = ("run", "watch")

_DRIVE_STOPS = ("stop", "emergency_stop")
"""Actions of the drive that are sent also to a board that is not heard: it may hear them."""

_CONFIGURATION_LOST = {
    "stored_older": "the board lost power while it stored a configuration: it has the one before",
    "default_damaged": "the configuration stored in the board is damaged: it has the default one",
    "default_version": "what the board has stored is of another firmware: it has the default one",
}
_MENDS = {
    "adc_fault": ": check the ADC's supply and SPI wiring",
    "does_not_fit": ": lower the rate or the filter word, or scan fewer channels",
    "storage_fault": ": its EEPROM is worn out or damaged; replace the microcontroller",
    "drive_turns": ": stop the crank first",
    "drive_stands": ": set the crank's speed again",
    "not_idle": ": another program is using it; stop that, or reset the board",
}
