# SPDX-License-Identifier: Apache-2.0
"""`towtank crank`: set the crank's drive from another terminal while a graph runs."""

from __future__ import annotations

import click
import rclpy
from towtank_daq.crank_drive import RPM
from towtank_interfaces.srv import SetCrankSpeed
from towtank_node.executor import StreamExecutor

SERVICE = "/measured/crank_drive/set_speed"
_WAIT_S = 5.0


@click.group(name="crank")
def command() -> None:
    """Drive the crank of the board that a running trial has."""


@command.command()
@click.argument("rpm", type=float)
def run(rpm: float) -> None:
    """Bring the crank to RPM (5 to 60), softly."""
    _ask(SetCrankSpeed.Request(action=SetCrankSpeed.Request.RUN, crank_rate=rpm * RPM))


@command.command()
def stop() -> None:
    """Bring the crank to rest, softly."""
    _ask(SetCrankSpeed.Request(action=SetCrankSpeed.Request.STOP))


@command.command(name="emergency-stop")
def emergency_stop() -> None:
    """Take the motor's power at once; the trip must be cleared."""
    _ask(SetCrankSpeed.Request(action=SetCrankSpeed.Request.EMERGENCY_STOP))


@command.command()
def clear() -> None:
    """Clear a trip; the crank stays at rest."""
    _ask(SetCrankSpeed.Request(action=SetCrankSpeed.Request.CLEAR_TRIP))


def _ask(request: SetCrankSpeed.Request) -> None:
    rclpy.init()
    node = rclpy.create_node("crank_command")
    try:
        executor = StreamExecutor()
        executor.add_node(node)
        client = node.create_client(SetCrankSpeed, SERVICE)
        if not client.wait_for_service(_WAIT_S):
            raise click.ClickException(
                f"no {SERVICE} within {_WAIT_S:g} s: start a trial on the board first"
            )
        future = client.call_async(request)
        executor.spin_until_future_complete(future, _WAIT_S)
        if not future.done():
            raise click.ClickException(f"{SERVICE} does not answer: see the board's node")
        if not future.result().success:
            raise click.ClickException(future.result().message)
    finally:
        node.destroy_node()
        rclpy.shutdown()
