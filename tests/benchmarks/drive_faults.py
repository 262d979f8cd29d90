# SPDX-License-Identifier: Apache-2.0
"""Every fault of the crank's drive in every state: `towtank bench drive-faults`.

The real firmware on the virtual board, without a clock. A board is brought into a state once, and
the process forks for each fault, so that every fault strikes the same board at the same instant.
What was seen stands beside its bound (drive_bounds.py).
"""

from __future__ import annotations

import json
import math
import multiprocessing
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import click
import yaml

sys.path.append(str(Path(__file__).resolve().parents[1]))

from drive_bounds import RPM, Motor, Rules
from driven_crank import ELF, PROTOCOL, ROOT, Rig
from towtank_daq.protocol_records import DriveAction, DriveArguments, drive
from vboard import Disturbance, ResetCause, VirtualBoard, nominal_motor
from virtual_line import COUNTS

FULL_RPM, SLOW_RPM, SLIP, DRIVEN_N_M = 60.0, 5.0, 0.5, 10.0
STATES = ("at rest", "starting", "running up", "running", "stopping", "tripped")
WITHOUT_POWER = ("at rest", "tripped")
_LONGEST_S = 9.0


def read_rules() -> Rules:
    """The drive's rules, from board.yaml."""
    board = yaml.safe_load((ROOT / "firmware" / "protocol" / "board.yaml").read_text())
    drive = board["drive"]
    step_s = 1.0 / drive["control_hz"]
    same = {name: drive[name] for name in Rules.__dataclass_fields__ if name in drive}
    return Rules(
        **same,
        step_s=step_s,
        window_s=drive["speed_window_steps"] * step_s,
        ceiling_standing=drive["ceiling_duty"]["standing"],
        ceiling_per_rpm=drive["ceiling_duty"]["per_rpm"],
        pwm_s=1.0 / drive["pwm_hz"],
        watchdog_s=board["microcontroller"]["watchdog_s"],
    )


RULES, MOTOR = read_rules(), Motor(**nominal_motor())


# ---------------------------------------------------------------------------------- the states


def reach(state: str) -> Rig:
    """A board in a state, its crank under the tow; a start is without it, which is worse."""
    board = VirtualBoard(ELF, seed=5, crank_counts_per_revolution=COUNTS, crank_motor={})
    rig = Rig(board)
    if state == "at rest":
        rig.run(SLOW_RPM, 2.0)
        rig.driver.drive("stop")
        rig.wait(3.0)
    elif state == "starting":
        board.set_faults(tow_parted=True)
        rig.run(SLOW_RPM, 0.1)
    elif state == "running up":
        rig.run(FULL_RPM, 2.5)
    else:
        rig.run(FULL_RPM, 8.0)  # to where the tow's weight takes much duty
    if state == "stopping":
        rig.driver.drive("stop")
        rig.wait(0.2)
    elif state == "tripped":
        rig.driver.drive("emergency_stop")
        rig.wait(0.1)
    return rig


@dataclass(frozen=True)
class Situation:
    """A state at the instant of the fault."""

    state: str
    setpoint_rpm: float
    rpm: float
    duty: float

    @property
    def powered(self) -> bool:
        return self.state not in WITHOUT_POWER

    @property
    def wanted_rpm(self) -> float:
        """The highest setpoint from now on."""
        wanted = {"starting": SLOW_RPM, "running up": FULL_RPM, "running": FULL_RPM}
        return wanted.get(self.state, self.setpoint_rpm)

    @property
    def undisturbed(self) -> str:
        """How the state ends if nothing is amiss."""
        return {"at rest": "stopped", "stopping": "stopped", "tripped": "emergency_stop"}.get(
            self.state, "running"
        )


# ---------------------------------------------------------------------------------- the bounds


@dataclass(frozen=True)
class Bound:
    """The most that is allowed after the fault; `ends` names what it must end as: a trip, or a
    state without one. None where nothing is asked for."""

    ends: tuple[str, ...]
    off_s: float | None
    rpm: float | None
    turns: float | None = None
    duty: float = 1.0
    told_s: float | None = None
    reset_cause: str = ""
    loop_open: bool = False


def at_rest(at: Situation, ends: str = "", reset_cause: str = "") -> Bound:
    """The motor gets no power, whatever happens; at most the crank coasts on."""
    rpm, turns = MOTOR.runaway(at.rpm, [])
    return Bound((ends or at.undisturbed,), 0.0, rpm, turns, 0.0, reset_cause=reset_cause)


def unaffected(at: Situation) -> Bound:
    """An overspeed would trip: no faster, but for what is not yet measured."""
    if not at.powered:
        return at_rest(at)
    stop_s = RULES.stop(at.setpoint_rpm) if at.state == "stopping" else None
    return Bound((at.undisturbed,), stop_s, at.wanted_rpm + 1.25 * RULES.overspeed_rpm)


def without_word(at: Situation, *trips: str, jammed: bool = False) -> Bound:
    """The encoder tells nothing of use, or the crank stands: the ceiling of standstill, then off.

    A control step may still have seen part of a movement.
    """
    if not at.powered:
        return unaffected(at)
    starting = at.state == "starting"
    off_s = RULES.start_s + 2 * RULES.step_s if starting else RULES.stall(at.setpoint_rpm)
    standing = RULES.ceiling_standing
    if starting:
        duty = standing
    elif at.state == "stopping":
        duty = at.duty
    else:
        duty = max(at.duty, RULES.ceiling(at.rpm * 1.1))
    seen_s = min(2 * RULES.step_s, off_s)
    rpm, turns = MOTOR.runaway(at.rpm, [(seen_s, duty), (off_s - seen_s, standing)])
    if jammed:
        rpm, turns = at.rpm, 0.0
    return Bound(trips, off_s, rpm, turns, duty)


def slipping(at: Situation) -> Bound:
    """What the encoder sees is held, or trips; the crank is faster by what it does not see."""
    fine = unaffected(at)
    if not at.powered:
        return fine
    faster = (at.wanted_rpm + 1.25 * RULES.overspeed_rpm) / (1.0 - SLIP)
    return Bound((at.undisturbed, "overload"), fine.off_s, faster)


def turned_on(at: Situation, duty: float, driven_n_m: float) -> Bound:
    """Something else turns the crank: off at 15 rpm too much, and told when it does not coast."""
    limit_rpm = at.setpoint_rpm + RULES.overspeed_rpm
    if at.state in ("running up", "running"):
        limit_rpm = FULL_RPM + RULES.overspeed_rpm
    off_s = MOTOR.seconds_to(at.rpm, limit_rpm, duty, driven_n_m) + RULES.sight_s
    if not at.powered:
        limit_rpm = at.rpm + RULES.rest_rpm
        off_s = MOTOR.seconds_to(at.rpm, limit_rpm, duty, driven_n_m) + RULES.sight_s
    # What it coasts with is found out for a window and a step; from a steady speed the ramp then
    # has to fall by the margin of rest
    fading_s = RULES.window_s + RULES.step_s
    told_s = off_s + fading_s + RULES.rest_rpm / RULES.ramp_rpm_per_s + RULES.sight_s
    rpm = MOTOR.runaway(at.rpm, [(_LONGEST_S, duty)])[0] if duty > 0.0 else None
    highest = 1.0 if at.powered else 0.0
    return Bound(("runaway",), off_s if at.powered else 0.0, rpm, None, highest, told_s)


def silent_host(at: Situation) -> Bound:
    if at.state in (*WITHOUT_POWER, "stopping"):
        return unaffected(at)
    off_s = RULES.command_timeout_s + RULES.step_s + RULES.stop(at.wanted_rpm)
    return Bound(("host_silence",), off_s, unaffected(at).rpm)


def cut(at: Situation, ends: str, off_s: float, reset_cause: str = "") -> Bound:
    """The power goes after a time, and the duty is what it was."""
    if not at.powered:
        return at_rest(at, "stopped" if reset_cause else "", reset_cause)
    # A control step may come before
    duty = RULES.ceiling(at.rpm * 1.1) if not reset_cause else at.duty
    rpm, turns = MOTOR.runaway(at.rpm, [(off_s, duty)])
    return Bound((ends,), off_s, rpm, turns, duty, reset_cause=reset_cause)


# ---------------------------------------------------------------------------------- the faults


@dataclass(frozen=True)
class Fault:
    name: str
    strike: Callable[[Rig, dict[str, Any]], None]
    bound: Callable[[Situation], Bound]
    host_speaks: bool = True


def board_fault(name: str, bound: Callable[[Situation], Bound], **faults: Any) -> Fault:
    return Fault(name, lambda rig, before: rig.board.set_faults(**(before | faults)), bound)


def reset(name: str, cause: ResetCause) -> Fault:
    return Fault(
        name,
        lambda rig, before: rig.board.reset(cause),
        lambda at: cut(at, "stopped", RULES.pwm_s, cause.name.lower()),
    )


def disturbance(name: str, how: Disturbance, off_s: float) -> Fault:
    return Fault(
        name,
        lambda rig, before: rig.board.disturb(how),
        lambda at: cut(at, "stopped", off_s, "watchdog"),
    )


FAULTS = (
    board_fault("encoder silent", lambda at: without_word(at, "stall"), crank_encoder_silent=True),
    board_fault(
        "encoder unplugged", lambda at: without_word(at, "stall"), crank_encoder_unplugged=True
    ),
    board_fault("track A dead", lambda at: without_word(at, "encoder"), crank_track_a_dead=True),
    board_fault("track B dead", lambda at: without_word(at, "encoder"), crank_track_b_dead=True),
    board_fault(
        "encoder reversed", lambda at: without_word(at, "encoder"), crank_encoder_reversed=True
    ),
    board_fault("encoder slips by half", slipping, crank_encoder_slip=SLIP),
    board_fault(
        "crank jammed", lambda at: without_word(at, "stall", jammed=True), crank_blocked=True
    ),
    board_fault("load lost", unaffected, tow_parted=True),
    board_fault(
        "crank driven on by 10 N m",
        lambda at: turned_on(at, 0.0, DRIVEN_N_M),
        crank_driven_n_m=DRIVEN_N_M,
    ),
    board_fault("driver shorted", lambda at: turned_on(at, 1.0, 0.0), driver_shorted=True),
    Fault("host gone", lambda rig, before: None, silent_host, host_speaks=False),
    board_fault(
        "emergency-stop wire broken",
        lambda at: replace(cut(at, "emergency_stop", 1e-3), loop_open=True),
        emergency_stop_open=True,
    ),
    reset("supply dips (brown-out)", ResetCause.BROWN_OUT),
    reset("watchdog bites", ResetCause.WATCHDOG),
    disturbance("main loop hangs", Disturbance.HANGS, RULES.alive_s + 2 * RULES.pwm_s),
    disturbance("processor crashes", Disturbance.CRASHES, RULES.watchdog_s + 10e-3),
    disturbance("stray interrupt", Disturbance.STRAY_INTERRUPT, 1e-3),
)


# ------------------------------------------------------------------------------------ the cells


@dataclass
class Seen:
    """Of the motor's pins, the crank, and what the board told, from the fault on; s, rpm, turns."""

    off_s: float | None = None
    rpm: float = 0.0
    turns: float = 0.0
    duty: float = 0.0
    ends: str = ""
    told_s: float | None = None
    reset_cause: str = ""
    loop_open: bool = False


@dataclass
class Cell:
    state: str
    fault: str
    seen: Seen
    bound: Bound
    complaints: list[str] = field(default_factory=list)

    def judge(self) -> None:
        """Two samples of 2 ms lie between an instant and its being seen."""
        seen, bound = self.seen, self.bound
        if seen.ends not in bound.ends:
            self.complaints.append(f"ends as {seen.ends}, not {' or '.join(bound.ends)}")
        for name, unit, slack in (
            ("off_s", "s without the power's end", 4e-3),
            ("rpm", "rpm", 0.1),
            ("turns", "turns", 0.01),
            ("duty", "of duty", 1e-3),
            ("told_s", "s until it is told", 4e-3),
        ):
            most, was = getattr(bound, name), getattr(seen, name)
            if most is not None and (was is None or was > most + slack):
                self.complaints.append(f"{was} {unit}, more than {most:.3f}")
        if seen.loop_open != bound.loop_open:
            self.complaints.append(
                f"the loop is told to be {'open' if seen.loop_open else 'closed'}"
            )
        if bound.reset_cause and bound.reset_cause not in seen.reset_cause:
            self.complaints.append(f"reset cause {seen.reset_cause}, not {bound.reset_cause}")


def observe(rig: Rig, at: Situation, fault: Fault, rest_s: float) -> Seen:
    """Let the fault strike and look on until the crank rests and nothing can change any more."""
    board, seen = rig.board, Seen()
    start_ns, told = board.now_ns, len(rig.states)
    start_angle = board.counters()["crank_angle_rad"]
    before = {"tow_parted": True} if at.state == "starting" else {}
    fault.strike(rig, before)
    rested_ns = spoke_ns = start_ns
    while True:
        passed_s = (board.now_ns - start_ns) / 1e9
        counters = board.counters()
        seen.rpm = max(seen.rpm, counters["crank_rate_rad_s"] / RPM)
        seen.duty = max(seen.duty, counters["motor_duty"])
        if counters["motor_duty"] > 0.0:
            seen.off_s = None
        elif seen.off_s is None:
            seen.off_s = passed_s
        if counters["motor_duty"] > 0.0 or counters["crank_rate_rad_s"] > 0.0:
            rested_ns = board.now_ns
        if board.now_ns - rested_ns > 1e9 * rest_s or passed_s > _LONGEST_S:
            break
        if at.powered and fault.host_speaks and board.now_ns - spoke_ns >= 0.25e9:
            board.write(PROTOCOL.request(_KEEP, 200))
            spoke_ns = board.now_ns
        rig.line.run(board.now_ns + (250_000 if passed_s < 5e-3 else 2_000_000))
    seen.turns = (counters["crank_angle_rad"] - start_angle) / (2.0 * math.pi)
    rig.wait(0.02)
    for state in rig.states[told:]:
        seen.loop_open = not state.emergency_stop_closed
        ends = state.state if state.trip == "none" else state.trip
        if ends != seen.ends:
            seen.ends, seen.told_s = ends, state.ticks * 500 / 1e9 - start_ns / 1e9
    seen.reset_cause = PROTOCOL.reset_causes(rig.driver.counters().reset_cause)
    return seen


_KEEP = drive(DriveArguments(DriveAction.KEEP, speed=0, counts_per_revolution=0))


def try_fault(rig: Rig, at: Situation, fault: Fault) -> Cell:
    bound = fault.bound(at)
    rest_s = 2.2 if bound.reset_cause else 1.2  # it tells of a drive at rest once a second
    cell = Cell(at.state, fault.name, observe(rig, at, fault, rest_s), bound)
    cell.judge()
    return cell


def cells_of(state: str) -> list[Cell]:
    """All faults in one state. Each in a process of its own, a copy of this one."""
    rig = reach(state)
    counters, told = rig.board.counters(), rig.states[-1]
    at = Situation(
        state,
        told.setpoint_rpm,
        counters["crank_rate_rad_s"] / RPM,
        counters["motor_duty"],
    )
    forked = multiprocessing.get_context("fork")
    cells = []
    for fault in FAULTS:
        receiver, sender = forked.Pipe(duplex=False)
        child = forked.Process(target=_try_in_child, args=(sender, rig, at, fault))
        child.start()
        sender.close()
        cells.append(receiver.recv())
        child.join()
    return cells


def _try_in_child(sender: Any, rig: Rig, at: Situation, fault: Fault) -> None:
    sender.send(try_fault(rig, at, fault))


# ------------------------------------------------------------------------------------ the table


def _value(cell: Cell, name: str, unit: str, digits: int) -> str:
    was, most = getattr(cell.seen, name), getattr(cell.bound, name)
    if was is None:
        return "on"
    return f"{was:.{digits}f}{f' ({most:.{digits}f})' if most is not None else ''} {unit}"


def _text(cell: Cell) -> str:
    if cell.complaints:
        return "; ".join(cell.complaints)
    off, rpm = _value(cell, "off_s", "s", 2), _value(cell, "rpm", "rpm", 0)
    return f"{off}, {rpm}: {cell.seen.ends.replace('_', ' ')}"


def markdown(cells: list[Cell]) -> str:
    """A line for each fault, a column for each state: when the motor's power is off, the highest
    speed, each with its bound in brackets, and what the board says."""
    states = list(dict.fromkeys(cell.state for cell in cells))
    lines = [f"| | {' | '.join(states)} |", "|---" * (1 + len(states)) + "|"]
    for fault in FAULTS:
        texts = [_text(cell) for cell in cells if cell.fault == fault.name]
        lines.append(f"| {fault.name} | {' | '.join(texts)} |")
    return "\n".join(lines)


@click.command()
@click.option("--state", "states", type=click.Choice(STATES), multiple=True, default=STATES)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def main(states: tuple[str, ...], as_json: bool) -> None:
    """Every fault of the crank's drive in every state, on the virtual board: what is seen, and its
    bound."""
    cells = [cell for state in states for cell in cells_of(state)]
    if as_json:
        click.echo(json.dumps([asdict(cell) for cell in cells]))
    else:
        click.echo(markdown(cells))
    if any(cell.complaints for cell in cells):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
