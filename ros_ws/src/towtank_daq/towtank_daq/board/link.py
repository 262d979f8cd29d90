# SPDX-License-Identifier: Apache-2.0
"""The line to the board: frames in, requests out, and whether the board is heard.

Nothing is said to a board that is not heard. A Mega that was reset for whatever cause is in its
bootloader for a second, where one byte holds it for nine more; a request is therefore sent right
behind one of the board's own frames, which come with every scan, or else once a second. What has
waited in the port while the host was held up does not count: it may be of before a reset. (What is
sent `blind` goes out in any case.)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any
from typing import Protocol as Interface

from towtank_daq.board.errors import BoardError, NoAnswer, Refused
from towtank_daq.board.stream import Statistics
from towtank_daq.framing import FrameCounters, FrameReader, encoded_size
from towtank_daq.protocol import Protocol, ProtocolError, Response
from towtank_daq.protocol_records import (
    IDENTIFY,
    STREAM,
    AnswerT,
    IdentifyResponse,
    Request,
    StreamFrame,
)

CONNECT_TIMEOUT_S = 13.0
"""A bootloader that is held when the port is opened, and some."""
HELD_S = 10.5
"""So long after the last byte no bootloader is held any more: a Mega's is for 9 s."""
FRESH_S = 0.05
"""Since a frame: the UART of a board that was reset behind it is still off (65 ms)."""
FRESH_IDLE_S = 1.2
"""The same of an idle board, which is heard once a second."""
SILENCE_S = 2.5
"""Health frames come once a second, and a reset Mega's boot frame after 0.95 s."""
LOOK_AROUND_NS = 100_000_000
"""Longest wait for bytes before sync and silence are looked at."""
ATTEMPTS = 3
"""With a request."""
ANSWER_TIMEOUT_S = 0.5
_IDENTIFY_TIMEOUT_S = 0.3
_HEAR_S = 0.15  # until the next frame of a board that streams
_HEAR_IDLE_S = 1.1
_LINE_CHECK_S = 0.25
_DAMAGE_PERIOD_S = 2.0
_DAMAGED_SHARE = 0.05  # of the frames, from which on it is told
_DAMAGE_AGAIN_S = 30.0
_LONGEST_FRAME = max(encoded_size(1 + record.LAYOUT.size) for record in STREAM.values())


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


class Link:
    """Asks the board one thing at a time, and hands over every record that comes meanwhile.

    on_record: takes what the board sends, and the answers that are waited for, with the host time
    at which it was read. streams: whether the board streams, and so is heard with every scan.
    """

    def __init__(
        self,
        transport: Transport,
        protocol: Protocol,
        on_record: Callable[[StreamFrame | Response, int], None],
        on_warning: Callable[[str], None],
        monotonic_ns: Callable[[], int],
        streams: Callable[[], bool],
    ) -> None:
        self._transport = transport
        self._protocol = protocol
        self._on_record = on_record
        self._on_warning = on_warning
        self.now_ns = monotonic_ns
        self._streams = streams
        self._reader = FrameReader(protocol.board.wire.maximum_payload)
        self.statistics = Statistics(frames=self._reader.counters)
        self.waited_ns = 0
        """How long has been waited for bytes in all. Silence is counted in waiting: a host that was
        held up has all that was sent meanwhile still to read."""
        self._waited_at_frame_ns = 0
        self.received_ns = 0
        """When the last answer was read."""
        self._silent_bytes = 0
        self._heard_ns: int | None = None  # when the last good frame came that was not old
        self._read_ns = monotonic_ns()  # when the line was last read, or opened
        self._behind = False  # what is read has waited for an unknown time
        self._spoke_ns = 0  # when the last byte went out, or the line was opened
        self._request_id = 0
        self._waiting_for: int | None = None
        self._response: Response | None = None
        self._line_check_ns = 0
        self._damage_ns = 0
        self._damage_told_ns: int | None = None
        self._frames_before = (0, 0)

    # -- the line

    def use(self, transport: Transport) -> None:
        """Go on with a line that was opened anew."""
        self._transport = transport
        self._opened()

    def reopen(self, timeout_s: float, reset: bool) -> None:
        """Open the line again, as Transport.reopen does; the board is not heard on it yet."""
        self._transport.reopen(timeout_s, reset)
        self._opened()
        self._waited_at_frame_ns, self._silent_bytes = self.waited_ns, 0
        self._reader.reset()
        self.statistics.reconnections += 1

    def _opened(self) -> None:
        self._read_ns = self.now_ns()
        self._heard_ns = None

    def begin_account(self) -> None:
        """Count anew what happens."""
        self._reader.counters = FrameCounters()
        self.statistics = Statistics(frames=self._reader.counters)
        self._damage_ns, self._damage_told_ns, self._frames_before = self.now_ns(), None, (0, 0)

    def look_after(self) -> None:
        """Put the line's settings right, and tell of many damaged frames."""
        now_ns = self.now_ns()
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

    # -- whether the board is heard

    def is_heard(self, fresh_s: float) -> bool:
        """Whether its last frame is no older than that; of infinity, in any case."""
        if math.isinf(fresh_s):
            return True
        return self._heard_ns is not None and self.now_ns() - self._heard_ns <= 1e9 * fresh_s

    @property
    def silent_s(self) -> float:
        """How long has been waited for a good frame since the last one."""
        return (self.waited_ns - self._waited_at_frame_ns) / 1e9

    def silence(self) -> str:
        """What is wrong when nothing readable comes."""
        seconds = max(self.silent_s, SILENCE_S)
        if self._silent_bytes <= _LONGEST_FRAME:  # of which the rest may never have come
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

    # -- requests

    def identify(self, timeout_s: float) -> IdentifyResponse:
        """Find the board and make sure that it speaks this protocol. Raises BoardError."""
        response = self._find(timeout_s)
        ours = self._protocol.board
        if response.data and response.data[0] != ours.protocol:
            raise BoardError(
                f"the board speaks protocol {response.data[0]}, this driver {ours.protocol}: flash "
                "the firmware that belongs to this driver"
            )
        identity = self.accepted(IDENTIFY, response)
        if identity.schema_hash != ours.schema_hash:
            raise BoardError(
                f"the board has schema 0x{identity.schema_hash:08x}, this driver "
                f"0x{ours.schema_hash:08x}: flash the firmware that belongs to this driver"
            )
        return identity

    def _find(self, timeout_s: float) -> Response:
        """The board's answer to `identify`."""
        begun_ns = self._spoke_ns = self.now_ns()
        pulsed = False
        while True:
            may_be_held = self.now_ns() - self._spoke_ns < 1e9 * HELD_S
            response = self.exchange(
                IDENTIFY, _IDENTIFY_TIMEOUT_S, fresh_s=FRESH_S if may_be_held else math.inf
            )
            if response is not None:
                return response
            passed_s = (self.now_ns() - begun_ns) / 1e9
            if passed_s >= timeout_s:
                raise NoAnswer(self._no_answer(timeout_s))
            heard = self._heard_ns is not None and self._heard_ns >= begun_ns
            if passed_s >= SILENCE_S and not heard and not pulsed:
                self._transport.reopen(0.0, reset=True)
                pulsed = True

    def _no_answer(self, timeout_s: float) -> str:
        if self.statistics.frames.bad and not self.statistics.frames.frames:
            return (
                f"what comes from the board is not readable at {self._protocol.board.wire.baud} "
                "baud: is this port the ADC board's?"
            )
        return (
            f"the board has not answered within {timeout_s:g} s: check that it has power, that "
            "this port is the ADC board's and that its firmware is flashed"
        )

    def command(
        self, request: Request[AnswerT], timeout_s: float = ANSWER_TIMEOUT_S, blind: bool = False
    ) -> AnswerT:
        """The board's answer to a request; every request may be repeated safely.

        blind: said also to a board that is not heard.
        Raises NoAnswer, Refused, BoardError, OSError.
        """
        fresh_s = math.inf if blind else None
        for _ in range(ATTEMPTS):
            response = self.exchange(request, timeout_s, fresh_s)
            if response is not None:
                return self.accepted(request, response)
        raise NoAnswer(
            f"the board does not answer '{request.command}': check its cable, or reset it and try "
            "again"
        )

    def exchange(
        self, request: Request[Any], timeout_s: float, fresh_s: float | None = None
    ) -> Response | None:
        """One request and its response; None if none comes in time, or the board is not heard.

        fresh_s: how old its last frame may be when the request is sent.
        """
        usual_s = FRESH_S if self._streams() else FRESH_IDLE_S
        limit_s = usual_s if fresh_s is None else fresh_s
        if not self.is_heard(limit_s):
            patience_s = max(timeout_s, _HEAR_S if self._streams() else _HEAR_IDLE_S)
            until_ns = self.now_ns() + round(1e9 * patience_s)
            self.wait(until_ns, lambda: self.is_heard(limit_s))
            if not self.is_heard(limit_s):
                return None
        self._request_id = (self._request_id + 1) % 256
        self._response = None
        self._waiting_for = self._request_id
        self._transport.write(self._protocol.request(request, self._request_id))
        self._spoke_ns = self.now_ns()
        self.wait(self.now_ns() + round(1e9 * timeout_s), lambda: self._response is not None)
        self._waiting_for = None
        return self._response

    def accepted(self, request: Request[AnswerT], response: Response) -> AnswerT:
        """The data of a response. Raises Refused, or BoardError for data of another firmware."""
        if not self._protocol.is_ok(response.status):
            raise Refused(response.command, self._protocol.status_name(response.status))
        try:
            return self._protocol.answer(request, response)
        except ProtocolError as error:
            raise BoardError(f"{error}: flash the firmware that belongs to this driver") from error

    # -- what comes

    def wait(self, until_ns: int, done: Callable[[], bool]) -> None:
        """Take in what comes until something is done, or to an instant."""
        while not done() and self.now_ns() < until_ns:
            self.receive(until_ns)

    def receive(self, until_ns: int) -> None:
        """Take in what has come, or comes next before `until_ns`."""
        begun_ns = self.now_ns()
        # Behind a stall all that waits is read first, until there is nothing
        timeout_s = 0.0 if self._behind else max(0.0, (until_ns - begun_ns) / 1e9)
        data = self._transport.read(timeout_s)
        received_ns = self.now_ns()
        stalled = received_ns - self._read_ns > 1e9 * (timeout_s + FRESH_S)
        self._behind = bool(data) and (self._behind or stalled)
        self._read_ns = received_ns
        self.waited_ns += min(received_ns - begun_ns, LOOK_AROUND_NS)
        self._silent_bytes += len(data)
        payloads = self._reader.feed(data) if data else []
        if payloads:
            if not self._behind:
                self._heard_ns = received_ns
            self._waited_at_frame_ns, self._silent_bytes = self.waited_ns, 0
        for payload in payloads:
            self._take(payload, received_ns)

    def _take(self, payload: bytes, received_ns: int) -> None:
        try:
            record = self._protocol.decode(payload)
        except ProtocolError:
            self.statistics.unknown_frames += 1
            return
        if isinstance(record, Response):
            if record.request_id != self._waiting_for:
                return  # of a request that was given up
            self._response, self.received_ns = record, received_ns
        self._on_record(record, received_ns)
