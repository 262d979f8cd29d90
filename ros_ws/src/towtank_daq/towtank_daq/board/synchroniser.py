# SPDX-License-Identifier: Apache-2.0
"""When the board is asked for its time, and the clock that is learnt from it."""

from __future__ import annotations

from towtank_daq.board.errors import BoardError, NoAnswer
from towtank_daq.board.link import ATTEMPTS, FRESH_S, Link
from towtank_daq.clock import BoardClock, SyncExchange
from towtank_daq.protocol import Protocol
from towtank_daq.protocol_records import SYNC

_TRIES = 3  # of a round
_TIMEOUT_S = 0.05
_PERIOD_S = 1.0
_FIRST_ROUNDS = 4
_FIRST_ATTEMPTS = 20
_FIRST_SPACING_S = 0.15  # with 50 us of jitter the slope is then known to about 100 ppm
_SCAN_PATIENCE_S = 0.1  # how long a due try waits for a scan to go just behind it
_RAN_ON_S = 0.5  # a board's time this far from what it should be: it was reset (that takes longer)


class Synchroniser:
    """Keeps the clock of one board."""

    def __init__(self, link: Link, protocol: Protocol) -> None:
        self._link = link
        self._protocol = protocol
        self.clock = self._new_clock()
        self._tries: list[SyncExchange] = []
        self._tries_left = 0
        self._next_ns = 0
        self._scan_seen = False

    def _new_clock(self) -> BoardClock:
        return BoardClock(
            self._protocol.board.microcontroller.tick_hz,
            self._protocol.request_wire_ns(SYNC),
            self._protocol.answer_wire_ns(SYNC),
        )

    def learn(self) -> None:
        """Learn the clock of an idle board anew. Raises BoardError.

        The old one stays until the new one is known: it tells whether the board has run on.
        """
        clock = self._new_clock()
        for _ in range(_FIRST_ATTEMPTS):
            tries = [t for t in (self.ask() for _ in range(_TRIES)) if t is not None]
            if not tries:
                raise NoAnswer("the board does not answer 'sync': check its cable")
            clock.add_round(tries)
            if clock.points == _FIRST_ROUNDS:
                break
            until_ns = self._link.now_ns() + round(1e9 * _FIRST_SPACING_S)
            self._link.wait(until_ns, lambda: False)
        else:
            raise BoardError(
                "the board's time cannot be told, for its answers come faster than its line is: "
                "a virtual board needs a less busy computer"
            )
        self.clock = clock
        self._tries_left = 0
        self._next_ns = self._link.now_ns() + round(1e9 * _FIRST_SPACING_S)

    def scan_seen(self) -> None:
        """A scan has come: the line is free behind it."""
        self._scan_seen = True

    def go_on(self, now_ns: int) -> None:
        """Make the next try when it is due, just behind a scan if these are coming: the line is
        then free, and tries of one round lie at different phases of other traffic."""
        if now_ns < self._next_ns or not self._link.is_heard(FRESH_S):
            return
        if self._tries_left == 0:
            self._tries, self._tries_left, self._scan_seen = [], _TRIES, False
        late = now_ns - self._next_ns > 1e9 * _SCAN_PATIENCE_S
        if not self._scan_seen and not late:
            return
        self._scan_seen = False
        self._tries_left -= 1
        done = self.ask()
        if done is None:
            self._link.statistics.sync_failures += 1
        else:
            self._tries.append(done)
        if self._tries_left == 0:
            if self._tries:
                self.clock.add_round(self._tries)
            self._next_ns = now_ns + round(1e9 * _PERIOD_S)

    def ask(self) -> SyncExchange | None:
        """One exchange of times, which the clock does not learn from; None without an answer."""
        sent_ns = self._link.now_ns()
        response = self._link.exchange(SYNC, _TIMEOUT_S)
        if response is None:
            return None
        answer = self._link.accepted(SYNC, response)
        return SyncExchange(
            sent_ns, self._link.received_ns, answer.received_ticks, answer.sent_ticks
        )

    def board_time(self) -> SyncExchange:
        """The same, with a few tries. Raises NoAnswer."""
        for _ in range(ATTEMPTS):
            exchange = self.ask()
            if exchange is not None:
                return exchange
        raise NoAnswer("the board does not answer 'sync': check its cable")

    def has_run_on(self, exchange: SyncExchange) -> bool:
        """Whether the board's time is where it must be, or else it was reset."""
        apart = exchange.board_received - self.clock.ticks(exchange.sent_ns)
        return abs(apart) < _RAN_ON_S * self._protocol.board.microcontroller.tick_hz
