# SPDX-License-Identifier: Apache-2.0
"""Check that `board.yaml` is consistent and write what follows from it, for C or for Python.

    python generate.py OUTPUT.h     # board_protocol.h, of firmware and virtual board
    python generate.py OUTPUT.py    # protocol_records.py, of whatever speaks to them

For every frame, request arguments, response data and the bench frame the header holds
`struct NAME`, `NAME_SIZE`, `NAME_pack` and `NAME_unpack` (little-endian bytes, no padding), the
module a record `Name` with `pack` and `unpack`. They hold the fields that the file lists; type,
request id and status are the callers'.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from schema_hash import load_board, schema_hash

BOARD_YAML = Path(__file__).with_name("board.yaml")
RECORDS_HEAD = Path(__file__).with_name("records_head.py")

INTEGER_BYTES = {"u8": 1, "u16": 2, "u24": 3, "u32": 4, "u64": 8, "i16": 2, "i32": 4, "i64": 8}
C_TYPES = {
    "u8": "uint8_t",
    "u16": "uint16_t",
    "u24": "uint32_t",
    "u32": "uint32_t",
    "u64": "uint64_t",
    "i16": "int16_t",
    "i32": "int32_t",
    "i64": "int64_t",
    "f64": "double",
}
PYTHON_TYPES = dict.fromkeys(C_TYPES, "int") | {"f64": "float"}
# Numbers with names: what each is called in C and in Python, and whether it holds bits.
ENUMERATIONS = {
    "status": ("STATUS", "Status", False),
    "board_state": ("STATE", "BoardState", False),
    "configuration_origin": ("CONFIGURATION_ORIGIN", "ConfigurationOrigin", False),
    "data_flags": ("FLAG", "DataFlag", True),
    "reset_cause": ("RESET_CAUSE", "ResetCause", True),
    "adc_error": ("ADC_ERROR", "AdcError", True),
    "identity_state": ("IDENTITY_STATE", "IdentityState", False),
    "drive_state": ("DRIVE_STATE", "DriveStatus", False),
    "drive_trip": ("DRIVE_TRIP", "DriveTrip", False),
    "drive_action": ("DRIVE_ACTION", "DriveAction", False),
}
# AD7124 input multiplexer codes (CHANNEL register, AINP and AINM).
INPUTS = {f"AIN{i}": i for i in range(16)} | {
    "temperature": 16,
    "AVSS": 17,
    "avdd_sixth_positive": 20,
    "avdd_sixth_negative": 21,
    "test_voltage_positive": 28,
    "test_voltage_negative": 29,
}
REFERENCES = {"refin1": 0, "refin2": 1, "internal": 2, "avdd": 3}
PGA_GAINS = {1: 0, 2: 1, 4: 2, 8: 3, 16: 4, 32: 5, 64: 6, 128: 7}
MAXIMUM_SETUPS = 8


class Inconsistent(Exception):
    """The board file contradicts itself; the message says where and what."""


def check(condition: bool, message: str) -> None:
    if not condition:
        raise Inconsistent(message)


class Field:
    """One field of a frame: name, scalar type, number of elements (None: not an array)."""

    def __init__(self, name: str, type_name: str) -> None:
        match = re.fullmatch(r"(\w+?)(?:\[(\d+)\])?", type_name)
        check(match is not None and match[1] in C_TYPES, f"field {name}: no type {type_name!r}")
        self.name = name
        self.scalar = match[1]
        self.count = int(match[2]) if match[2] else None

    def __repr__(self) -> str:
        return f"{self.name} {self.scalar} {self.count}"

    @property
    def scalar_size(self) -> int:
        return INTEGER_BYTES.get(self.scalar, 8)

    @property
    def size(self) -> int:
        return self.scalar_size * (self.count or 1)


def fields_of(listed: list[list[str]]) -> list[Field]:
    return [Field(*field) for field in listed]


def layouts(board: dict[str, Any]) -> Iterator[tuple[str, list[Field]]]:
    """Every layout as (C name, fields); one that a response shares with another is not repeated."""
    known = [frame["fields"] for frame in board["stream"].values()]
    known += [command["arguments"] for command in board["commands"].values()]
    for name, frame in board["stream"].items():
        yield f"{name}_frame", fields_of(frame["fields"])
    for name, command in board["commands"].items():
        if command["arguments"]:
            yield f"{name}_arguments", fields_of(command["arguments"])
        if command["response"] and command["response"] not in known:
            yield f"{name}_response", fields_of(command["response"])
    yield "bench_frame", fields_of(board["bench"]["fields"])


def check_consistency(board: dict[str, Any]) -> None:
    channels = board["channels"]
    check(0 < len(channels) <= 8, "channels: valid_mask holds 1 to 8")
    names = [channel["name"] for channel in channels]
    check(len(set(names)) == len(names), "channels: a name stands twice")
    for slot in channels + board["housekeeping"] + board["self_test"]["slots"]:
        where = slot["name"]
        check(slot["setup"] in board["adc"]["setups"], f"{where}: no setup {slot['setup']!r}")
        for side in ("positive", "negative"):
            check(slot[side] in INPUTS, f"{where}: no ADC input {slot[side]!r}")
            buffered = board["adc"]["setups"][slot["setup"]][f"buffer_{side}"]
            check(
                not (slot[side] == "AVSS" and buffered),
                f"{where}: its {side} input is AVSS, below the range of its buffer",
            )
    for channel in channels:
        limits = channel.get("output_limits_volts")
        check(
            not limits or limits["minimum"] < channel["output_reference_volts"] < limits["maximum"],
            f"{channel['name']}: output_limits_volts do not hold output_reference_volts",
        )
    # Each channel has a setup of its own, because it has a gain of its own; housekeeping has one.
    check(len(channels) + 1 <= MAXIMUM_SETUPS, "channels: the ADC has eight setups")
    setups = {source["setup"] for source in board["housekeeping"]}
    check(len(setups) == 1, "housekeeping: its sources share one setup")
    for name, setup in board["adc"]["setups"].items():
        check(
            setup["reference"] in REFERENCES, f"setup {name}: no reference {setup['reference']!r}"
        )
        check(setup["pga"] in PGA_GAINS, f"setup {name}: no gain {setup['pga']!r}")
        grounded = setup["reference"] == "refin1" and board["adc"]["refin1_negative"] == "AVSS"
        check(
            not (grounded and setup["reference_buffer_negative"]),
            f"setup {name}: REFIN1− is AVSS, below the range of its buffer",
        )
    adc_filter = board["adc"]["filter"]
    check(adc_filter["type"] in adc_filter["types"], "adc.filter.type: is none of adc.filter.types")

    self_test = board["self_test"]
    for name in self_test["accelerometer"]:
        check(name in names, f"self_test.accelerometer: no channel {name!r}")
    slots = len(self_test["slots"]) + len(self_test["accelerometer"])
    check(slots <= MAXIMUM_SETUPS, "self_test: the ADC has eight setups")
    response = {field.name: field for field in dict(layouts(board))["self_test_response"]}
    for name in ("rest_codes", "deflected_codes"):
        count = len(self_test["accelerometer"])
        check(response[name].count == count, f"self_test.{name}: one per axis")

    data = {field.name: field for field in dict(layouts(board))["data_frame"]}
    check(data["codes"].count == len(channels), "data.codes: one element per channel")
    bench = {field.name: field for field in dict(layouts(board))["bench_frame"]}
    check(bench["terminal_volts"].count == len(channels), "bench.terminal_volts: one per channel")
    arguments = dict(layouts(board))["configure_arguments"]
    for field in arguments:
        check(field.count in (None, len(channels)), f"configure.{field.name}: one per channel")
    slots = board["eeprom"]["configuration"]["slots"]
    check(len(slots) == 2, "eeprom.configuration.slots: two")
    slot_size = 2 + sum(field.size for field in arguments) + 2
    check(
        min(slots) >= 10 and abs(slots[0] - slots[1]) >= slot_size,
        f"eeprom: {slot_size} bytes a slot overlap with something else",
    )

    wire = board["wire"]
    types = [frame["type"] for frame in board["stream"].values()]
    types += [command["type"] for command in board["commands"].values()]
    types += [command["type"] | wire["response_bit"] for command in board["commands"].values()]
    check(len(set(types)) == len(types), "frame types: one stands twice")
    for name, fields in layouts(board):
        header = 3  # type, request id, status
        size = sum(field.size for field in fields)
        check(
            name == "bench_frame" or header + size <= wire["maximum_payload"],
            f"{name}: longer than wire.maximum_payload",
        )
    check(wire["maximum_payload"] + 2 <= 254, "wire.maximum_payload: one COBS code block holds 254")

    pins = [pin["pin"] for pin in board["pins"].values()]
    check(len(set(pins)) == len(pins), "pins: one stands twice")
    controller = board["microcontroller"]
    check(controller["clock_hz"] % controller["tick_hz"] == 0, "tick_hz: does not divide clock_hz")

    drive = board["drive"]
    steps = controller["tick_hz"] % drive["control_hz"]
    check(steps == 0, "drive.control_hz: does not divide tick_hz")
    ramp = 100 * drive["ramp_rpm_per_s"]
    check(ramp >= drive["control_hz"], "drive.ramp_rpm_per_s: less than 0.01 rpm a control step")
    standing = drive["ceiling_duty"]["standing"]
    check(0.0 < standing <= 1.0, "drive.ceiling_duty.standing: not within 0 and 1")
    alive = drive["alive_s"] * drive["control_hz"]
    check(alive >= 2.0, "drive.alive_s: shorter than two control steps")


def drive_lines(drive: dict[str, Any], tick_hz: int) -> Iterator[str]:
    """The crank drive's figures in the firmware's units.

    Speeds in 0.01 rpm, duties in 0.01 %, angles in 1/10240 revolution, gains with 8 binary places.
    """
    rad_s = 100 * 60 / (2 * math.pi)  # 0.01 rpm
    rad = 10240 / (2 * math.pi)
    gains = {
        "PROPORTIONAL_Q8": 256 * 10_000 * drive["proportional_duty_per_rad_s"] / rad_s,
        "INTEGRAL_Q8": 256 * 10_000 * drive["integral_duty_per_rad"] / rad,
    }
    yield define("BOARD_DRIVE_SPEED_MINIMUM", f"{100 * drive['speed_rpm']['minimum']}u")
    yield define("BOARD_DRIVE_SPEED_MAXIMUM", f"{100 * drive['speed_rpm']['maximum']}u")
    yield define("BOARD_DRIVE_CONTROL_HZ", f"{drive['control_hz']}u")
    ramp = 100 * drive["ramp_rpm_per_s"] // drive["control_hz"]
    yield define("BOARD_DRIVE_RAMP_A_STEP", f"{ramp}u")
    yield define("BOARD_DRIVE_WINDOW_STEPS", f"{drive['speed_window_steps']}u")
    for name, value in gains.items():
        yield define(f"BOARD_DRIVE_{name}", round(value))
    yield define("BOARD_DRIVE_PWM_HZ", f"{drive['pwm_hz']}u")
    ceiling = drive["ceiling_duty"]
    yield define("BOARD_DRIVE_CEILING_STANDING", f"{round(10_000 * ceiling['standing'])}u")
    yield define("BOARD_DRIVE_CEILING_SLOPE_Q8", round(256 * 100 * ceiling["per_rpm"]))
    for name in ("overspeed", "abrupt", "rest"):
        yield define(f"BOARD_DRIVE_{name.upper()}", f"{100 * drive[f'{name}_rpm']}u")
    yield define("BOARD_DRIVE_STALL_PARTS", f"{drive['stall_parts']}u")
    yield define("BOARD_DRIVE_MOVEMENT_PARTS", f"{drive['movement_parts']}u")
    yield define("BOARD_DRIVE_REVERSE_PARTS", f"{drive['reverse_parts']}u")
    yield define("BOARD_DRIVE_EDGE_PARTS", f"{drive['edge_parts']}u")
    periods = round(drive["alive_s"] * drive["pwm_hz"])
    yield define("BOARD_DRIVE_ALIVE_PERIODS", f"{periods}u")
    times = {
        "COMMAND_TIMEOUT": drive["command_timeout_s"],
        "START": drive["start_s"],
        "STALL": drive["stall_s"],
        "OVERLOAD": drive["overload_s"],
        "FRAME_MOVING": drive["frame_s"]["moving"],
        "FRAME_STANDING": drive["frame_s"]["standing"],
    }
    for name, seconds in times.items():
        yield define(f"BOARD_DRIVE_{name}_TICKS", u32(round(seconds * tick_hz)))


def config_register(setup: dict[str, Any]) -> int:
    """AD7124 CONFIG_n: bipolar 11, REF_BUFP and REF_BUFM 8 and 7, AIN_BUFP and AIN_BUFM 6 and 5,
    REF_SEL 4:3, PGA 2:0.
    """
    return (
        setup["bipolar"] << 11
        | setup["reference_buffer_positive"] << 8
        | setup["reference_buffer_negative"] << 7
        | setup["buffer_positive"] << 6
        | setup["buffer_negative"] << 5
        | REFERENCES[setup["reference"]] << 3
        | PGA_GAINS[setup["pga"]]
    )


def channel_register(slot: dict[str, Any], setup: int = 0) -> int:
    """AD7124 CHANNEL_n: enable 15, setup 14:12, AINP 9:5, AINM 4:0."""
    return 1 << 15 | setup << 12 | INPUTS[slot["positive"]] << 5 | INPUTS[slot["negative"]]


def define(name: str, value: object) -> str:
    return f"#define {name} {value}"


def braces(values: list[object]) -> str:
    return "{ " + ", ".join(str(value) for value in values) + " }"


def hexadecimal(value: int, digits: int) -> str:
    return f"0x{value:0{digits}X}u"


def u32(value: int) -> str:
    """A constant that is 32 bits wide on the AVR as on the host."""
    return f"UINT32_C({value})"


def pin_lines(pins: dict[str, Any]) -> Iterator[str]:
    for name, pin in pins.items():
        prefix = f"BOARD_PIN_{name.upper()}"
        yield define(f"{prefix}_PORT", f"'{pin['pin'][0]}'")
        yield define(f"{prefix}_BIT", pin["pin"][1])


def constant_lines(board: dict[str, Any]) -> Iterator[str]:
    controller, adc, wire = board["microcontroller"], board["adc"], board["wire"]
    channels = board["channels"]
    setups = adc["setups"]
    rate = board["sampling"]["rate_hz"]

    yield define("BOARD_PROTOCOL", f"{board['protocol']}u")
    yield define("BOARD_SCHEMA_HASH", u32(schema_hash(board)))
    yield define("BOARD_FIRMWARE_VERSION", braces(board["firmware_version"]))
    yield define("BOARD_CLOCK_HZ", u32(controller["clock_hz"]))
    yield define("BOARD_TICK_HZ", u32(controller["tick_hz"]))
    yield define("BOARD_WATCHDOG_MS", f"{round(controller['watchdog_s'] * 1000)}u")
    silence = round(controller["host_silence_s"] * controller["tick_hz"])
    yield define("BOARD_HOST_SILENCE_TICKS", u32(silence))
    yield define("BOARD_RATE_MINIMUM_HZ", f"{rate['minimum']}u")
    yield define("BOARD_RATE_MAXIMUM_HZ", f"{rate['maximum']}u")
    yield define("BOARD_RATE_DEFAULT_HZ", f"{rate['default']}u")
    yield ""
    yield from pin_lines(board["pins"])
    yield ""
    yield define("BOARD_ADC_MASTER_CLOCK_HZ", u32(adc["master_clock_hz"]))
    yield define("BOARD_ADC_SPI_CLOCK_HZ", u32(adc["spi"]["clock_hz"]))
    yield define("BOARD_ADC_INTERNAL_REFERENCE_VOLTS", adc["internal_reference_volts"])
    yield define("BOARD_ADC_BUFFER_HEADROOM_VOLTS", adc["buffer_headroom_volts"])
    yield define("BOARD_ADC_SUPPLY_VOLTS", adc["supply_volts"])
    yield define("BOARD_ADC_REFIN1_PER_EXCITATION", adc["refin1_per_excitation"])
    for name, kind in adc["filter"]["types"].items():
        yield define(f"BOARD_ADC_FILTER_{name.upper()}", f"{kind['code']}u")
        yield define(f"BOARD_ADC_FILTER_{name.upper()}_ORDER", f"{kind['order']}u")
    default = adc["filter"]["types"][adc["filter"]["type"]]
    yield define("BOARD_ADC_FILTER_DEFAULT", f"{default['code']}u")
    yield define("BOARD_ADC_FILTER_DEAD_CYCLES", f"{adc['filter']['dead_cycles']}u")
    for limit, value in adc["filter"]["fs"].items():
        yield define(f"BOARD_ADC_FS_{limit.upper()}", f"{value}u")
    recovery = adc["recovery"]
    yield define("BOARD_ADC_EMPTY_SCANS", f"{recovery['empty_scans']}u")
    period = round(recovery["set_up_period_s"] * controller["tick_hz"])
    yield define("BOARD_ADC_SET_UP_PERIOD_TICKS", u32(period))
    yield "/* CHANNEL_n without its setup and CONFIG_n without its gain, by channel. */"
    words = [hexadecimal(channel_register(channel), 4) for channel in channels]
    yield define("BOARD_ADC_CHANNELS_REGISTERS", braces(words))
    words = [
        hexadecimal(config_register(setups[channel["setup"]] | {"pga": 1}), 4)
        for channel in channels
    ]
    yield define("BOARD_ADC_CHANNELS_CONFIG", braces(words))
    yield define("BOARD_ADC_CHANNELS_GAIN", braces([setups[c["setup"]]["pga"] for c in channels]))
    yield "/* The slot behind the channels: CHANNEL_n by source, and its CONFIG_n. */"
    words = [hexadecimal(channel_register(s, len(channels)), 4) for s in board["housekeeping"]]
    yield define("BOARD_ADC_HOUSEKEEPING_REGISTERS", braces(words))
    word = config_register(setups[board["housekeeping"][0]["setup"]])
    yield define("BOARD_ADC_HOUSEKEEPING_CONFIG", hexadecimal(word, 4))
    yield "/* The slots of the self-test, and the channels behind them. */"
    self_test = board["self_test"]
    yield define("BOARD_SELF_TEST_SLOT_COUNT", f"{len(self_test['slots'])}u")
    for index, slot in enumerate(self_test["slots"]):
        yield define(f"BOARD_SELF_TEST_{slot['name'].upper()}", f"{index}u")
    words = [hexadecimal(channel_register(slot), 4) for slot in self_test["slots"]]
    yield define("BOARD_SELF_TEST_REGISTERS", braces(words))
    words = [hexadecimal(config_register(setups[s["setup"]]), 4) for s in self_test["slots"]]
    yield define("BOARD_SELF_TEST_CONFIG", braces(words))
    names = [channel["name"] for channel in channels]
    axes = [names.index(name) for name in self_test["accelerometer"]]
    yield define("BOARD_SELF_TEST_AXIS_COUNT", f"{len(axes)}u")
    yield define("BOARD_SELF_TEST_AXES", braces(axes))
    yield define("BOARD_SELF_TEST_ROUNDS", f"{self_test['rounds']}u")
    yield define("BOARD_SELF_TEST_SETTLE_MS", f"{round(1000 * self_test['settle_s'])}u")
    yield ""
    yield define("BOARD_CHANNEL_COUNT", f"{len(channels)}u")
    for index, channel in enumerate(channels):
        yield define(f"BOARD_CHANNEL_{channel['name'].upper()}", f"{index}u")
    yield define("BOARD_HOUSEKEEPING_COUNT", f"{len(board['housekeeping'])}u")
    for index, source in enumerate(board["housekeeping"]):
        yield define(f"BOARD_HOUSEKEEPING_{source['name'].upper()}", f"{index}u")
    yield "/* Analog front end, one element per channel. */"
    for key in ("gain", "output_reference_volts", "pole_hz", "noise_volts"):
        yield define(f"BOARD_AFE_{key.upper()}", braces([channel[key] for channel in channels]))
    for bound, none in (("minimum", "-INFINITY"), ("maximum", "INFINITY")):
        limits = [channel.get("output_limits_volts", {}).get(bound, none) for channel in channels]
        yield define(f"BOARD_AFE_OUTPUT_{bound.upper()}_VOLTS", braces(limits))
    deflections = [channel.get("self_test_volts", 0.0) for channel in channels]
    yield define("BOARD_AFE_SELF_TEST_VOLTS", braces(deflections))
    yield ""
    yield from drive_lines(board["drive"], controller["tick_hz"])
    yield ""
    eeprom = board["eeprom"]
    yield define("BOARD_EEPROM_BOARD_SERIAL", f"{eeprom['board_serial']}u")
    yield define("BOARD_EEPROM_CALIBRATION_ID", f"{eeprom['calibration_id']}u")
    yield define("BOARD_EEPROM_IDENTITY_CHECKSUM", f"{eeprom['identity_checksum']}u")
    yield define("BOARD_EEPROM_CONFIGURATION_VERSION", f"{eeprom['configuration']['version']}u")
    yield define("BOARD_EEPROM_CONFIGURATION_SLOTS", braces(eeprom["configuration"]["slots"]))
    yield ""
    yield define("BOARD_WIRE_BAUD", u32(wire["baud"]))
    yield define("BOARD_WIRE_DELIMITER", f"{wire['delimiter']}u")
    yield define("BOARD_WIRE_MAXIMUM_PAYLOAD", f"{wire['maximum_payload']}u")
    yield define("BOARD_WIRE_CRC16_INITIAL", hexadecimal(wire["crc16"]["initial"], 4))
    yield define("BOARD_WIRE_RESPONSE_BIT", hexadecimal(wire["response_bit"], 2))
    yield ""
    for name, frame in board["stream"].items():
        yield define(f"BOARD_FRAME_{name.upper()}", hexadecimal(frame["type"], 2))
    for name, command in board["commands"].items():
        yield define(f"BOARD_COMMAND_{name.upper()}", hexadecimal(command["type"], 2))
    for group, (prefix, _, _) in ENUMERATIONS.items():
        for name, value in board[group].items():
            yield define(f"BOARD_{prefix}_{name.upper()}", f"{value}u")
    yield ""
    yield define("BOARD_BENCH_MAGIC", u32(board["bench"]["magic"]))


def layout_lines(name: str, fields: list[Field]) -> Iterator[str]:
    size = sum(field.size for field in fields)
    yield ""
    yield define(f"{name.upper()}_SIZE", f"{size}u")
    yield f"struct {name} {{"
    for field in fields:
        extent = "" if field.count is None else f"[{field.count}]"
        yield f"    {C_TYPES[field.scalar]} {field.name}{extent};"
    yield "};"
    for direction in ("pack", "unpack"):
        if direction == "pack":
            yield f"static inline void {name}_pack(uint8_t *bytes, const struct {name} *frame)"
        else:
            yield f"static inline void {name}_unpack(struct {name} *frame, const uint8_t *bytes)"
        yield "{"
        offset = 0
        for field in fields:
            if field.count is None:
                yield "    " + transfer(direction, field, str(offset), f"frame->{field.name}")
            else:
                yield f"    for (uint8_t i = 0; i < {field.count}; i++)"
                place = f"{offset} + {field.scalar_size} * i"
                yield "        " + transfer(direction, field, place, f"frame->{field.name}[i]")
            offset += field.size
        yield "}"


def transfer(direction: str, field: Field, offset: str, member: str) -> str:
    if field.scalar == "f64":
        pair = (f"bytes + {offset}", f"&{member}")
        target, source = pair if direction == "pack" else pair[::-1]
        return f"memcpy({target}, {source}, 8);"
    bits = 8 * field.scalar_size
    unsigned = C_TYPES[f"u{bits}"]
    if direction == "pack":
        return f"board_put_u{bits}(bytes + {offset}, ({unsigned}){member});"
    return f"{member} = ({C_TYPES[field.scalar]})board_get_u{bits}(bytes + {offset});"


def integer_lines() -> Iterator[str]:
    for bits in (8, 16, 24, 32, 64):
        c_type = C_TYPES[f"u{bits}"]
        yield f"static inline void board_put_u{bits}(uint8_t *bytes, {c_type} value)"
        yield "{"
        for byte in range(bits // 8):
            yield f"    bytes[{byte}] = (uint8_t)(value >> {8 * byte});"
        yield "}"
        yield f"static inline {c_type} board_get_u{bits}(const uint8_t *bytes)"
        yield "{"
        terms = [f"(({c_type})bytes[{byte}] << {8 * byte})" for byte in range(bits // 8)]
        yield f"    return ({c_type})({' | '.join(terms)});"
        yield "}"


def header(board: dict[str, Any]) -> str:
    lines = [
        "/* Generated by firmware/protocol/generate.py from board.yaml: edit that, not this. */",
        "#ifndef BOARD_PROTOCOL_H",
        "#define BOARD_PROTOCOL_H",
        "",
        "#include <stdint.h>",
        "#include <string.h>",
        "",
        *constant_lines(board),
        "",
        *integer_lines(),
    ]
    for name, fields in layouts(board):
        lines += layout_lines(name, fields)
    return "\n".join([*lines, "", "#endif", ""])


# ------------------------------------------------------------------------------- in Python


def class_name(layout: str) -> str:
    """A record's name, after that of its struct."""
    return "".join(word.capitalize() for word in layout.split("_"))


def record_lines(name: str, fields: list[Field], frame_type: int | None) -> Iterator[str]:
    kinds = " ".join(f.scalar + (f"[{f.count}]" if f.count else "") for f in fields)
    yield from ("", "", "@dataclass(frozen=True, slots=True)", f"class {class_name(name)}(Record):")
    if frame_type is not None:
        yield f"    TYPE: ClassVar[int] = 0x{frame_type:02X}"
    yield f'    LAYOUT: ClassVar[Layout] = Layout("{kinds}")'
    for field in fields:
        kind = PYTHON_TYPES[field.scalar]
        yield f"    {field.name}: {kind if field.count is None else f'tuple[{kind}, ...]'}"


def request_lines(board: dict[str, Any], known: dict[str, list[Field]]) -> Iterator[str]:
    """A constant for each command without arguments, a function for each with them."""
    names = {str(fields): class_name(name) for name, fields in known.items()}
    for name, command in board["commands"].items():
        answer = names[str(fields_of(command["response"]))] if command["response"] else "Empty"
        made = f'"{name}", 0x{command["type"]:02X}, {answer}'
        if not command["arguments"]:
            yield f"{name.upper()}: Request[{answer}] = Request({made})"
            continue
        arguments = class_name(f"{name}_arguments")
        yield from ("", "", f"def {name}(arguments: {arguments}) -> Request[{answer}]:")
        yield f'    """`{name}` with its arguments. Raises RecordError."""'
        yield f"    return Request({made}, arguments.pack())"
        yield from ("", "")


def records(board: dict[str, Any]) -> str:
    known = dict(layouts(board))
    types = {f"{name}_frame": frame["type"] for name, frame in board["stream"].items()}
    frames = [class_name(name) for name in types]
    lines = [
        f"PROTOCOL = {board['protocol']}",
        f"SCHEMA_HASH = 0x{schema_hash(board):08X}",
        f"TICK_HZ = {board['microcontroller']['tick_hz']}",
        f"CHANNELS = {tuple(channel['name'] for channel in board['channels'])}",
        f"RESPONSE_BIT = 0x{board['wire']['response_bit']:02X}",
        f"BENCH_MAGIC = 0x{board['bench']['magic']:08X}",
    ]
    for group, (_, name, is_flag) in ENUMERATIONS.items():
        lines += ["", "", f"class {name}(enum.{'IntFlag' if is_flag else 'IntEnum'}):"]
        lines += [f"    {member.upper()} = {value}" for member, value in board[group].items()]
    for name, fields in known.items():
        lines += record_lines(name, fields, types.get(name))
    lines += ["", "", f"StreamFrame: TypeAlias = {' | '.join(frames)}"]
    members = ", ".join(f"{name}.TYPE: {name}" for name in frames)
    lines += [f"STREAM: Mapping[int, type[StreamFrame]] = {{{members}}}", ""]
    commands = ", ".join(
        f'0x{command["type"]:02X}: "{name}"' for name, command in board["commands"].items()
    )
    lines += [f"COMMANDS: Mapping[int, str] = {{{commands}}}", ""]
    lines += request_lines(board, known)
    return RECORDS_HEAD.read_text(encoding="utf-8") + "\n".join([*lines, ""])


WRITERS = {".h": header, ".py": records}


def main() -> int:
    if len(sys.argv) != 2 or Path(sys.argv[1]).suffix not in WRITERS:
        print("usage: generate.py OUTPUT.h|OUTPUT.py", file=sys.stderr)
        return 2
    board = load_board(BOARD_YAML)
    try:
        check_consistency(board)
    except Inconsistent as problem:
        print(f"{BOARD_YAML.name}: {problem}", file=sys.stderr)
        return 1
    output = Path(sys.argv[1])
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(WRITERS[output.suffix](board), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
