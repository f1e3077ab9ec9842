"""Hands the vehicle over to its autopilot, which then holds it or lands it."""

import asyncio

from companion.flight.commands import (
    IsDone,
    RequireOurs,
    ask_to_hold,
    change_mode,
    in_role,
    in_roles,
)
from companion.flight.context import FlightContext, cancel
from companion.mavlink.commands import Command
from companion.mavlink.errors import CommandRefused, CommandTimeout, LinkLost
from companion.safety.actions import FlightEnded, fault_message
from companion.vehicle.autopilot import Role

_REPETITION_PAUSE = 1.0
"""Time from a landing that failed to the next request, s: the reason may be gone by then."""

_OBEYS_OR_LANDS = frozenset({Role.OFFBOARD, Role.LAND})


async def hand_over(
    context: FlightContext, command: Command, require_ours: RequireOurs, done: IsDone
) -> None:
    """Stop the motion, and command a mode until the autopilot has entered it; then release.

    A command that has no effect is sent again until the phase is over: a vehicle whose uplink loses
    frames must not be left in the air. It is held where it is then, because it may have drifted.

    Raises:
        FlightEnded: somebody else has the vehicle.
        CommandRefused: the autopilot refused.
    """
    while True:
        _stop_moving(context)
        try:
            await change_mode(context, command, require_ours, done)
        except (CommandTimeout, LinkLost) as error:
            context.detail = str(error)
        else:
            break
    context.release()


async def hand_over_to_landing(
    context: FlightContext, require_ours: RequireOurs, landing: IsDone
) -> None:
    """Like `hand_over`, for the landing; one that is refused is requested again, too.

    Whenever a request has failed, a vehicle that still obeys us is asked to hold: ArduPilot would
    not hold its position after our last setpoint. A hold that others command then is respected.

    Args:
        context: context of the flight.
        require_ours: raises if the vehicle must not be commanded to land.
        landing: returns whether it lands.

    Raises:
        FlightEnded: somebody else has the vehicle.
    """
    _stop_moving(context)
    try:
        await change_mode(context, context.link.autopilot.land(), require_ours, landing)
    except (CommandTimeout, CommandRefused, LinkLost) as error:
        context.detail = str(error)
        if isinstance(error, CommandRefused):
            context.note(f"{error}; the landing is requested again every second")
    else:
        context.release()
        return
    watching = asyncio.create_task(_release_once_left(context))
    try:
        await _repeat_landing(context, require_ours, landing)
    finally:
        await cancel(watching)
    context.release()


async def _repeat_landing(
    context: FlightContext, require_ours: RequireOurs, landing: IsDone
) -> None:
    """Request the landing until it is accepted, and before each request a hold."""
    while True:
        obeyed = in_role(context.link, Role.OFFBOARD)
        await asyncio.sleep(_REPETITION_PAUSE)
        if landing():  # it refused, and lands all the same
            return
        if obeyed:
            await _ask_to_hold(context, landing)
            _stop_moving(context)
        obeys = in_role(context.link, Role.OFFBOARD)
        may_land = in_roles(context.link, _OBEYS_OR_LANDS) if obeys else require_ours
        try:
            await change_mode(context, context.link.autopilot.land(), may_land, landing)
            return
        except (CommandTimeout, CommandRefused, LinkLost) as error:
            context.detail = str(error)


async def _release_once_left(context: FlightContext) -> None:
    """Stop the setpoints as soon as the autopilot does not obey them, whoever changed its mode."""
    if in_role(context.link, Role.OFFBOARD):
        await context.until(lambda: not in_role(context.link, Role.OFFBOARD))
        context.release()


async def _ask_to_hold(context: FlightContext, landing: IsDone) -> None:
    """Ask the autopilot to hold; go on without it if it does not, or if it lands meanwhile."""
    try:
        await ask_to_hold(context, in_roles(context.link, {Role.OFFBOARD}))
    except (CommandRefused, CommandTimeout, LinkLost):
        return
    except FlightEnded:
        if not landing():
            raise
        return
    context.release()


def _stop_moving(context: FlightContext) -> None:
    if not context.loop.offboard_active:
        return
    try:
        context.loop.restart_planner()  # the estimator may have been reset
        context.guidance_loop.hold_here()
    except Exception as error:  # the exit must go on whatever fails in guidance
        context.note(fault_message(error))
        context.end_stream()
