# SPDX-License-Identifier: Apache-2.0
"""What to do about what the board refuses or tells of, by its names in board.yaml."""

from __future__ import annotations

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
"""What to do about a trip of the drive."""

CONFIGURATION_LOST = {
    "stored_older": "the board lost power while it stored a configuration: it has the one before",
    "default_damaged": "the configuration stored in the board is damaged: it has the default one",
    "default_version": "what the board has stored is of another firmware: it has the default one",
}
"""What has become of a stored configuration, by where the board has its configuration from."""

REFUSAL_ADVICE = {
    "adc_fault": "check the ADC's supply and SPI wiring",
    "does_not_fit": "lower the rate or the filter word, or scan fewer channels",
    "storage_fault": "its EEPROM is worn out or damaged; replace the microcontroller",
    "drive_turns": "stop the crank first",
    "drive_stands": "set the crank's speed again",
    "not_idle": "another program is using it; stop that, or reset the board",
}
"""What to do about a refusal, by its status."""
