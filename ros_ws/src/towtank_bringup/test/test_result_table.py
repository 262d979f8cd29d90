# SPDX-License-Identifier: Apache-2.0
"""A trial's result in the terminal, also where there is none."""

from pathlib import Path

from towtank_bringup.result_table import print_result
from towtank_node import names, topics


def test_a_result_without_a_ratio_says_why(capsys):
    """As result.json has it when the board was reset in the log."""
    nothing = {"value": None, "phase_deg": None}
    reason = "the crank's angle is not known at 7.00 s of the window, for the board was reset"
    print_result(
        {
            "rig": "nit [2012]",
            "window": [1002.0, 1018.0],
            "amplitude_m": {
                body: {"measured": None, "u95": None, "twin": None}
                for body in ("fish", "depressor")
            },
            "heave_ratio": {"measured": nothing, "twin": nothing},
            "reasons": {"measured": reason, "twin": reason},
            "scans": {"scheduled": 1601, "received": 1550, "lost": 51, "bad": 0},
            "restarts": {names.BOARD_NODE: 2},
            "strangers": [{"node": "/gamepad", "topic": topics.DIAGNOSTICS.name}],
            "sensor_health": {},
            "encoder": {"reference_lost_s": [1009.0]},
            "bag_problem": "t/bag: the recording broke off; the bag is read as far as it goes",
            "bag_notes": ["bag_0 (1).mcap was passed over"],
        },
        Path("trials[/a]/[run3]"),
    )
    said = capsys.readouterr().out
    assert f"no heave ratio for measured: {reason}\n" in said
    assert f"{names.BOARD_NODE} had ended and was started again, 2 time(s)" in said
    assert "/gamepad, which was none of this trial's nodes, published /diagnostics too" in said
    assert "the board was reset: from 7.00 s after the log's start on, the positions of" in said
    assert "warning: t/bag: the recording broke off; the bag is read as far as it goes\n" in said
    assert "nit [2012]: heave at the crank frequency" in said
    assert "report: trials[/a]/[run3]/report.html\n" in said
    assert "note: bag_0 (1).mcap was passed over\n" in said
