"""Commands to a vehicle that somebody else may take at any moment."""

import asyncio
from collections.abc import Callable

from companion.flight.context import FlightContext
from companion.mavlink.commands import Command, command_name
from companion.mavlink.errors import CommandRefused, CommandTimeout
from companion.safety.ending import Exit, FlightEnded

_TRIES = 4
_SHOWS = 3.0
"""After its first command a take-off shows within so long, s; it takes longer than a mode does."""
_ENTERED = 1.0
"""A mode whose command was accepted shows within this time, s, or was left again."""

Done = Callable[[], bool]
"""Whether the vehicle does what was ordered; may end the flight instead."""
Ours = Callable[[], None]
"""Raises `FlightEnded` where the vehicle is not ours to command, such as `roles.in_roles`."""


async def command_if_ours(context: FlightContext, command: Command, ours: Ours, done: Done) -> None:
    """Command until it is answered, and ask each time before whose the vehicle is.

    A command is never repeated blindly: the first one may have been obeyed, only its answer lost,
    and a pilot may have decided otherwise since.

    Args:
        context: The parts of the flight.
        command: It.
        ours: Asked each time; where it raises, nothing is sent.
        done: See `Done`; looked at before a repetition.

    Raises:
        FlightEnded: The vehicle is somebody else's.
        CommandRefused: The autopilot does not want to.
        CommandTimeout: It never answered.
    """
    for given in range(_TRIES):
        await context.fresh_heartbeat()
        context.same_vehicle.require()
        if given > 0 and done():
            return
        ours()
        try:
            await context.link.command(*command, retries=0)
            return
        except CommandTimeout:
            continue
        except CommandRefused:
            # What does it already refuses to be told again.
            if given == 0 or not await _comes(context, done):
                raise
            return
    await context.fresh_heartbeat()
    if not done():
        name = command_name(command.command)
        raise CommandTimeout(f"{name}: no answer to {_TRIES} tries; does the uplink work?")


async def change_mode(context: FlightContext, command: Command, ours: Ours, done: Done) -> None:
    """`order`, and wait until it shows; as there.

    Raises:
        FlightEnded: Also if it was accepted and somebody decided otherwise at once.
    """
    await command_if_ours(context, command, ours, done)
    accepted = asyncio.get_running_loop().time()

    def entered() -> bool:
        state = context.link.state
        if done():
            return True
        if state.mode_received > accepted + _ENTERED:
            raise FlightEnded(
                f"the mode was accepted and left again, not by us: {state.mode}", Exit.RELEASE
            )
        return False

    await context.until(entered)


async def _comes(context: FlightContext, done: Done) -> bool:
    try:
        async with asyncio.timeout(_SHOWS):
            await context.until(done)
    except TimeoutError:
        return False
    return True
