# SPDX-License-Identifier: GPL-3.0-or-later
"""The virtual board as a Python object: the real firmware in an emulated microcontroller.

It has no clock. Time is what the caller makes it: `run_until` emulates up to an instant, in
nanoseconds since power-on, as fast as the machine can. The same inputs give the same bytes.

    with VirtualBoard("build/firmware/towtank_board.elf", seed=3) as board:
        board.push_bench(BenchFrame(10_000_000, (0.02, 0.02, 1.65, 1.65, 2.31, 10.0), 0.0, 0.0))
        board.run_until(10_000_000)
        board.read()
"""

from __future__ import annotations

import enum
import functools
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from cffi import FFI

_BUILD = Path(__file__).resolve().parents[2] / "build/firmware"
LIBRARY = _BUILD / "vboard/libtowtank_vboard.so"
_HEADER = _BUILD / "vboard/vboard.cdef"
_GENERATED = _BUILD / "generated"

if not (_GENERATED / "protocol_records.py").exists():
    raise ImportError(f"{_GENERATED} has no protocol_records.py: build it with make -C firmware")
sys.path.append(str(_GENERATED))

import protocol_records as records  # noqa: E402
from protocol_records import BENCH_MAGIC, CHANNELS, ResetCause  # noqa: E402


class VirtualBoardError(RuntimeError):
    """The board cannot start, or its firmware has stopped for good."""


class Bootloader(enum.IntEnum):
    """What a reset of the board starts before the firmware: vboard.h and bootloader.h."""

    NONE = 0
    SHIPPED = 1
    OLD = 2


class Disturbance(enum.IntEnum):
    """What becomes of the processor in a disturbance."""

    HANGS = 0  # in an endless loop; interrupts go on
    CRASHES = 1  # likewise, with interrupts off
    STRAY_INTERRUPT = 2  # one that the firmware never enabled


class FrameResult(enum.IntEnum):
    """What became of a bench frame."""

    ACCEPTED = 0
    LATE = 1  # for an instant that the board or an earlier frame has passed
    MALFORMED = 2  # wrong size or magic, a number that is not finite, or more than a day ahead


@dataclass(frozen=True)
class BenchFrame:
    """What the board's terminals see at one instant; straight lines join the frames.

    time_ns: nanoseconds since power-on.
    terminal_volts: voltages in channel order, before the analog front end: two bridges
        (differential), three accelerometer outputs, the excitation.
    crank_angle_rad, carriage_angle_rad: encoder shaft angles in radians, unbounded.
    """

    time_ns: int
    terminal_volts: Sequence[float]
    crank_angle_rad: float
    carriage_angle_rad: float
    sequence: int = 0

    def pack(self) -> bytes:
        """The frame's bytes as they pass over the bench socket."""
        if len(self.terminal_volts) != len(CHANNELS):
            raise ValueError(f"{len(self.terminal_volts)} terminal voltages; give {len(CHANNELS)}")
        frame: bytes = records.BenchFrame(
            magic=BENCH_MAGIC,
            sequence=self.sequence & 0xFFFFFFFF,
            time_ns=self.time_ns,
            terminal_volts=tuple(self.terminal_volts),
            crank_angle_rad=self.crank_angle_rad,
            carriage_angle_rad=self.carriage_angle_rad,
        ).pack()
        return frame


@functools.cache
def _interface() -> FFI:
    """vboard.h, as the build has left it for reading here."""
    ffi = FFI()
    ffi.cdef(_HEADER.read_text())
    return ffi


def _load(path: Path) -> Any:
    try:
        return _interface().dlopen(str(path))
    except OSError as error:
        raise VirtualBoardError(f"{error}; build it with make -C firmware") from error


def _fields(structure: Any) -> dict[str, Any]:
    """The numbers of a C structure by name."""
    return {name: getattr(structure, name) for name in dir(structure)}


def nominal_motor(library: str | Path = LIBRARY) -> dict[str, float]:
    """The crank's motor and its tow as they are unless `crank_motor` says otherwise."""
    options = _interface().new("vb_options *")
    _load(Path(library)).vb_default_options(options)
    return _fields(options.motor)


class VirtualBoard:
    """One virtual board. Not for several threads at once.

    elf: firmware for the ATmega2560.
    crank_counts_per_revolution, carriage_counts_per_revolution: of the encoders, after ×4 decoding.
    clock_ppm, adc_clock_ppm: the board's crystal and the ADC's oscillator run this much fast.
    seed: of the noise, the faults and the RAM's content at power-on.
    noise_volts: standard deviation of one conversion in volts at the ADC's input: one value for
        all channels, six values, or None for the nominal ones of board.yaml.
    self_test_volts: six voltages that the accelerometer's self-test adds at the terminals, or None
        for those of board.yaml.
    crank_motor: the crank is turned by its 12 V motor, as the firmware drives it, instead of by the
        bench's frames: the quantities of vb_motor in vboard.h that differ from the nominal ones.
    sync_goes_on: the rising edge of the ADC's SYNC lets its sequence go on where it was held,
        instead of beginning it anew; nobody says which the chip does.
    bootloader: what a reset starts; NONE, as on a board whose fuses say so, is the firmware.
    eeprom: file that is the EEPROM (4096 bytes, made if missing), or None for a blank one.

    Raises VirtualBoardError if the library or the firmware cannot be loaded.
    """

    def __init__(
        self,
        elf: str | Path,
        *,
        crank_counts_per_revolution: int = 4096,
        carriage_counts_per_revolution: int = 4096,
        clock_ppm: float = 0.0,
        adc_clock_ppm: float = 0.0,
        seed: int = 1,
        noise_volts: float | Sequence[float] | None = None,
        self_test_volts: Sequence[float] | None = None,
        crank_motor: Mapping[str, float] | None = None,
        sync_goes_on: bool = False,
        bootloader: Bootloader = Bootloader.NONE,
        eeprom: str | Path | None = None,
        library: str | Path = LIBRARY,
    ) -> None:
        self._board: Any = None
        self._library = _load(Path(library))
        self._ffi = _interface()
        self._chunk = self._ffi.new("uint8_t[4096]")  # for reading
        options = self._ffi.new("vb_options *")
        self._library.vb_default_options(options)
        options.size = self._ffi.sizeof("vb_options")
        options.crank_counts_per_revolution = crank_counts_per_revolution
        options.carriage_counts_per_revolution = carriage_counts_per_revolution
        options.clock_ppm = clock_ppm
        options.adc_clock_ppm = adc_clock_ppm
        options.seed = seed
        if isinstance(noise_volts, int | float):
            noise_volts = [noise_volts] * len(CHANNELS)
        if noise_volts is not None:
            if len(noise_volts) != len(CHANNELS):
                raise ValueError(f"{len(noise_volts)} noise values; give one or {len(CHANNELS)}")
            options.noise_volts = list(noise_volts)
        if self_test_volts is not None:
            options.self_test_volts = list(self_test_volts)
        if crank_motor is not None:
            options.crank = 1
            for quantity, value in crank_motor.items():
                if quantity not in _fields(options.motor):
                    raise ValueError(f"the crank's motor has no {quantity}: see vboard.h")
                setattr(options.motor, quantity, value)
        options.adc_sequence = sync_goes_on
        options.bootloader = bootloader
        if eeprom is not None:
            path = self._ffi.new("char[]", str(eeprom).encode())  # kept until the board is open
            options.eeprom_path = path
        error = self._ffi.new("char[512]")
        self._board = self._library.vb_open(str(elf).encode(), options, error, len(error))
        if not self._board:
            raise VirtualBoardError(self._ffi.string(error).decode())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exception_type: type[BaseException] | None,
        exception: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Frees the board; a second call does nothing."""
        if self._board:
            self._library.vb_close(self._board)
            self._board = None

    @property
    def _handle(self) -> Any:
        if not self._board:
            raise VirtualBoardError("the virtual board is closed")
        return self._board

    @property
    def now_ns(self) -> int:
        """True time in nanoseconds since power-on."""
        return int(self._library.vb_now_ns(self._handle))

    def push_bench(self, frame: BenchFrame | bytes) -> FrameResult:
        """Gives the board's terminals one more sample; frames must come in order of time."""
        data = frame if isinstance(frame, bytes) else frame.pack()
        return FrameResult(self._library.vb_push_bench(self._handle, data, len(data)))

    def restart_bench(self) -> None:
        """Another bench takes over: its first frame moves no encoder."""
        self._library.vb_restart_bench(self._handle)

    def run_until(self, time_ns: int) -> None:
        """Emulates up to an instant; does nothing if that has passed.

        Raises VirtualBoardError if the firmware stops for good.
        """
        if self._library.vb_run_until(self._handle, time_ns) != 0:
            raise VirtualBoardError(
                self._ffi.string(self._library.vb_stop_reason(self._handle)).decode()
            )

    def write(self, data: bytes) -> int:
        """Sends bytes to the board's UART at its baud rate, from now on. Returns their number."""
        return int(self._library.vb_write(self._handle, data, len(data)))

    def read(self) -> bytes:
        """All bytes that have left the board's UART since the last call."""
        received = bytearray()
        while count := self._library.vb_read(self._handle, self._chunk, len(self._chunk)):
            received += self._ffi.buffer(self._chunk, count)
        return bytes(received)

    def reset(self, cause: ResetCause) -> None:
        """Resets the microcontroller; POWER_ON and BROWN_OUT take the ADC's power as well."""
        if self._library.vb_reset(self._handle, cause) != 0:
            raise ValueError(f"{cause} is no reset cause")

    def dip_adc_supply(self) -> None:
        """The ADC resets itself; the microcontroller runs on."""
        self._library.vb_dip_adc_supply(self._handle)

    def flip_adc_bit(self, address: int, bit: int) -> None:
        """Flips a bit of one of the ADC's registers that can be written."""
        if self._library.vb_flip_adc_bit(self._handle, address, bit) != 0:
            raise ValueError(f"the ADC has no bit {bit} to write at address 0x{address:02x}")

    def disturb(self, how: Disturbance) -> None:
        """Something throws the processor off its way, once."""
        if self._library.vb_disturb(self._handle, how) != 0:
            raise ValueError(f"{how!r}: no such disturbance, or no endless loop in the firmware")

    def set_faults(
        self,
        *,
        spi_error_one_in: int = 0,
        adc_silent: bool = False,
        serial_bit_error_rate: float = 0.0,
        serial_byte_drop_rate: float = 0.0,
        serial_byte_double_rate: float = 0.0,
        emergency_stop_open: bool = False,
        crank_blocked: bool = False,
        crank_encoder_silent: bool = False,
        tow_parted: bool = False,
        crank_encoder_unplugged: bool = False,
        crank_track_a_dead: bool = False,
        crank_track_b_dead: bool = False,
        crank_encoder_reversed: bool = False,
        crank_encoder_slip: float = 0.0,
        driver_shorted: bool = False,
        crank_driven_n_m: float = 0.0,
    ) -> None:
        """Sets all faults at once; those not named are off.

        spi_error_one_in: one ADC read transaction in this many has one bit flipped.
        adc_silent: the ADC neither answers nor signals.
        serial_*_rate: probabilities per data bit or per byte, in both directions;
            serial_byte_drop_rate = 1 is a pulled cable.
        emergency_stop_open: the button is pressed, or its wire broken.
        crank_encoder_unplugged, crank_track_*_dead: both its lines go up; one stays as it is.
        crank_blocked, crank_encoder_silent, tow_parted, crank_encoder_reversed, driver_shorted:
            where the motor turns the crank.
        crank_encoder_slip: the share of the crank's turning that its encoder does not follow.
        crank_driven_n_m: torque that turns the crank on from outside, at least 0.
        """
        for rate in (serial_bit_error_rate, serial_byte_drop_rate, serial_byte_double_rate):
            if not (math.isfinite(rate) and 0.0 <= rate <= 1.0):
                raise ValueError(f"rate {rate}: give a probability")
        if not 0.0 <= crank_driven_n_m < math.inf:
            raise ValueError(f"torque {crank_driven_n_m}: give one of at least 0 N m")
        if not 0.0 <= crank_encoder_slip <= 1.0:
            raise ValueError(f"slip {crank_encoder_slip}: give a share from 0 to 1")
        faults = self._ffi.new(
            "const vb_faults *",
            {
                "spi_error_one_in": spi_error_one_in,
                "adc_silent": adc_silent,
                "serial_bit_error_rate": serial_bit_error_rate,
                "serial_byte_drop_rate": serial_byte_drop_rate,
                "serial_byte_double_rate": serial_byte_double_rate,
                "emergency_stop_open": emergency_stop_open,
                "crank_blocked": crank_blocked,
                "crank_encoder_silent": crank_encoder_silent,
                "tow_parted": tow_parted,
                "crank_encoder_unplugged": crank_encoder_unplugged,
                "crank_track_a_dead": crank_track_a_dead,
                "crank_track_b_dead": crank_track_b_dead,
                "crank_encoder_reversed": crank_encoder_reversed,
                "crank_encoder_slip": crank_encoder_slip,
                "driver_shorted": driver_shorted,
                "crank_driven_n_m": crank_driven_n_m,
            },
        )
        self._library.vb_set_faults(self._handle, faults)

    def set_clock_ppm(self, clock_ppm: float) -> None:
        """Changes the rate of the board's crystal from now on; time stays continuous."""
        self._library.vb_set_clock_ppm(self._handle, clock_ppm)

    def preset(self, variable: str, data: bytes, offset: int = 0) -> None:
        """Sets bytes of a variable of the firmware, as for a run that begins near the end of a
        counter. Raises ValueError if the firmware has not just one such variable of that size."""
        if self._library.vb_preset(self._handle, variable.encode(), offset, data, len(data)):
            raise ValueError(f"the firmware has no variable '{variable}' of this size")

    def counters(self) -> dict[str, Any]:
        """What has happened since power-on, and the motor: vb_counters in vboard.h."""
        counters = self._ffi.new("vb_counters *")
        self._library.vb_get_counters(self._handle, counters)
        return _fields(counters)
