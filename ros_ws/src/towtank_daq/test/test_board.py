# SPDX-License-Identifier: Apache-2.0
"""The driver against a scripted board in simulated time."""

import heapq
import itertools
import math
import struct
from dataclasses import replace

import pytest
from towtank_daq.board import AdcBoard, BoardError, NoAnswer, State
from towtank_daq.configuration import configuration_at
from towtank_daq.framing import FrameReader, encode_frame

MS = 1_000_000
SECOND = 1_000_000_000
IDENTIFY, CONFIGURE, START, STOP, SYNC, COUNTERS, RESET, CONFIGURATION = 1, 2, 3, 4, 6, 7, 8, 9
DRIVE = 10
PERIOD_TICKS = 20_000


class ScriptedBoard:
    """Answers as the firmware does, in a time of its own that only reading moves on.

    Its faults are set from outside: `deaf` (answers nothing), `skip` (scan numbers that it does
    not send), `mangle` (changes frames on their way), `answer_losses` (answers lost by type).
    """

    def __init__(self, schema_hash: int, ppm: float = 0.0, ticks_at_boot: int = 0) -> None:
        self.now_ns = 10 * SECOND
        self.schema_hash = schema_hash
        self.protocol_version = 1
        self.rate = 1.0 + 1e-6 * ppm
        self.born_ns = self.now_ns
        self.ticks_at_boot = ticks_at_boot
        self.deaf = False
        self.adc_present = True
        self.board_serial = 8
        self.adc_error_bits = 0
        self.skip: set[int] = set()
        self.bad_channels: dict[int, int] = {}  # by scan number: the valid mask
        self.answer_losses: dict[int, int] = {}
        self.mangle = lambda frame: frame
        self.requests: list[int] = []
        self.dtr_resets = False
        self.pulses_ns: list[int] = []
        self.repair = self.suspect = ""
        self.crank = 0
        self.boot_count = 1
        self.refuse_configuration = 0
        self.configuration_origin = 0
        self.configured_ticks = PERIOD_TICKS
        self.answer_wire_ns = 920_000
        self._requests = FrameReader(64)
        self._events: list = []
        self._order = itertools.count()
        self._stream_id = 0
        self.streaming = False
        self.scheduled = 0
        self._at(self.now_ns + SECOND, self._health)

    # -- the transport

    def monotonic_ns(self) -> int:
        return self.now_ns

    def read(self, timeout_s: float) -> bytes:
        end_ns = self.now_ns + round(1e9 * timeout_s)
        while self._events and self._events[0][0] <= end_ns:
            at_ns, _, action = heapq.heappop(self._events)
            self.now_ns = max(self.now_ns, at_ns)
            data = action()
            if data:
                return data
        self.now_ns = max(self.now_ns, end_ns)
        return b""

    def write(self, data: bytes) -> None:
        for request in self._requests.feed(data):
            self.requests.append(request[0])
            if not self.deaf:
                self._answer(request)

    def reopen(self, timeout_s: float, reset: bool) -> None:
        if reset:
            self.pulses_ns.append(self.now_ns)
        if reset and self.dtr_resets:
            self.deaf = False
            self.reset()

    def look_after(self) -> str:
        told, self.repair = self.repair, ""
        return told

    def suspects(self) -> str:
        return self.suspect

    # -- the firmware

    def ticks(self, at_ns: int) -> int:
        return self.ticks_at_boot + int((at_ns - self.born_ns) * self.rate * 2e-3)

    def _at(self, at_ns: int, action) -> None:
        heapq.heappush(self._events, (at_ns, next(self._order), action))

    def _send(self, at_ns: int, payload: bytes) -> None:
        self._at(at_ns, lambda: self.mangle(encode_frame(payload)))

    def _answer(self, request: bytes) -> None:
        kind, request_id, arguments = request[0], request[1], request[2:]
        received_ns = self.now_ns + 240_000
        status, data = 0, b""
        if kind == IDENTIFY:
            data = struct.pack("<BI3BBIII", self.protocol_version, self.schema_hash,
                               0, 1, 0, 0x17, 2_000_000, 7, self.board_serial)  # fmt: skip
        elif kind == CONFIGURE:
            self.configuration = arguments
            self.configured_ticks = 2_000_000 // struct.unpack_from("<H", arguments)[0]
            data = struct.pack("<I", self.configured_ticks)
            status, data = self.refuse_configuration, b"" if self.refuse_configuration else data
        elif kind == CONFIGURATION:
            data = self.configuration
        elif kind == COUNTERS:
            data = self.health()
        elif kind == RESET:
            self.after(500 * MS, self.reset)
        elif kind == START and self.streaming:
            status = 3
        elif kind == START and not self.adc_present:
            status = 5
        elif kind == START:
            self.streaming, self.scheduled = True, 0
            self._stream_id += 1
            first = self.ticks(received_ns) + 1000
            data = struct.pack("<QI", first, self.configured_ticks)
            self._at_tick(first, self._scan, 0, first, self._stream_id)
        elif kind == STOP:
            self.streaming = False
            self._stream_id += 1
            data = struct.pack("<I", self.scheduled)
        elif kind == SYNC:
            data = struct.pack("<QQ", self.ticks(received_ns), self.ticks(received_ns + 50_000))
        if self.answer_losses.get(kind, 0) > 0:
            self.answer_losses[kind] -= 1
            return
        self._send(
            received_ns + 50_000 + self.answer_wire_ns,
            bytes((kind | 0x80, request_id, status)) + data,
        )

    def _at_tick(self, tick: int, action, *arguments) -> None:
        at_ns = self.born_ns + round((tick - self.ticks_at_boot) / (self.rate * 2e-3))
        self._at(at_ns, lambda: action(*arguments))

    def _scan(self, number: int, tick: int, stream_id: int) -> None:
        if stream_id != self._stream_id:
            return
        self.scheduled = number + 1
        if number not in self.skip:
            mask = self.bad_channels.get(number, 0x3F)
            payload = struct.pack("<BBHIB", 0x10, self.schema_hash & 0xFF, number % 65536,
                                  tick % 2**32, mask)  # fmt: skip
            payload += b"".join((number + k).to_bytes(4, "little")[:3] for k in range(6))
            payload += struct.pack("<IIB", self.crank % 2**32, -number % 2**32, 0)
            self._send(self.now_ns + 9 * MS, payload)
        following = tick + self.configured_ticks
        self._at_tick(following, self._scan, number + 1, following, stream_id)

    def health(self) -> bytes:
        head = struct.pack("<10IBHH", *[0] * 10, 1, self.boot_count, 500)
        told = self.adc_error_bits.to_bytes(3, "little")
        return head + bytes(6) + told + struct.pack("<IBB", self.scheduled, self.streaming, 0)

    def _health(self) -> None:
        if not self.deaf:
            self._send(self.now_ns, b"\x11" + self.health())
        self._at(self.now_ns + SECOND, self._health)

    # -- what happens to it

    def reset(self, boot_frame: bool = True) -> None:
        """A watchdog reset: idle, clock and counts from zero."""
        self.streaming = False
        self.scheduled = 0
        self._stream_id += 1
        self.boot_count += 1
        self.born_ns = self.now_ns
        self.ticks_at_boot = 0
        self.crank = 0
        if boot_frame:
            self._send(
                self.now_ns + 2 * MS,
                b"\x12\x08"
                + struct.pack("<HIB", self.boot_count, self.schema_hash, self.configuration_origin),
            )

    def go_idle(self) -> None:
        self.streaming = False
        self._stream_id += 1

    def after(self, delay_ns: int, action) -> None:
        self._at(self.now_ns + delay_ns, action)


class Bench:
    """A driver on a scripted board, and what it has handed over."""

    def __init__(self, protocol, **options) -> None:
        self.protocol = protocol
        self.board = ScriptedBoard(protocol.board.schema_hash, **options)
        self.scans = []
        self.warnings = []
        self.driver = AdcBoard(
            self.board, protocol, self.scans.append, self.warnings.append, self.board.monotonic_ns
        )

    def stream(self, seconds: float, rate_hz: int = 100) -> None:
        self.driver.connect()
        self.driver.configure(configuration_at(self.protocol.board, rate_hz))
        self.driver.start()
        self.driver.poll(seconds)

    @property
    def sequence(self) -> list[int]:
        return [scan.sequence for scan in self.scans]


@pytest.fixture
def bench(protocol) -> Bench:
    return Bench(protocol)


# -- finding the board


def test_identify(bench):
    identity = bench.driver.connect()
    assert (identity.firmware_version, identity.calibration_id, identity.board_serial) == (
        (0, 1, 0),
        7,
        8,
    )


def test_board_that_never_answers(bench):
    bench.board.deaf = True
    start = bench.board.now_ns
    with pytest.raises(BoardError, match=r"not answered within 13 s: check that it has power"):
        bench.driver.connect()
    assert 13 * SECOND <= bench.board.now_ns - start < 15 * SECOND


def test_silence_while_the_bootloader_listens(bench):
    """A board that resets when its port is opened hears nothing before it is up."""
    bench.board.deaf = True

    def boot():
        bench.board.deaf = False
        bench.board.reset()

    bench.board.after(1800 * MS, boot)
    start = bench.board.now_ns
    bench.driver.connect()
    assert bench.board.requests == [IDENTIFY, STOP, COUNTERS]
    # the boot frame, not a timeout, is what makes the driver go on
    assert bench.board.now_ns - start < 1.9 * SECOND


def test_other_schema_is_refused_with_both_numbers(bench, protocol):
    bench.board.schema_hash = protocol.board.schema_hash ^ 1
    with pytest.raises(BoardError) as refusal:
        bench.driver.connect()
    message = str(refusal.value)
    assert f"0x{protocol.board.schema_hash:08x}" in message
    assert f"0x{protocol.board.schema_hash ^ 1:08x}" in message
    assert "flash the firmware" in message
    assert "\n" not in message


def test_other_protocol_is_refused(bench):
    bench.board.protocol_version = 9
    with pytest.raises(BoardError, match="speaks protocol 9, this driver 1: flash"):
        bench.driver.connect()


def test_garbage_only(bench):
    bench.board.deaf = True

    def babble():
        bench.board.after(50 * MS, babble)
        return b"\x37\x91\x00\x41\x22\x00"

    bench.board.after(0, babble)
    with pytest.raises(BoardError, match="not readable at 250000 baud"):
        bench.driver.connect()


def test_garbage_before_the_answer_does_no_harm(bench):
    bench.board.mangle = lambda frame: b"\x11\x22\x33\x00" + frame
    bench.stream(1.0)
    assert bench.sequence == list(range(len(bench.scans)))
    assert len(bench.scans) >= 98


def test_stream_of_an_earlier_host_is_stopped(bench, protocol):
    bench.stream(0.5)
    successor = []
    driver = AdcBoard(
        bench.board, protocol, successor.append, print, bench.board.monotonic_ns
    )  # the first one vanished without a stop
    driver.connect()
    driver.configure(configuration_at(protocol.board, 100))
    driver.start()
    driver.poll(0.5)
    assert [scan.sequence for scan in successor] == list(range(len(successor)))


# -- commands


def test_rate_beyond_the_board(bench):
    bench.driver.connect()
    with pytest.raises(BoardError, match="scan rate 500 Hz: the board takes 10 to 200 Hz"):
        bench.driver.configure(configuration_at(bench.protocol.board, 500))


def test_refusal_names_the_mend(bench):
    bench.board.adc_present = False
    bench.driver.connect()
    bench.driver.configure(configuration_at(bench.protocol.board, 100))
    with pytest.raises(BoardError, match="refuses 'start': adc fault: check the ADC's supply"):
        bench.driver.start()


@pytest.mark.parametrize("command", [IDENTIFY, CONFIGURE, START, STOP, SYNC])
def test_a_lost_answer_is_asked_for_again(bench, command):
    bench.board.answer_losses = {command: 1}
    bench.stream(0.5)
    bench.driver.stop()
    assert bench.sequence == list(range(len(bench.scans)))
    assert len(bench.scans) >= 48
    assert bench.driver.statistics.scans_lost == bench.board.scheduled - len(bench.scans)


def test_other_questions(bench, protocol):
    bench.driver.connect()
    wanted = configuration_at(protocol.board, 50)
    bench.driver.configure(wanted)
    assert bench.driver.configuration() == wanted
    assert bench.driver.counters().stack_low_water == 500
    exchange = bench.driver.board_time()
    assert exchange.sent_ns < exchange.received_ns
    assert exchange.board_sent - exchange.board_received == 100  # 50 us


def test_a_lost_answer_to_reset_resets_once(bench):
    bench.driver.connect()
    bench.board.answer_losses = {RESET: 1}
    bench.driver.reset()
    assert bench.board.requests.count(RESET) == 1
    assert bench.driver.counters().boot_count == 2


def test_a_board_that_does_not_come_back(bench):
    bench.driver.connect()
    bench.board.deaf = True
    with pytest.raises(BoardError, match="does not come back from a reset: switch its power off"):
        bench.driver.reset()


@pytest.mark.parametrize(
    ("origin", "warning"),
    [
        ("stored", None),
        ("default_empty", None),
        ("stored_older", "the board lost power while it stored a configuration: it has the one"),
        ("default_damaged", "the configuration stored in the board is damaged: it has the default"),
        ("default_version", "what the board has stored is of another firmware: it has the default"),
    ],
)
def test_a_lost_configuration_is_told(bench, protocol, origin, warning):
    bench.driver.connect()
    bench.board.configuration_origin = protocol.board.configuration_origin[origin]
    bench.driver.reset()
    assert [text[: len(warning or "")] for text in bench.warnings] == ([warning] if warning else [])


def test_an_eeprom_that_does_not_hold(bench, protocol):
    bench.driver.connect()
    bench.board.refuse_configuration = 7
    with pytest.raises(BoardError, match="refuses 'configure': storage fault: its EEPROM is worn"):
        bench.driver.configure(configuration_at(protocol.board, 50))


# -- the account of scans


@pytest.mark.parametrize("rate_hz", [10, 100, 200])
def test_every_scan_arrives_once(bench, rate_hz):
    bench.stream(10.0, rate_hz)
    assert bench.sequence == list(range(len(bench.scans)))
    assert abs(len(bench.scans) - 10 * rate_hz) <= 2
    assert bench.driver.statistics.scans_received == len(bench.scans)
    assert bench.driver.statistics.scans_lost == 0
    assert bench.scans[7].codes == tuple(range(7, 13))
    assert bench.scans[7].carriage == -7


def test_gaps_are_counted_and_not_bridged(bench):
    bench.board.skip = {0, 1, 10, 20, 21, 22}
    bench.stream(1.0)
    assert bench.sequence == [n for n in range(bench.sequence[-1] + 1) if n not in bench.board.skip]
    assert bench.driver.statistics.scans_lost == 6


def test_scans_lost_at_the_end_are_counted_at_the_stop(bench):
    bench.board.skip = set(range(50, 1000))
    bench.stream(1.0)
    bench.driver.stop()
    statistics = bench.driver.statistics
    assert statistics.scans_received == 50
    assert statistics.scans_scheduled == bench.board.scheduled
    assert not bench.driver.streaming


def test_damaged_frames_are_lost_scans(bench):
    frames = itertools.count()

    def flip_each_seventh_data_frame(frame):
        if len(frame) < 40 or next(frames) % 7 != 3:
            return frame
        return frame[:20] + bytes((frame[20] ^ 0x10 or 0x55,)) + frame[21:]

    bench.board.mangle = flip_each_seventh_data_frame
    bench.stream(2.0)
    bench.driver.stop()
    statistics = bench.driver.statistics
    assert statistics.frames.bad > 20
    assert statistics.scans_scheduled == bench.board.scheduled
    assert all(scan.codes[0] == scan.sequence for scan in bench.scans)


def test_scans_with_a_bad_channel_are_counted(bench):
    bench.board.bad_channels = {5: 0x3E, 9: 0x00}
    bench.stream(0.5)
    assert bench.driver.statistics.scans_bad == 2
    assert [scan.sequence for scan in bench.scans if scan.valid_mask != 0x3F] == [5, 9]


def test_a_scan_is_judged_by_the_channels_that_are_configured(bench):
    """Two of six channels: a scan that has them is complete, and bad is one that lacks one."""
    bench.board.bad_channels = dict.fromkeys(range(100), 0b110000) | {7: 0b010000}
    bench.driver.connect()
    configuration = configuration_at(bench.protocol.board, 100)
    bench.driver.configure(replace(configuration, order=("accel_z", "excitation")))
    bench.driver.start()
    bench.driver.poll(0.5)
    assert bench.driver.statistics.scans_bad == 1
    assert [scan.sequence for scan in bench.scans if not scan.complete] == [7]
    assert {scan.configured_mask for scan in bench.scans} == {0b110000}


def test_a_run_is_in_one_state_at_a_time(bench):
    """Idle, streaming, down while the reset board has no ADC, streaming again, its line gone:
    a board that is deaf and idle sends nothing, which is told after 2.5 s."""
    driver = bench.driver
    assert driver.snapshot().state is State.IDLE
    bench.stream(1.0)
    assert driver.snapshot().state is State.STREAMING
    bench.board.adc_present = False
    bench.board.reset()
    driver.poll(2.0)
    down = driver.snapshot()
    assert (down.state, down.streaming) == (State.DOWN, False)
    assert "adc fault" in down.why
    bench.board.adc_present = True
    driver.poll(3.0)
    again = driver.snapshot()
    assert (again.state, again.why, again.streaming) == (State.STREAMING, "", True)
    assert (down.statistics.restarts, again.statistics.restarts) == (0, 1)
    assert (down.count_epoch, again.count_epoch, again.boot_count) == (2, 2, 2)
    bench.board.deaf = True
    bench.board.go_idle()
    driver.poll(2.55)
    assert driver.snapshot().state in (State.LINE_GONE, State.REOPENED)


def test_a_line_that_goes_without_a_run_is_opened_again_and_that_is_all(bench):
    """There is no stream to start again, and no board that a run had begun with."""
    driver = bench.driver
    driver.connect()
    bench.board.deaf = True
    driver.poll(3.0)
    assert driver.snapshot().state in (State.LINE_GONE, State.REOPENED)
    bench.board.deaf = False
    driver.poll(2.0)
    after = driver.snapshot()
    assert (after.state, after.streaming, after.why) == (State.IDLE, False, "")
    assert after.statistics.reconnections == 1
    assert bench.board.requests.count(START) == 0


def test_gap_longer_than_the_sequence_counter(bench, monkeypatch):
    """70 000 scans without a frame: sixteen bits cannot tell, the ticks can. (The driver would have
    started the stream anew long before.)"""
    monkeypatch.setattr("towtank_daq.board.run.SCANLESS_S", math.inf)
    bench.board.skip = set(range(20, 70_020))
    bench.stream(701.0)
    assert bench.sequence[19:21] == [19, 70_020]
    assert bench.driver.statistics.scans_lost == 70_000


def test_counters_wrap(protocol):
    """Sequence (16 bit) and ticks (32 bit) pass their end; the encoder count too."""
    bench = Bench(protocol, ticks_at_boot=2**32 - 8_000_000)
    bench.board.crank = 2**31 - 1
    bench.stream(5.0)
    bench.board.crank += 3
    bench.driver.poll(660.0)
    assert bench.sequence == list(range(len(bench.scans)))
    assert len(bench.scans) > 66_000
    ticks = [scan.ticks for scan in bench.scans]
    assert {b - a for a, b in itertools.pairwise(ticks)} == {PERIOD_TICKS}
    assert {scan.crank for scan in bench.scans} == {2**31 - 1, 2**31 + 2}


# -- time


@pytest.mark.parametrize("ppm", [-5000.0, 0.0, 5000.0])
def test_stamps_are_the_sampling_instants(protocol, ppm):
    """The scripted line has no jitter: the line of the clock is exact after the first rounds, up
    to a prior on the slope of 5000 ppm against rounds 0.15 s apart (below 1 us)."""
    bench = Bench(protocol, ppm=ppm)
    bench.stream(20.0)
    board = bench.board
    errors = [
        scan.stamp_ns - (board.born_ns + scan.ticks / (board.rate * 2e-3)) for scan in bench.scans
    ]
    assert max(map(abs, errors)) < 5_000
    assert bench.driver.clock.rate_ppm == pytest.approx(ppm, abs=1.0)


def test_answers_that_are_too_fast_to_be_true(bench):
    """As from a virtual board that hurries after having been held up."""
    bench.driver.connect()
    bench.driver.configure(configuration_at(bench.protocol.board, 100))
    bench.board.answer_wire_ns = 100_000
    with pytest.raises(BoardError, match="a virtual board needs a less busy computer"):
        bench.driver.start()


def test_the_board_hears_from_the_host_every_second(bench):
    bench.stream(20.0)
    rounds = bench.board.requests.count(SYNC) / 3
    assert 20 <= rounds <= 26


def test_lost_sync_answers_are_counted(bench):
    bench.stream(2.0)
    bench.board.answer_losses = {SYNC: 4}
    bench.driver.poll(5.0)
    assert bench.driver.statistics.sync_failures == 4
    assert bench.driver.statistics.scans_lost == 0


# -- trouble in the middle of a run


@pytest.mark.parametrize("boot_frame", [True, False])
def test_reset_in_mid_run(bench, boot_frame):
    """The stream goes on by itself; the gap is as long in numbers as in time."""
    bench.board.crank = 1000
    bench.stream(3.0)
    bench.board.reset(boot_frame)
    bench.driver.poll(5.0)
    pairs = itertools.pairwise(bench.scans)
    ((before, after),) = [(a, b) for a, b in pairs if b.sequence != a.sequence + 1]
    gap = after.sequence - before.sequence
    assert gap > 10
    assert gap == pytest.approx((after.stamp_ns - before.stamp_ns) / (10 * MS), abs=0.6)
    assert bench.driver.statistics.scans_lost == gap - 1
    assert bench.driver.statistics.restarts == 1
    assert (before.crank, after.crank) == (1000, 0)
    assert [scan.count_epoch for scan in (before, after, bench.scans[-1])] == [1, 2, 2]
    assert len(bench.warnings) == 1
    assert "the board was reset" in bench.warnings[0]


@pytest.mark.parametrize("reset", [False, True])
def test_a_host_that_starts_again_knows_the_counts_by_their_epoch(bench, reset):
    """The board counts on while no host is there, also backwards."""
    bench.board.boot_count = 7
    bench.board.crank = -5
    bench.stream(1.0)
    bench.driver.stop()
    if reset:
        bench.board.reset(boot_frame=False)
    bench.board.crank -= 20
    again = Bench(bench.protocol)
    again.board = bench.board
    again.driver = AdcBoard(
        bench.board, bench.protocol, again.scans.append, print, bench.board.monotonic_ns
    )
    again.stream(1.0)
    told = [(run.scans[0].count_epoch, run.scans[0].crank) for run in (bench, again)]
    assert told == [(7, -5), (8, -20) if reset else (7, -25)]


@pytest.mark.parametrize("power_cut", [False, True])
def test_a_power_cut_while_the_port_is_closed(bench, power_cut):
    """The boot count is 1 again; the board's time tells the driver that knew it."""
    bench.board.crank = 1000
    bench.stream(3.0)
    bench.driver.stop()
    bench.board.read(2.0)
    if power_cut:
        bench.board.reset(boot_frame=False)
        bench.board.boot_count = 1
    bench.driver.use(bench.board)
    bench.scans.clear()
    bench.stream(1.0)
    assert {(s.count_epoch, s.crank) for s in bench.scans} == {(2, 0) if power_cut else (1, 1000)}


def test_board_that_went_idle_is_started_again(bench):
    bench.stream(3.0)
    bench.board.crank = 77
    bench.board.go_idle()
    bench.driver.poll(3.0)
    assert bench.driver.statistics.restarts == 1
    assert bench.scans[-1].crank == 77
    assert {scan.count_epoch for scan in bench.scans} == {1}  # it counts on while idle
    assert "has gone idle" in bench.warnings[0]


def test_a_line_that_goes_while_the_run_is_started_again_leaves_no_run_without_scans(bench):
    """The plug bounces under the request to start: the board answers again, but nothing streams."""
    bench.stream(3.0)
    answer, bounced = bench.board._answer, []

    def bounce(request: bytes) -> None:
        if request[0] == START and not bounced:
            bounced.append(request)
            raise OSError("the port is gone")
        answer(request)

    bench.board._answer = bounce
    bench.board.go_idle()
    bench.driver.poll(10.0)
    assert bounced
    assert bench.driver.statistics.restarts == 1
    assert bench.board.now_ns - bench.scans[-1].stamp_ns < 100 * MS


@pytest.mark.parametrize("reset", [False, True])
@pytest.mark.parametrize("answered", [0, 4])
def test_a_restart_that_cannot_learn_the_boards_clock_begins_no_new_epoch(bench, answered, reset):
    """The board's time tells at the next attempt whether it was reset; `answered` of the questions
    for it are, and then a whole round is not."""
    bench.stream(3.0)
    bench.board.crank = 77
    answer, asked = bench.board._answer, []

    def lose_a_round(request: bytes) -> None:
        if CONFIGURE in bench.board.requests:
            asked.append(request[0])
            bench.board.answer_losses[SYNC] = asked.count(SYNC) in range(answered + 1, answered + 7)
        answer(request)

    bench.board.requests.clear()
    bench.board._answer = lose_a_round
    if reset:
        bench.board.reset(boot_frame=False)
        bench.board.boot_count = 1  # as a power cut begins it anew
        bench.board.crank = 77
    else:
        bench.board.go_idle()
    bench.driver.poll(12.0)
    assert asked.count(SYNC) > answered + 6
    assert bench.driver.statistics.restarts == 1
    assert bench.scans[-1].crank == 77
    assert [epoch for epoch, _ in itertools.groupby(s.count_epoch for s in bench.scans)] == (
        [1, 2] if reset else [1]
    )


def test_a_stream_that_went_idle_unnoticed_is_charged_up_to_the_stop(bench):
    """The board stands by the count of its own scans, which ends where it went idle."""
    bench.stream(2.0)
    bench.board.go_idle()
    bench.board.now_ns += SECOND // 2
    bench.driver.stop()
    assert bench.driver.statistics.scans_scheduled == pytest.approx(250, abs=1)
    (warning,) = bench.warnings
    assert warning.startswith("the board has gone idle, having heard nothing from the host for too")
    assert warning.endswith(f"scans lost up to the stop: {bench.driver.statistics.scans_lost}")
    bench.driver.poll(3.0)  # what is stopped stays so
    assert not bench.board.streaming


@pytest.mark.parametrize("back", [True, False])
def test_board_that_does_not_answer_the_stop(bench, back):
    """It is waited for, as for a bootloader; the account is settled either way."""
    bench.stream(2.0)
    bench.board.deaf = True
    bench.board.go_idle()

    def boot() -> None:
        bench.board.deaf = False
        bench.board.reset()

    if back:
        bench.board.after(2 * SECOND, boot)
        bench.driver.stop()
    else:
        with pytest.raises(NoAnswer, match="has not answered within 4 s: check that it has power"):
            bench.driver.stop()
    assert not bench.driver.streaming
    assert bench.driver.statistics.scans_scheduled == pytest.approx(200, abs=1)
    assert bench.driver.statistics.scans_lost <= 2
    assert bench.warnings[0].startswith("the board does not answer 'counters': check its cable")


@pytest.mark.parametrize("ppm", [-5000.0, 5000.0])
def test_a_gap_is_counted_in_the_boards_own_periods(protocol, ppm):
    """Three seconds of silence are 300 of the nominal ones, and 1.5 more or fewer."""
    bench = Bench(protocol, ppm=ppm)
    bench.stream(3.0)
    bench.board.go_idle()
    bench.board.now_ns += 3 * SECOND
    bench.driver.poll(3.0)
    pairs = itertools.pairwise(bench.scans)
    ((before, after),) = [(a, b) for a, b in pairs if b.sequence != a.sequence + 1]
    passed = (after.stamp_ns - before.stamp_ns) / (10 * MS) * bench.board.rate
    assert passed > 300
    assert after.sequence - before.sequence == pytest.approx(passed, abs=0.51)


def test_board_that_falls_silent(bench):
    bench.stream(2.0)
    bench.board.deaf = True
    bench.board.go_idle()
    start_ns = bench.board.now_ns
    with pytest.raises(NoAnswer, match=r"has sent nothing for \d+.\d s: check its power"):
        bench.driver.poll(60.0)
    waited_s = (bench.board.now_ns - start_ns) / SECOND
    assert 30.0 <= waited_s < 2.5 + 30.0 + 1.0  # silence, patience
    assert len(bench.warnings) == 1
    assert bench.warnings[0].startswith("the board has sent nothing for 2.5 s: check its power")


def test_a_frame_that_breaks_off_with_the_board_is_no_word_of_it(bench):
    """Its power goes in the middle of a frame: that is no garbage on the line."""
    bench.stream(2.0)
    bench.board.after(0, lambda: encode_frame(bytes(40))[:18])
    bench.board.deaf = True
    bench.board.go_idle()
    bench.driver.poll(5.0)
    assert bench.warnings[0].startswith("the board has sent nothing for 2.5 s: check its power")


def test_stall_of_the_host_loses_nothing(bench):
    """What the board has sent meanwhile is waiting in the port's buffer."""
    bench.stream(3.0)
    bench.board.now_ns += 4 * SECOND
    bench.driver.poll(1.0)
    assert bench.sequence == list(range(len(bench.scans)))
    assert len(bench.scans) >= 798
    assert bench.driver.statistics.restarts == 0
    # stamps come from the board's ticks, so the late reading does not show in them
    steps = {round((b.stamp_ns - a.stamp_ns) / MS, 1) for a, b in itertools.pairwise(bench.scans)}
    assert steps == {10.0}


def test_reset_to_another_firmware_is_refused(bench):
    bench.stream(2.0)
    bench.board.schema_hash ^= 0xFF00
    bench.board.reset()
    with pytest.raises(BoardError, match="schema"):
        bench.driver.poll(3.0)


def test_a_silent_board_is_reset_by_dtr_and_started_again(bench):
    bench.board.dtr_resets = True
    bench.stream(3.0)
    bench.board.deaf = True
    bench.board.go_idle()
    bench.driver.poll(8.0)
    bench.driver.stop()
    assert len(bench.board.pulses_ns) == 1
    ((before, after),) = [
        (a, b) for a, b in itertools.pairwise(bench.scans) if b.sequence != a.sequence + 1
    ]
    assert after.sequence - before.sequence < 500
    assert bench.driver.statistics.restarts == 1
    assert len(bench.warnings) == 1


def test_a_silent_board_is_left_in_peace(bench):
    """Longer than a bootloader is held; only an order to stop is sent in any case."""
    bench.stream(3.0)
    bench.board.deaf = True
    bench.board.go_idle()
    bench.driver.poll(0.3)
    bench.board.requests.clear()
    with pytest.raises(NoAnswer):
        bench.driver.drive("keep")
    bench.driver.poll(20.0)
    assert bench.board.requests == []
    assert len(bench.board.pulses_ns) == 2
    assert bench.board.pulses_ns[1] - bench.board.pulses_ns[0] > 9 * SECOND
    for action in ("stop", "emergency_stop"):
        with pytest.raises(NoAnswer):
            bench.driver.drive(action)
    assert bench.board.requests == [DRIVE] * 6


def test_a_stream_without_scans_is_started_again(bench):
    """The board says that it streams, and nothing is wrong with its other frames."""
    bench.board.skip = set(range(200, 10_000))
    bench.stream(2.5)
    bench.driver.poll(3.0)
    assert bench.driver.statistics.restarts == 1
    assert len(bench.scans) > 200
    (warning,) = bench.warnings
    assert warning.startswith("the board has sent no scan for 2.5 s, but other frames: starting it")


def test_a_stream_that_never_has_a_scan_again_ends_with_the_patience(bench):
    """However well the board answers."""
    bench.board.skip = set(range(10_000))
    bench.stream(0.0)
    begun_ns = bench.board.now_ns
    with pytest.raises(BoardError, match=r"no scan for 2\.5 s.* no scan has come since"):
        bench.driver.poll(100.0)
    # 2.5 s to the first restart, which takes 1 s, and no more than one more round each
    assert 30.0 < (bench.board.now_ns - begun_ns) / SECOND < 30.0 + 2 * (2.5 + 1.5)
    assert bench.scans == []


def test_an_adc_whose_supply_comes_back_later_than_the_board_is_waited_for(bench):
    bench.stream(3.0)
    bench.board.adc_present = False
    bench.board.reset()
    bench.driver.poll(8.0)
    assert bench.warnings[-1].startswith("the board refuses 'start': adc fault: check the ADC's")
    bench.board.adc_present = True
    before = len(bench.scans)
    bench.driver.poll(5.0)
    assert len(bench.scans) > before + 200
    assert len({scan.count_epoch for scan in bench.scans}) == 2
    assert bench.driver.statistics.restarts == 1


def test_an_adc_that_stays_dead_after_a_reset_ends_the_run_with_the_patience(bench):
    bench.stream(3.0)
    bench.board.adc_present = False
    bench.board.reset()
    begun_ns = bench.board.now_ns
    with pytest.raises(BoardError, match="adc fault"):
        bench.driver.poll(100.0)
    assert 30.0 < (bench.board.now_ns - begun_ns) / SECOND < 35.0


def test_an_adc_that_dies_in_the_run_ends_it_with_the_patience_and_every_scan_is_kept(bench):
    """The board streams on, without a valid channel: told after 1 s, waited for 30 s from then."""
    bench.board.bad_channels = {number: 0 for number in range(300, 10_000)}
    bench.stream(0.0)
    with pytest.raises(BoardError, match=r"^the ADC has given no valid value for 31 s: check"):
        bench.driver.poll(100.0)
    (told,) = bench.warnings
    assert told.startswith("the ADC has given nothing for 1 s")
    # 100 scans a second, 31 s from the first without a channel; what comes with its last bytes, too
    sequences = [scan.sequence for scan in bench.scans]
    assert sequences == list(range(len(sequences)))
    assert 0 <= len(sequences) - (300 + 3100 + 1) <= 2


def test_an_adc_that_comes_back_within_the_patience_ends_no_run(bench):
    """Each outage has the whole patience; one valid channel ends it."""
    dead = (*range(100, 3000), *range(3001, 6000))  # 29 s and 30 s: each below 1 s and 30 s
    bench.board.bad_channels = dict.fromkeys(dead, 0) | {3000: 0x01}
    bench.stream(65.0)
    assert bench.scans[-1].valid_mask == 0x3F
    assert [w.split(":")[0] for w in bench.warnings] == ["the ADC has given nothing for 1 s"] * 2


def test_what_the_adc_tells_of_in_the_first_second_is_said(bench):
    """Of a run, and of a board's life; what it told an earlier host of is not."""
    bench.board.adc_error_bits = 0x01
    bench.stream(0.0)
    bench.board.adc_error_bits |= 0x02
    bench.driver.poll(3.0)
    (text,) = bench.warnings
    assert text.startswith("the ADC tells of register checksum: ")
    bench.board.adc_error_bits = 0x02
    bench.board.reset()
    bench.driver.poll(5.0)
    assert [w.split(":")[0] for w in bench.warnings[1:]] == [
        "the board was reset (watchdog)",
        "the ADC tells of register checksum",
    ]


def test_another_board_in_the_middle_of_a_run_is_refused(bench):
    """Plugged in for a dead one while the run waits: the calibrations are not its own."""
    bench.stream(3.0)
    bench.board.board_serial = 9
    bench.board.reset()
    with pytest.raises(BoardError, match=r"number 9, calibration 7\) is not .* number 8, cal"):
        bench.driver.poll(5.0)
    assert {scan.count_epoch for scan in bench.scans} == {1}


def test_what_was_put_right_on_the_line_is_told(bench):
    bench.stream(1.0)
    bench.board.repair = "somebody was here"
    bench.driver.poll(0.3)
    assert bench.warnings == ["somebody was here"]
    assert bench.driver.statistics.line_repairs == 1


@pytest.mark.parametrize("suspect", ["", "screen (pid 7)"])
def test_many_damaged_frames_are_told(bench, suspect):
    """One in ten, in any two seconds; not again within half a minute."""
    bench.board.suspect = suspect
    bench.stream(4.0)
    frames = itertools.count()
    bench.board.mangle = lambda frame: frame[:-3] + b"\0" if next(frames) % 10 == 0 else frame
    bench.driver.poll(20.0)
    (warning,) = bench.warnings
    assert "frames in 2 s were damaged: " in warning
    assert warning.endswith(
        f"{suspect} has the port open as well and takes bytes: stop it"
        if suspect
        else "check the cable and its ground"
    )
