# SPDX-License-Identifier: Apache-2.0
"""The kinds of part on the board and at its connectors: pins, maker, order number, footprint.

Where KiCad's own libraries have a part's symbol or footprint, the tests hold pins and pads against
them. `source` says what else a part's pins and limits were held against. Order numbers are from
memory of the makers' documents: look them up before an order.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Kind:
    """A kind of part.

    pins: (number, name, type); types are `in`, `out`, `tri` (an output that can let go), `power`
    (takes a supply), `supply` (gives one), `passive` and `free` (may stay open).
    footprint, symbol: of KiCad's libraries, "library:name"; no symbol if they have none.
    symbol_names: (pin's name here, in the symbol), where they differ; ~ is a pin without a name.
    pads: (pin's number, its pads), where the footprint numbers them otherwise.
    source: where pins and limits come from, beside KiCad's libraries.
    """

    name: str
    maker: str
    order_number: str
    description: str
    pins: tuple[tuple[str, str, str], ...]
    footprint: str = ""
    symbol: str = ""
    symbol_names: tuple[tuple[str, str], ...] = ()
    pads: tuple[tuple[str, tuple[str, ...]], ...] = ()
    source: str = ""

    def pads_of(self, number: str) -> tuple[str, ...]:
        """The footprint's pads of a pin; none where the pin is not brought to the board."""
        return dict(self.pads).get(number, ()) if self.pads else (number,)


_METRIC = {"0603": "0603_1608Metric", "1206": "1206_3216Metric", "2512": "2512_6332Metric"}


def _resistor(value: str, order_number: str, tolerance: str, size: str = "0603") -> Kind:
    return Kind(
        value,
        "Susumu" if order_number.startswith("RG") else "Yageo",
        order_number,
        f"resistor {size}, {tolerance}",
        _TWO,
        footprint=f"Resistor_SMD:R_{_METRIC[size]}",
        symbol="Device:R",
        symbol_names=_NAMELESS,
    )


def _capacitor(
    value: str, maker: str, order_number: str, description: str, footprint: str, symbol: str = "C"
) -> Kind:
    return Kind(
        value,
        maker,
        order_number,
        f"capacitor, {description}",
        _TWO,
        footprint=footprint,
        symbol=f"Device:{symbol}",
        symbol_names=_NAMELESS,
    )


def _ceramic(value: str, order_number: str, description: str, size: str = "0603") -> Kind:
    footprint = f"Capacitor_SMD:C_{_METRIC[size]}"
    return _capacitor(value, "Murata", order_number, description, footprint)


def _terminals(poles: int, order_number: str) -> Kind:
    numbers = [str(n) for n in range(1, poles + 1)]
    return Kind(
        f"MC 1,5/{poles}-G-3,81",
        "Phoenix Contact",
        order_number,
        f"header for plug-in terminals, {poles} poles",
        tuple((n, n, "passive") for n in numbers),
        footprint="Connector_Phoenix_MC:"
        f"PhoenixContact_MC_1,5_{poles}-G-3.81_1x0{poles}_P3.81mm_Horizontal",
        symbol=f"Connector_Generic:Conn_01x0{poles}",
        symbol_names=tuple((n, f"Pin_{n}") for n in numbers),
    )


_TWO = (("1", "1", "passive"), ("2", "2", "passive"))
_NAMELESS = (("1", "~"), ("2", "~"))

RESISTORS = {
    kind.name: kind
    for kind in (
        _resistor("1.43k", "RG1608P-1431-B-T5", "0.1 %, 25 ppm/K"),
        _resistor("3k", "RG1608P-302-B-T5", "0.1 %, 25 ppm/K"),
        _resistor("10k", "RG1608P-103-B-T5", "0.1 %, 25 ppm/K"),
        _resistor("12k", "RG1608P-123-B-T5", "0.1 %, 25 ppm/K"),
        _resistor("13.7k", "RG1608P-1372-B-T5", "0.1 %, 25 ppm/K"),
        _resistor("30k", "RG1608P-303-B-T5", "0.1 %, 25 ppm/K"),
        _resistor("56.2k", "RG1608P-5622-B-T5", "0.1 %, 25 ppm/K"),
        _resistor("97.6k", "RG1608P-9762-B-T5", "0.1 %, 25 ppm/K"),
        _resistor("220", "RC0603FR-07220RL", "1 %"),
        _resistor("499", "RC0603FR-07499RL", "1 %"),
        _resistor("1k", "RC0603FR-071KL", "1 %"),
        _resistor("1.5k", "RC0603FR-071K5L", "1 %"),
        _resistor("2.2k", "RC0603FR-072K2L", "1 %"),
        _resistor("3.9k", "RC0603FR-073K9L", "1 %"),
        _resistor("100k", "RC0603FR-07100KL", "1 %"),
        _resistor("10meg", "RC0603FR-0710ML", "1 %"),
        _resistor("27", "RC2512FK-0727RL", "1 %, 1 W", size="2512"),
    )
}

CAPACITORS = {
    kind.name: kind
    for kind in (
        _ceramic("1n", "GRM1885C1H102JA01D", "C0G 0603, 5 %, 50 V"),
        _ceramic("2.2n", "GRM1885C1H222JA01D", "C0G 0603, 5 %, 50 V"),
        _ceramic("10n", "GRM1885C1H103JA01D", "C0G 0603, 5 %, 50 V"),
        _ceramic("100n C0G", "GRM31C5C1H104JA01L", "C0G 1206, 5 %, 50 V", size="1206"),
        _ceramic("100n", "GRM188R71H104KA93D", "X7R 0603, 10 %, 50 V"),
        _capacitor(
            "1u film",
            "WIMA",
            "MKS2C041001F00JSSD",
            "polyester film, 5 %, 63 V",
            "Capacitor_THT:C_Rect_L7.2mm_W4.5mm_P5.00mm_FKS2_FKP2_MKS2_MKP2",
        ),
        _ceramic("10u", "GRM31CR61E106KA12L", "X5R 1206, 10 %, 25 V", size="1206"),
        _capacitor(
            "10u tantalum",
            "Kemet",
            "T491B106K025AT",
            "tantalum B, 10 %, 25 V",
            "Capacitor_Tantalum_SMD:CP_EIA-3528-21_Kemet-B",
            symbol="C_Polarized",
        ),
        _capacitor(
            "100u",
            "Panasonic",
            "EEE-FK1V101P",
            "electrolytic, 20 %, 35 V",
            "Capacitor_SMD:CP_Elec_8x10",
            symbol="C_Polarized",
        ),
    )
}

AD7124 = Kind(
    "AD7124-8",
    "Analog Devices",
    "AD7124-8BCPZ",
    "24-bit sigma-delta ADC, LFCSP-32",
    (
        ("1", "REGCAPD", "passive"),
        ("2", "IOVDD", "power"),
        ("3", "DGND", "power"),
        *((str(4 + n), f"AIN{n}", "in") for n in range(8)),
        ("12", "REFIN1+", "in"),
        ("13", "REFIN1-", "in"),
        *((str(14 + n), f"AIN{8 + n}", "in") for n in range(8)),
        ("22", "REFOUT", "passive"),
        ("23", "AVSS", "power"),
        ("24", "REGCAPA", "passive"),
        ("25", "PSW", "free"),
        ("26", "AVDD", "power"),
        ("27", "SYNC", "in"),
        ("28", "DOUT", "tri"),
        ("29", "DIN", "in"),
        ("30", "SCLK", "in"),
        ("31", "CLK", "free"),
        ("32", "CS", "in"),
        ("33", "EP", "power"),
    ),
    footprint="Package_CSP:LFCSP-32-1EP_5x5mm_P0.5mm_EP3.6x3.6mm",
    source="All pins and the footprint: agree with a published KiCad symbol of others, made from "
    "the data sheet for another board; limits: a published review against its revision F",
)
INA128 = Kind(
    "INA128",
    "Texas Instruments",
    "INA128U",
    "instrumentation amplifier, SOIC-8",
    (
        ("1", "RG1", "passive"),
        ("2", "IN-", "in"),
        ("3", "IN+", "in"),
        ("4", "V-", "power"),
        ("5", "REF", "in"),
        ("6", "OUT", "out"),
        ("7", "V+", "power"),
        ("8", "RG2", "passive"),
    ),
    footprint="Package_SO:SOIC-8_3.9x4.9mm_P1.27mm",
    symbol="Amplifier_Instrumentation:INA128",
    symbol_names=(
        *(("RG1", "Rg"), ("RG2", "Rg"), ("IN-", "-"), ("IN+", "+")),
        *(("REF", "Ref"), ("OUT", "~")),
    ),
    source="SBOS051: gain error, offset, noise, input range; output swing from memory of it",
)
OPA333 = Kind(
    "OPA333",
    "Texas Instruments",
    "OPA333AIDBVR",
    "operational amplifier, 10 µV, SOT-23-5",
    (
        ("1", "OUT", "out"),
        ("2", "V-", "power"),
        ("3", "IN+", "in"),
        ("4", "IN-", "in"),
        ("5", "V+", "power"),
    ),
    footprint="Package_TO_SOT_SMD:SOT-23-5",
    symbol="Amplifier_Operational:OPA333xxDBV",
    symbol_names=(("OUT", "~"), ("IN+", "+"), ("IN-", "-")),
)


def _lp2951(name: str, order_number: str, description: str, tap: tuple[str, str]) -> Kind:
    sense, output = tap  # of SENSE and TAP, which only the fixed voltage uses
    pins = (
        ("1", "OUT", "supply"),
        ("2", "SENSE", sense),
        ("3", "SHUTDOWN", "in"),
        ("4", "GND", "power"),
        ("5", "ERROR", "free"),
        ("6", "TAP", output),
        ("7", "FB", "in"),
        ("8", "IN", "power"),
    )
    return Kind(
        name,
        "Texas Instruments",
        order_number,
        description,
        pins,
        footprint="Package_SO:SOIC-8_3.9x4.9mm_P1.27mm",
        symbol="Regulator_Linear:LP2951-3.3_SOIC",
        symbol_names=(("ERROR", "~{ERROR}"), ("TAP", "VTAP"), ("FB", "FEEDBACK")),
        source="Another maker's LP2951 data sheet: absolute limits, 160 K/W",
    )


LP2951 = _lp2951(
    "LP2951", "LP2951ACM/NOPB", "adjustable regulator, 100 mA, SOIC-8", ("free", "free")
)
LP2951_33 = _lp2951(
    "LP2951-3.3", "LP2951ACM-3.3/NOPB", "3.3 V regulator, 100 mA, SOIC-8", ("in", "out")
)
R78E5 = Kind(
    "R-78E5.0-0.5",
    "RECOM",
    "R-78E5.0-0.5",
    "5 V switching regulator, 500 mA",
    (("1", "IN", "power"), ("2", "GND", "power"), ("3", "OUT", "supply")),
    footprint="Converter_DCDC:Converter_DCDC_RECOM_R-78E-0.5_THT",
    symbol="Regulator_Switching:R-78E5.0-0.5",
)
_FOUR = range(1, 5)
LVC244 = Kind(
    "74LVC244A",
    "Texas Instruments",
    "SN74LVC244APWR",
    "eight buffers, inputs stand 5 V at any supply, TSSOP-20",
    (
        ("1", "1OE", "in"),
        *zip(("2", "4", "6", "8"), ("1A1", "1A2", "1A3", "1A4"), ("in",) * 4, strict=True),
        *zip(("18", "16", "14", "12"), ("1Y1", "1Y2", "1Y3", "1Y4"), ("out",) * 4, strict=True),
        ("19", "2OE", "in"),
        *zip(("11", "13", "15", "17"), ("2A1", "2A2", "2A3", "2A4"), ("in",) * 4, strict=True),
        ("9", "2Y1", "out"),
        *zip(("7", "5", "3"), ("2Y2", "2Y3", "2Y4"), ("free",) * 3, strict=True),
        ("10", "GND", "power"),
        ("20", "VCC", "power"),
    ),
    footprint="Package_SO:TSSOP-20_4.4x6.5mm_P0.65mm",
    # KiCad's symbol counts as other makers do: from 0, and the second half from its other end.
    symbol="74xx:74HC244",
    symbol_names=(
        *((f"1{side}{n}", f"1{side}{n - 1}") for side in "AY" for n in _FOUR),
        *((f"2{side}{n}", f"2{side}{4 - n}") for side in "AY" for n in _FOUR),
    ),
)
AHCT125 = Kind(
    "74AHCT1G125",
    "Texas Instruments",
    "SN74AHCT1G125DBVR",
    "buffer with TTL thresholds, SOT-23-5",
    (
        ("1", "OE", "in"),
        ("2", "A", "in"),
        ("3", "GND", "power"),
        ("4", "Y", "out"),
        ("5", "VCC", "power"),
    ),
    footprint="Package_TO_SOT_SMD:SOT-23-5",
    symbol="74xGxx:74AHCT1G125",
    symbol_names=(("OE", "~"), ("A", "~"), ("Y", "~")),
)
# Arduino's pin is the number, the ATmega2560's the name.
MEGA_PINS = {
    "0": "PE0",
    "1": "PE1",
    "2": "PE4",
    "6": "PH3",
    "7": "PH4",
    "8": "PH5",
    "13": "PB7",
    "18": "PD3",
    "19": "PD2",
    "20": "PD1",
    "21": "PD0",
    "48": "PL1",
    "49": "PL0",
    "50": "PB3",
    "51": "PB2",
    "52": "PB1",
    "53": "PB0",
}
_MEGA_OUTPUTS = ("6", "7", "48", "49", "51", "52", "53")
_MEGA_FREE = ("0", "1", "13")  # wired on the Mega itself: USB bridge and LED
# The header by which the Mega is wired to the board, pad by pad; between the two rows of a ribbon a
# ground stands beside what is fast.
_MEGA_HEADER = (
    *("VIN", "GND", "5V", "GND", "52", "2", "51", "21", "50", "GND"),
    *("53", "20", "49", "19", "48", "18", "6", "8", "7", "GND"),
)
_MEGA_PADS = {
    pin: tuple(str(pad) for pad, at in enumerate(_MEGA_HEADER, start=1) if at == pin)
    for pin in dict.fromkeys(_MEGA_HEADER)
}
MEGA = Kind(
    "Arduino Mega 2560",
    "Arduino",
    "A000067",
    "microcontroller board, ATmega2560, host over USB",
    (
        ("VIN", "VIN", "power"),
        ("GND", "GND", "power"),
        ("5V", "5V", "supply"),
        *(
            (n, port, "free" if n in _MEGA_FREE else "out" if n in _MEGA_OUTPUTS else "in")
            for n, port in MEGA_PINS.items()
        ),
    ),
    # Not soldered on: a header of 2 x 10 poles, from which short wires or a ribbon go to it.
    footprint="Connector_PinHeader_2.54mm:PinHeader_2x10_P2.54mm_Vertical",
    symbol="Connector_Generic:Conn_02x10_Odd_Even",
    pads=tuple(_MEGA_PADS.items()),
    source="Arduino's pin mapping of the ATmega2560, which the firmware's pins.h is held against",
)
PFET = Kind(
    "IRLML9301",
    "Infineon",
    "IRLML9301TRPBF",
    "p-channel FET, 30 V, 64 mΩ, SOT-23",
    (("1", "G", "passive"), ("2", "S", "passive"), ("3", "D", "passive")),
    footprint="Package_TO_SOT_SMD:SOT-23",
    symbol="Transistor_FET:IRLML9301",
)
ZENER = Kind(
    "BZX84-C12",
    "Nexperia",
    "BZX84-C12,215",
    "zener diode 12 V, SOT-23",
    (("1", "A", "passive"), ("3", "K", "passive")),
    footprint="Package_TO_SOT_SMD:SOT-23",
    symbol="Diode:BZX84Cxx",
)
CLAMP = Kind(
    "BAT54S",
    "Nexperia",
    "BAT54S,215",
    "two Schottky diodes in series, 200 mA, SOT-23",
    (("1", "A", "passive"), ("2", "K", "passive"), ("3", "COM", "passive")),
    footprint="Package_TO_SOT_SMD:SOT-23",
    symbol="Diode:BAT54S",
    symbol_names=(("A", "~"), ("K", "~"), ("COM", "~")),
)
TVS = Kind(
    "SMBJ14A",
    "Littelfuse",
    "SMBJ14A",
    "surge suppressor, 14 V stand-off",
    (("1", "K", "passive"), ("2", "A", "passive")),
    footprint="Diode_SMD:D_SMB",
    symbol="Device:D_Zener",
)
FUSE = Kind(
    "MF-MSMF075/24",
    "Bourns",
    "MF-MSMF075/24-2",
    "resettable fuse, 0.75 A, 24 V",
    _TWO,
    footprint="Fuse:Fuse_1812_4532Metric",
    symbol="Device:Fuse",
    symbol_names=_NAMELESS,
)
LED = Kind(
    "green LED",
    "Kingbright",
    "APT1608SGC",
    "LED 0603, green",
    (("1", "K", "passive"), ("2", "A", "passive")),
    footprint="LED_SMD:LED_0603_1608Metric",
    symbol="Device:LED",
)
POWER_INLET = Kind(
    "MSTBA 2,5/2-G-5,08",
    "Phoenix Contact",
    "1757242",
    "header for plug-in terminals, 2 poles",
    (("1", "1", "supply"), ("2", "2", "supply")),
    footprint="Connector_Phoenix_MSTB:PhoenixContact_MSTBA_2,5_2-G-5,08_1x02_P5.08mm_Horizontal",
    symbol="Connector_Generic:Conn_01x02",
    symbol_names=(("1", "Pin_1"), ("2", "Pin_2")),
)
TERMINALS = {4: _terminals(4, "1803293"), 6: _terminals(6, "1803316")}


def _off_board(name: str, maker: str, order_number: str, description: str) -> Kind:
    return Kind(name, maker, order_number, description, ())


def _plug(name: str, order_number: str, poles: int) -> Kind:
    return _off_board(
        name, "Phoenix Contact", order_number, f"plug, screw terminals, {poles} poles"
    )


_PLUG_4 = _plug("MC 1,5/4-ST-3,81", "1803594", 4)
_MPX2050 = _off_board(
    "MPX2050", "NXP", "MPX2050GP", "pressure sensor, 0 to 50 kPa gauge, one port at the side of P1"
)
_LIS3L06AL = _off_board(
    "LIS3L06AL", "STMicroelectronics", "LIS3L06AL", "accelerometer, three axes, analog, LGA-8"
)
_ENCODER = _off_board(
    "E6B2-CWZ6C",
    "Omron",
    "E6B2-CWZ6C 1024P/R 2M",
    "encoder, 1024 lines, 5 to 24 V, open collectors, cable of 2 m",
)

_MEGA_PINS_HEADER = _off_board(
    "header 2x10",
    "Würth Elektronik",
    "61302021121",
    "pin header 2.54 mm, 2 x 10, soldered in the place of A601, for the wires to the Mega",
)

_DRIVER = _off_board(
    "VNH5019",
    "Pololu",
    "1451",
    "motor driver VNH5019A-E on a carrier, 5.5 to 24 V, 12 A, 30 A for a short time",
)
_DRIVER_PULL_DOWN = _off_board(
    "10k 0.25 W",
    "Yageo",
    "MFR-25FBF52-10K",
    "resistor with leads, two: from the driver's PWM and INA to its GND",
)

# What is plugged into each connector, and what is at the other end of the cable.
OFF_BOARD: dict[str, tuple[Kind, ...]] = {
    "A601": (_MEGA_PINS_HEADER,),
    "J1": (_plug("MSTB 2,5/2-ST-5,08", "1757019", 2),),
    "J2": (_PLUG_4, _MPX2050),
    "J3": (_PLUG_4, _MPX2050),
    "J4": (_plug("MC 1,5/6-ST-3,81", "1803617", 6), _LIS3L06AL),
    "J5": (_PLUG_4, _ENCODER),
    "J6": (_PLUG_4, _ENCODER),
    "J7": (_PLUG_4, _DRIVER, _DRIVER_PULL_DOWN),
}
