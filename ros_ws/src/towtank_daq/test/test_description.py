# SPDX-License-Identifier: Apache-2.0
"""What the host takes from board.yaml."""

import math
from pathlib import Path

import pytest
from ruamel.yaml import YAML
from towtank_daq.description import DescriptionError, load_description

BOARD_YAML = Path(__file__).parents[1] / "protocol" / "board.yaml"


def written(path: Path, change) -> Path:
    """A copy of the description with `change` applied to its document."""
    yaml = YAML(typ="safe")
    document = yaml.load(BOARD_YAML.read_text(encoding="utf-8"))
    change(document)
    with path.open("w", encoding="utf-8") as file:
        yaml.dump(document, file)
    return path


def test_bridge_codes_are_ratiometric(description):
    """10 mV at the bridge: 0.4037 V of 2.5 V, bipolar, against the amplifier's own reference."""
    channel = description.adc_channel("fish_pressure", 10.0)
    code = 2**23 * (0.01 * 35.96 / 2.5 + 1)
    assert channel.volts(code) == pytest.approx(0.01, abs=1e-12)


def test_single_ended_codes(description):
    """Half of the supply, unipolar; 10 V of excitation through the 1:5 divider of 2.5 V."""
    assert description.adc_channel("accel_z", 10.0).volts(2**24 / 2) == pytest.approx(1.65)
    assert description.adc_channel("excitation", 10.0).volts(2**24 * 2 / 2.5) == pytest.approx(10.0)


def test_noise_at_the_terminals(tmp_path):
    """Behind a gain of 40: 30 µV of noise, and the steps of a bipolar code, 2 · 2.5 V / 2²⁴."""

    def change(board):
        board["channels"][0].update(gain=40.0, noise_volts=30e-6)

    board = load_description(written(tmp_path / "board.yaml", change))
    steps = 2 * 2.5 / 2**24 / math.sqrt(12)
    found = board.terminal_noise(board.channel_names[0], 10.0)
    assert found == pytest.approx(math.hypot(30e-6, steps) / 40, rel=1e-9)


def test_hash_follows_the_contents(description, tmp_path):
    same = load_description(written(tmp_path / "same.yaml", lambda board: None))
    assert same.schema_hash == description.schema_hash

    def swap(board):
        board["channels"].reverse()

    other = load_description(written(tmp_path / "other.yaml", swap))
    assert other.schema_hash != description.schema_hash


def test_incomplete_description_is_refused(tmp_path):
    def cut(board):
        del board["wire"]["baud"]

    with pytest.raises(DescriptionError, match=r"board.yaml: wire.baud: Field required"):
        load_description(written(tmp_path / "board.yaml", cut))
