# SPDX-License-Identifier: Apache-2.0
"""The `towtank` command. Every verb is a file in verbs/, imported only when it is used."""

from __future__ import annotations

import importlib
import sys

import click

from towtank_bringup.environment import EnvironmentProblem
from towtank_bringup.standard_streams import OutputError, guard_standard_streams
from towtank_bringup.stop_request import Stopped, stopping_at_once

VERBS = {
    "trial": "Record a trial and report it.",
    "compare": "Heave ratios of a recorded bag.",
    "sweep": "A study over the parameters of a rig.",
    "rig": "Work with rig files.",
    "doctor": "Look whether a connected board is well.",
    "identity": "Tell or set a board's serial number and calibration id.",
    "crank": "Drive the crank of a running trial's board.",
    "calibrate": "Calibrate a sensor, guided or from readings.",
    "inertia": "Moment of inertia from a bifilar suspension.",
    "trim": "Ballast and trim of a fish from weighings.",
    "uncertainty": "What a rig's sensors can tell: depth, pitch, heave ratio.",
    "similitude": "A rig Froude-scaled to another length.",
    "drawings": "The drawings of a rig, for the workshop.",
    "masses": "Masses, cable loads and ballast of a rig.",
    "checklist": "What a rig must read when it is brought up.",
    "bench": "Measured comparisons with other programs.",
    "test": "Run the test suite.",
}


class Verbs(click.Group):
    """Loads a verb's module only when it is called: `towtank` itself starts fast."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in VERBS:
            return None
        return importlib.import_module(f"towtank_bringup.verbs.{name}").command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(VERBS.items()))


@click.group(cls=Verbs, context_settings={"help_option_names": ["-h", "--help"]})
def towtank() -> None:
    """Towing-tank trials of a two-part underwater tow, and their simulation."""


def main() -> None:
    """Run the command; errors that a user can mend are one line and exit status 1."""
    guard_standard_streams()
    sys.exit(_run())


def _run() -> int:
    """Run the command and say in one line why it ended, if not well. Returns the exit status."""
    try:
        with stopping_at_once():
            status = towtank.main(prog_name="towtank", standalone_mode=False)
        sys.stdout.flush()
        return status
    except click.exceptions.Exit as end:
        return end.exit_code
    except click.UsageError as error:
        return _failed(error.format_message(), 2)
    except click.ClickException as error:
        return _failed(error.format_message())
    except (EnvironmentProblem, OutputError) as error:
        return _failed(str(error))
    except OSError as error:  # no room for a scratch folder, for example
        place = f"{error.filename}: " if error.filename else ""
        return _failed(f"{place}{error.strerror or error}")
    except (click.Abort, KeyboardInterrupt) as error:  # click makes the first of the second
        print("towtank: stopped", file=sys.stderr)
        return error.__cause__.status if isinstance(error.__cause__, Stopped) else 130


def _failed(why: str, status: int = 1) -> int:
    print(f"towtank: error: {why}", file=sys.stderr)
    return status


if __name__ == "__main__":
    main()
