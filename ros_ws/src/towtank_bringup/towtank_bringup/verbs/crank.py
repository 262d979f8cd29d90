# SPDX-License-Identifier: Apache-2.0
"""`towtank crank`: set the crank's drive from another terminal while a trial runs.

An emergency stop waits for what is imported here and below: no more than it needs.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import click
from towtank_node.quick_stop import quick_stop

from towtank_bringup.ros_domain import DomainError, domain_of_environment
from towtank_bringup.run_file import (
    RunFileError,
    RunningTrial,
    choose_trial,
    listed,
    running_trials,
)


@click.group(name="crank")
def command() -> None:
    """Drive the crank of a running trial, from another terminal.

    The trial is found by itself; of several, --trial says which. A ROS_DOMAIN_ID that is set says
    where to look, as everywhere in ROS 2. An emergency stop goes to all running trials, and to that
    domain, unless --trial names one.
    """


def _of_a_trial(function: Callable[..., Any]) -> Callable[..., Any]:
    return click.option(
        "--trial",
        "directory",
        metavar="DIR",
        type=click.Path(path_type=Path),
        help="The trial that is meant, by its directory.",
    )(function)


@command.command()
@click.argument("rpm", type=float)
@_of_a_trial
def run(rpm: float, directory: Path | None) -> None:
    """Bring the crank to RPM (5 to 60), softly."""
    from towtank_daq.crank_drive import RPM  # the driver takes its time to import

    _ask_one(directory, "RUN", rpm * RPM)


@command.command()
@_of_a_trial
def stop(directory: Path | None) -> None:
    """Bring the crank to rest, softly."""
    _ask_one(directory, "STOP")


@command.command(name="emergency-stop")
@_of_a_trial
def emergency_stop(directory: Path | None) -> None:
    """Take the motor's power at once; the trip must be cleared."""
    trials = running_trials()
    try:
        wanted, besides = emergency_domains(trials, directory, _domain_besides(trials))
    except (RunFileError, DomainError) as error:
        raise click.ClickException(f"{error}. {_OUTSIDE}") from error
    # Past ROS first. What that does not reach, a node of an older program say, gets the call.
    left = _not_stopped_quickly([*wanted, *besides])
    refusals = {}
    if set(left) & set(wanted):
        from towtank_bringup.crank_call import CrankCalls

        with CrankCalls(left) as calls:
            refusals = calls.ask("EMERGENCY_STOP", insistent=[d for d in left if d in wanted])
    for domain in wanted:
        if domain not in refusals:
            click.echo(f"emergency stop: {_name(trials, domain)}", err=True)
    told = [why for domain, why in refusals.items() if domain in wanted]
    if told:
        raise click.ClickException(f"{'; '.join(told)}. {_OUTSIDE}")


def _not_stopped_quickly(domains: list[int]) -> list[int]:
    """All at the same time: a node that hangs must not keep the others waiting."""
    with ThreadPoolExecutor(max(1, len(domains))) as pool:
        answers = pool.map(quick_stop, domains)
        return [domain for domain, why in zip(domains, answers, strict=True) if why != ""]


_OUTSIDE = "Use the emergency-stop button"


@command.command()
@_of_a_trial
def clear(directory: Path | None) -> None:
    """Clear a trip; the crank stays at rest."""
    _ask_one(directory, "CLEAR_TRIP")


def one_domain(trials: list[RunningTrial], directory: Path | None, domain_set: int | None) -> int:
    """Where to ask one drive. Raises RunFileError where it is not clear which.

    A domain that is set is taken even if no known trial is in it: a graph that was started by hand
    has no run file.
    """
    if directory is None and domain_set is not None:
        return domain_set
    return choose_trial(trials, directory).domain


def emergency_domains(
    trials: list[RunningTrial], directory: Path | None, domain_set: int | None
) -> tuple[list[int], list[int]]:
    """Where an emergency stop must, and where it besides may find a drive.

    Nobody who needs one has the time to choose: all that is known is stopped. Raises RunFileError
    where nothing is known.
    """
    if directory is not None:
        return [choose_trial(trials, directory).domain], []
    wanted = list(dict.fromkeys(trial.domain for trial in trials))
    if not wanted and domain_set is None:
        choose_trial(trials)  # which says that there is none
    set_one = [] if domain_set is None or domain_set in wanted else [domain_set]
    return (wanted, set_one) if wanted else (set_one, [])


def _domain_besides(trials: list[RunningTrial]) -> int | None:
    """The domain that is set. One that there is not must keep no stop from the trials known."""
    try:
        return domain_of_environment()
    except DomainError:
        if trials:
            return None
        raise


def _ask_one(directory: Path | None, action: str, crank_rate: float = 0.0) -> None:
    from towtank_bringup.crank_call import CrankCalls

    trials = running_trials()
    try:
        domain = one_domain(trials, directory, domain_of_environment())
    except (RunFileError, DomainError) as error:
        raise click.ClickException(str(error)) from error
    with CrankCalls([domain]) as calls:
        refusals = calls.ask(action, crank_rate)
    if refusals:
        elsewhere = [trial for trial in trials if trial.domain != domain]
        remedy = ""
        if elsewhere and directory is None:
            remedy = (
                f". ROS_DOMAIN_ID is {domain}, but trials run elsewhere (unset it, or say which "
                f"with --trial DIR): {listed(elsewhere)}"
            )
        raise click.ClickException(refusals[domain] + remedy)


def _name(trials: list[RunningTrial], domain: int) -> str:
    return listed([trial for trial in trials if trial.domain == domain]) or f"ROS domain {domain}"
