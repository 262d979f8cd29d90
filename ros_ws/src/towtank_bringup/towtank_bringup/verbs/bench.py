# SPDX-License-Identifier: Apache-2.0
"""`towtank bench`: long runs, and measured comparisons with other programs, in the source tree."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import click

from towtank_bringup.source_tree import source_tree


@click.group(name="bench")
def command() -> None:
    """Long runs, and comparisons with other programs (on first use installed into build/)."""


@command.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def sim(as_json: bool) -> None:
    """Speed of the simulation core beside MoorDyn, CableDyn and a dense solver, on one core."""
    run_with_peers("sim.py", *(["--json"] if as_json else []))


@command.command()
@click.option("--write", is_flag=True, help="Keep MoorDyn's results for sim_core's tests.")
def agreement(write: bool) -> None:
    """Ten random two-part tows in the simulation core and in MoorDyn."""
    run_with_peers("agreement.py", *(["--write"] if write else []))


@command.command()
@click.option("--hours", type=click.FloatRange(min=0.005), default=2.0, show_default=True)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def soak(hours: float, as_json: bool) -> None:
    """Hours of board time without the clock: firmware, virtual board and driver; every scan is
    accounted for. From 1.8 hours on whatever counts on passes its end three times or more."""
    source = source_tree("the benchmarks")
    run(source, "soak.py", [], "--hours", str(hours), *(["--json"] if as_json else []))


@command.command()
@click.option("--seconds", type=click.FloatRange(min=5.0), default=30.0, show_default=True)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def cpu(seconds: float, as_json: bool) -> None:
    """Processor time of acquisition at 100 and at 200 scans a second. Leave the machine alone."""
    source = source_tree("the benchmarks")
    run(source, "cpu.py", [], "--seconds", str(seconds), *(["--json"] if as_json else []))


@command.command()
@click.option("--rig", "rigs", multiple=True, help="Rig file, or name of one; may be repeated.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def settling(rigs: tuple[str, ...], as_json: bool) -> None:
    """What the swing that a start leaves costs the heave ratio, by settling time and log."""
    wishes = [f"--rig={rig}" for rig in rigs]
    run(source_tree("the benchmarks"), "settling.py", [], *wishes, *(["--json"] if as_json else []))


@command.command()
@click.option("--draws", type=click.IntRange(min=1), default=1000, show_default=True)
@click.option("--segments", type=click.IntRange(min=0), default=0, help="0: the rig file's own.")
@click.option("--seed", type=int, default=1, show_default=True)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def starts(draws: int, segments: int, seed: int, as_json: bool) -> None:
    """Steady tows of rigs drawn from all that the rig files leave open, at rest and under way."""
    wishes = [f"--draws={draws}", f"--segments={segments}", f"--seed={seed}"]
    run(source_tree("the benchmarks"), "starts.py", [], *wishes, *(["--json"] if as_json else []))


@command.command()
@click.option("--rig", "rigs", multiple=True, help="Rig file, or name of one; may be repeated.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def segments(rigs: tuple[str, ...], as_json: bool) -> None:
    """What the number of segments costs the simulated heave ratio, and takes of the processor."""
    wishes = [f"--rig={rig}" for rig in rigs]
    run(source_tree("the benchmarks"), "segments.py", [], *wishes, *(["--json"] if as_json else []))


@command.command("bag-fuzz")
@click.option("--cases", type=click.IntRange(min=1), default=10_000, show_default=True)
@click.option("--seed", type=int, default=1, show_default=True)
@click.option("--only", type=click.IntRange(min=0), help="One case by its number, and its text.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def bag_fuzz(cases: int, seed: int, only: int | None, as_json: bool) -> None:
    """Damaged bags by the thousand, on all cores: each gives the right result, or says what is
    lost, or one line why there is none."""
    wishes = [f"--cases={cases}", f"--seed={seed}"]
    wishes += [] if only is None else [f"--only={only}"]
    run(source_tree("the benchmarks"), "bag_fuzz.py", [], *wishes, *(["--json"] if as_json else []))


@command.command()
@click.option("--seconds", type=click.FloatRange(min=2.0), default=20.0, show_default=True)
@click.option(
    "--folder",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    default=Path("."),
    help="On the disk that is meant; a scratch folder is made in it.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def disk(seconds: float, folder: Path, as_json: bool) -> None:
    """What it costs to force a bag to the disk twice a second, and what a power cut would lose."""
    source = source_tree("the benchmarks")
    where = ["--seconds", str(seconds), "--folder", str(folder.absolute())]
    run(source, "disk.py", [], *where, *(["--json"] if as_json else []))


@command.command("drive-faults")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def drive_faults(as_json: bool) -> None:
    """Every fault of the crank's drive in every state, on the virtual board: what is seen, and its
    bound. Without the clock; about a minute."""
    source = source_tree("the benchmarks")
    run(source, "drive_faults.py", [], *(["--json"] if as_json else []))


def run_with_peers(program: str, *arguments: str) -> None:
    """Runs a program of tests/benchmarks with the other simulators on its path."""
    source = source_tree("the benchmarks")
    run(source, program, [install_peers(source), source / "sim_core" / "tests"], *arguments)


def run(source: Path, program: str, paths: list[Path], *arguments: str) -> None:
    """Runs a program of tests/benchmarks with these folders on its path."""
    searched = [*paths, os.environ.get("PYTHONPATH")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(str(p) for p in searched if p)}
    status = subprocess.run(
        [sys.executable, source / "tests" / "benchmarks" / program, *arguments],
        env=environment,
        check=False,
    ).returncode
    if status:
        raise click.ClickException(f"the benchmark failed: {program}")


def install_peers(source: Path) -> Path:
    """The folder with the other simulators, which only the benchmarks need."""
    lock = source / "requirements" / "benchmarks.lock"
    peers = source / "build" / "benchmarks"
    installed = peers / lock.name  # the lock that the folder was made from
    if not installed.exists() or installed.read_bytes() != lock.read_bytes():
        click.echo("towtank: installing the other simulators ...", err=True)
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--upgrade"]
        options = ["--no-deps", "--require-hashes", "--target", peers, "-r", lock]
        if subprocess.run([*pip, *options], check=False).returncode:
            raise click.ClickException(f"pip could not install {lock.name}: see above")
        installed.write_bytes(lock.read_bytes())
    return peers
