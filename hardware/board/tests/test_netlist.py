# SPDX-License-Identifier: Apache-2.0
"""The circuit passes its rule check, and agrees with board.yaml, the firmware and the decks."""

from __future__ import annotations

import csv
import io
import re
import sys
from pathlib import Path

import pytest
from towtank_rig import load_rig

ROOT = Path(__file__).resolve().parents[3]
HERE = ROOT / "hardware/board"
sys.path += [str(HERE), str(HERE / "spice"), str(ROOT / "firmware/protocol")]

import bom  # noqa: E402
import power  # noqa: E402
import wiring  # noqa: E402
from front_ends import deck_parameters, spice_number  # noqa: E402
from netlist import DECK_PARTS, Board, build, rule_check  # noqa: E402
from parts import CAPACITORS, MEGA_PINS, RESISTORS  # noqa: E402
from schema_hash import load_board  # noqa: E402

DESCRIPTION = load_board(ROOT / "firmware/protocol/board.yaml")


@pytest.fixture(scope="module")
def board() -> Board:
    return build()


@pytest.fixture
def spoiled() -> Board:
    """A board for one test to change."""
    return build()


def test_rule_check_finds_nothing(board):
    assert rule_check(board) == []


def test_rule_check_finds_outputs_shorted(spoiled):
    spoiled.net("FISH_OUT").connect(spoiled.net("DEPRESSOR_OUT"))
    assert any("OUTPUT connected to OUTPUT" in line for line in rule_check(spoiled))


def test_rule_check_finds_an_open_supply(spoiled):
    spoiled.parts["U501"]["AVDD"].disconnect()
    assert any("Unconnected pin" in line and "U501" in line for line in rule_check(spoiled))


def test_rule_check_finds_an_undriven_supply(spoiled):
    spoiled.parts["U803"]["OUT"].disconnect()
    spoiled.parts["U802"]["OUT"].disconnect()
    assert any("3V3" in line for line in rule_check(spoiled))


def test_no_net_ends_in_the_air(board):
    assert [name for name, net in board.nets.items() if len(net.pins) < 2] == []


def test_unknown_pin_is_refused():
    with pytest.raises(ValueError, match=r"R1 \(1k\) has no pin 3"):
        Board().place(RESISTORS["1k"], "R1", **{"1": "A", "3": "B"})


def far_end(board: Board, net: str, through: str) -> str:
    """The net on the other side of a part with two pins."""
    ends = [pin.net.name for pin in board.parts[through].pins]
    assert net in ends
    return next(end for end in ends if end != net)


# The ADC's pins are reached by the firmware's signals through a level shifter.
SHIFTED = {"adc_cs": "CS", "adc_sclk": "SCLK", "adc_din": "DIN", "adc_sync": "SYNC"}


def arduino_net(board: Board, signal: str) -> str | None:
    port, bit = DESCRIPTION["pins"][signal]["pin"]
    return board.net_of("A601", f"P{port}{bit}")


@pytest.mark.parametrize(("signal", "pin"), SHIFTED.items())
def test_adc_is_on_the_firmwares_pins_through_the_level_shifter(board, signal, pin):
    net = arduino_net(board, signal)
    (given,) = [p for p in board.parts["U601"].pins if p.net is not None and p.net.name == net]
    passed_on = board.net_of("U601", given.name.replace("A", "Y"))
    assert passed_on == board.net_of("U501", pin)


def test_adc_output_reaches_both_inputs_at_5_volts(board):
    assert arduino_net(board, "adc_dout") == arduino_net(board, "adc_ready")
    assert arduino_net(board, "adc_dout") == board.net_of("U602", "Y")
    assert board.net_of("U602", "A") == board.net_of("U501", "DOUT")
    # No 3.3 V part is on the wire at 5 V but those whose inputs stand it.
    on_5_volts = {pin.part.ref for pin in board.net("DOUT").pins}
    assert on_5_volts == {"A601", "U602"}


def test_self_test_reaches_the_accelerometer_and_is_pulled_down(board):
    net = arduino_net(board, "accel_self_test")
    assert net == board.net_of("U601", "2A1")
    assert far_end(board, board.net_of("U601", "2Y1"), "R304") == board.net_of("J4", "6")
    assert far_end(board, net, "R603") == "GND"
    assert far_end(board, board.net_of("J4", "6"), "R305") == "GND"


@pytest.mark.parametrize(
    ("signal", "connector", "pole", "series"),
    [
        ("crank_a", "J5", "3", "R703"),
        ("crank_b", "J5", "4", "R704"),
        ("carriage_a", "J6", "3", "R713"),
        ("carriage_b", "J6", "4", "R714"),
    ],
)
def test_encoders_are_on_the_firmwares_pins(board, signal, connector, pole, series):
    assert far_end(board, board.net_of(connector, pole), series) == arduino_net(board, signal)


@pytest.mark.parametrize(
    ("signal", "pole", "series"),
    [("drive_pwm", "1", "R721"), ("drive_enable", "2", "R722"), ("emergency_stop", "3", "R726")],
)
def test_drive_is_on_the_firmwares_pins(board, signal, pole, series):
    assert far_end(board, board.net_of("J7", pole), series) == arduino_net(board, signal)


def test_drive_is_off_while_the_mega_is_in_reset(board):
    for signal, pull_down in (("drive_pwm", "R723"), ("drive_enable", "R724")):
        assert far_end(board, arduino_net(board, signal), pull_down) == "GND"
    assert far_end(board, board.net_of("J7", "3"), "R725") == "5V"  # a broken loop reads as open


def test_usb_and_led_are_left_to_the_mega(board):
    for signal in ("host_rx", "host_tx", "led"):
        assert arduino_net(board, signal) is None


def test_every_pin_of_the_board_file_is_on_the_header(board):
    on_header = {port.removeprefix("P") for port in MEGA_PINS.values()}
    assert {pin["pin"] for pin in DESCRIPTION["pins"].values()} == on_header


def test_firmware_has_an_assertion_for_every_pin_of_the_header():
    # pins.h ties itself to board.yaml when it is compiled; here: that it leaves no pin out.
    asserted = re.findall(
        r"^ASSERT_PIN\((\w+),", (ROOT / "firmware/hal/avr/pins.h").read_text(), re.MULTILINE
    )
    assert {name.lower() for name in asserted} == DESCRIPTION["pins"].keys()


SENSOR_OF_CHANNEL = {
    # channel: connector, pole, and the part between it and the ADC's positive input
    "accel_x": ("J4", "3", "R301"),
    "accel_y": ("J4", "4", "R302"),
    "accel_z": ("J4", "5", "R303"),
}


@pytest.mark.parametrize("channel", DESCRIPTION["channels"], ids=lambda channel: channel["name"])
def test_channels_reach_their_sensors(board, channel):
    positive = board.net_of("U501", channel["positive"])
    negative = board.net_of("U501", channel["negative"])
    if channel["name"] in SENSOR_OF_CHANNEL:
        connector, pole, series = SENSOR_OF_CHANNEL[channel["name"]]
        assert far_end(board, positive, series) == board.net_of(connector, pole)
        assert negative == "GND"
    elif channel["name"] == "excitation":
        assert far_end(board, far_end(board, positive, "R403"), "R401") == "EXC10"
        assert far_end(board, "EXC10", "R401") == far_end(board, "GND", "R402")
        assert negative == "GND"
    else:
        block, connector = {"fish_pressure": (1, "J2"), "depressor_pressure": (2, "J3")}[
            channel["name"]
        ]
        amplifier = f"U{block}01"
        assert far_end(board, positive, f"R{block}06") == board.net_of(amplifier, "OUT")
        assert negative == board.net_of(amplifier, "REF") == board.net_of("U401", "OUT")
        # MPX2050: pin 2 is +Vout, 4 -Vout, 3 the supply, 1 ground; pressure makes + positive.
        plus, minus = (board.net_of(connector, pole) for pole in ("2", "4"))
        assert far_end(board, plus, f"R{block}01") == board.net_of(amplifier, "IN+")
        assert far_end(board, minus, f"R{block}02") == board.net_of(amplifier, "IN-")
        assert (board.net_of(connector, "3"), board.net_of(connector, "1")) == ("EXC10", "GND")


def test_parts_are_those_of_the_decks(board):
    for deck, parameters in DECK_PARTS.items():
        simulated = deck_parameters(deck)
        for parameter, references in parameters.items():
            for reference in references:
                value = board.kinds[reference].name.split()[0]
                assert spice_number(value) == pytest.approx(simulated[parameter]), reference
        # Every resistor and capacitor the deck names is a part (but R_out, which is the sensor's).
        named = {name for name in simulated if re.match(r"[RC]_", name)}
        assert named - {"R_out"} == parameters.keys()


def test_references_are_the_board_files_shares_of_the_excitation(board):
    ohms = power.resistances(board)
    assert {far_end(board, "REFIN1", "R404"), far_end(board, "REFIN1", "R405")} == {"EXC10", "GND"}
    refin1 = ohms("R405") / (ohms("R404") + ohms("R405"))
    assert refin1 == pytest.approx(DESCRIPTION["adc"]["refin1_per_excitation"], rel=1e-12)
    excitation = power.budget(board).excitation_volts
    ref = excitation * ohms("R407") / (ohms("R406") + ohms("R407"))
    # Where it lies exactly is of no account to the codes, since the ADC's negative input reads it,
    # too: to board.yaml's four figures.
    assert ref == pytest.approx(DESCRIPTION["channels"][0]["output_reference_volts"], rel=5e-4)
    limits = DESCRIPTION["self_test"]["limits"]["refin1_volts"]
    for sign in (-1, 1):
        refin1_volts = excitation * (1 + sign * power.LP2951_TOLERANCE) * refin1
        assert limits["minimum"] < refin1_volts < limits["maximum"]


def test_power_budget_keeps_its_limits(board):
    found = power.budget(board)
    assert found.excitation_volts == pytest.approx(10.0, rel=0.005)
    # The dividers and the LED, by hand.
    divided = 10.033 * (1 / 40e3 + 1 / 66.2e3 + 1 / 15e3 + 1 / 111.3e3)
    assert found.rail_amperes["EXC10"] == pytest.approx(0.02007 + divided, rel=1e-3)
    assert found.rail_amperes["3V3"] == pytest.approx(0.0036 + 1.3 / 220, rel=1e-3)
    assert found.least_supply_volts < power.SUPPLY_VOLTS[0]
    for regulator in power.KELVIN_PER_WATT:
        assert found.junction_c(regulator) < power.REGULATOR_MAXIMUM_C
    for rail in ("EXC10", "3V3"):
        assert found.rail_amperes[rail] < 0.1  # LP2951
    assert found.rail_amperes["5V_ENC"] < power.SWITCHER_AMPERES
    assert found.input_amperes < power.FUSE_HOLD_AMPERES
    assert found.dissipation_watts["R604"] < 0.5  # half of what it may take


def test_budget_tells_a_supply_that_is_too_low(spoiled):
    # 12 kohm in the place of 13.7: 11.28 V of excitation cannot come out of 11.4 V.
    spoiled.kinds["R803"] = RESISTORS["12k"]
    assert power.budget(spoiled).least_supply_volts > power.SUPPLY_VOLTS[0]


def test_saturated_amplifiers_harm_neither_adc_nor_its_supply(board):
    pushed = power.saturation_amperes(board)
    assert pushed < power.ADC_INPUT_AMPERES
    led = (3.3 - power.LED_VOLTS) / power.resistances(board)("R804")
    assert 2 * pushed < led  # a regulator cannot take current back


def test_bill_is_the_committed_one_and_counts_every_part(board):
    bill = bom.bill(board)
    assert bill == (HERE / "bom.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(io.StringIO(bill)))
    mounted = [r for row in rows if row["place"] == "board" for r in row["references"].split()]
    assert sorted(mounted) == sorted(board.parts)
    for row in rows:
        assert int(row["quantity"]) == len(row["references"].split()) and row["order number"]


def test_bill_has_a_plug_for_every_header_and_what_is_wired_to_it(board):
    rows = list(csv.DictReader(io.StringIO(bom.bill(board))))
    off_board = [row for row in rows if row["place"] == "off the board"]
    plugs = [row for row in off_board if row["description"].startswith("plug, ")]
    headers = [row for row in rows if row["description"].startswith("header for plug-in")]
    poles = {  # by connector: 4 of "..., 4 poles"
        kind: {
            r: row["description"].split()[-2] for row in table for r in row["references"].split()
        }
        for kind, table in (("header", headers), ("plug", plugs))
    }
    assert poles["plug"] == poles["header"] and len(poles["plug"]) == 7
    ordered = {row["order number"]: row["quantity"] for row in off_board}
    assert ordered["MPX2050GP"] == "2" and ordered["LIS3L06AL"] == "1"
    # The rigs' encoders: 4096 counts, four a line
    assert ordered["E6B2-CWZ6C 1024P/R 2M"] == "2"
    for name in ("nit_calicut_2012", "wu_chwang_2001"):
        sensors = load_rig(HERE.parents[1] / "hardware" / "rigs" / f"{name}.yaml").sensors
        for encoder in (sensors.crank_encoder, sensors.carriage_encoder):
            assert encoder.counts_per_revolution == 4 * 1024


def test_order_numbers_name_one_kind_each():
    kinds = [*RESISTORS.values(), *CAPACITORS.values()]
    assert len({kind.order_number for kind in kinds}) == len(kinds)


@pytest.mark.parametrize("command", [power, wiring])
def test_readme_states_what_the_commands_print(command):
    readme = (HERE / "README.md").read_text(encoding="utf-8")
    for block in command.tables().split("\n\n"):
        assert block in readme
