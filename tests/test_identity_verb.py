# SPDX-License-Identifier: Apache-2.0
"""`towtank identity` on the virtual board's port."""

from __future__ import annotations

from click.testing import CliRunner, Result
from towtank_bringup.cli import towtank
from towtank_bringup.rigs import rig_path
from towtank_bringup.virtual_station import virtual_station
from towtank_rig import load_rig


def test_a_board_gets_its_numbers_and_tells_them():
    rig_file = rig_path("nit_calicut_2012")
    with virtual_station(load_rig(rig_file), rig_file, seed=1) as (port, _):

        def identity(*arguments: object) -> Result:
            words = ["identity", "--port", str(port), *map(str, arguments)]
            return CliRunner().invoke(towtank, words)

        assert "has no serial number and calibration id: write it" in identity().output
        lacking = identity("--serial", 17)
        assert lacking.exit_code == 1 and "give both --serial and --calibration" in lacking.output
        written = identity("--serial", 17, "--calibration", 3)
        assert written.exit_code == 0, written.output
        assert written.output == "serial number 17, calibration id 3\n"
        assert identity("--calibration", 4).output == "serial number 17, calibration id 4\n"
        assert identity("--serial", 2**32 - 1).exit_code == 2
