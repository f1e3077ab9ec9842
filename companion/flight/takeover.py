"""The phases before a takeover: somebody else armed the vehicle; it flies or is on the ground."""

import asyncio
from collections.abc import Callable
from contextlib import suppress

from companion.flight.context import INITIAL_HEARTBEAT_LIMIT, FlightContext
from companion.flight.preflight_phases import report_offboard_loss, set_heartbeat_limit
from companion.preflight.evidence import Stage
from companion.safety.actions import Exit, FlightEnded

_ARMED_REPORT_TIMEOUT = 1.5
"""Longest time from arming to the heartbeat that shows it, s: PX4 sends one a second."""


async def check_airborne(context: FlightContext) -> None:
    """Check a vehicle that already flies; command nothing, only request telemetry.

    Raises:
        FlightEnded: the vehicle does not fly, or a finding blocks the takeover.
    """
    await _check_stage(context, Stage.AIRBORNE, _require_flying)
    context.ground.note_flying()


async def check_armed_on_ground(context: FlightContext) -> None:
    """Check a vehicle that somebody else armed on the ground; only request telemetry.

    The newest heartbeat may be older than the arming, so this first waits for one that shows it.

    Raises:
        FlightEnded: the vehicle is not armed on the ground, or a finding blocks the take-off.
    """
    with suppress(TimeoutError):
        async with asyncio.timeout(_ARMED_REPORT_TIMEOUT):
            await context.until(context.armed, "the vehicle to show that it is armed")
    await _check_stage(context, Stage.ARMED, _require_armed_on_ground)
    await context.until(lambda: context.link.state.home is not None, "the home position")


async def _check_stage(
    context: FlightContext, stage: Stage, require: Callable[[FlightContext], None]
) -> None:
    """Run the checks of a stage; before and after them, `require` raises if the state is wrong."""
    context.same_vehicle.begin()
    context.same_vehicle.commit()
    context.heartbeat_limit = INITIAL_HEARTBEAT_LIMIT
    context.detail = "requesting telemetry"
    await context.preflight.ask_for_telemetry()
    state = context.link.state
    await context.until(
        lambda: state.landed or state.flying, "the vehicle to report landed or flying"
    )
    require(context)
    await context.until(lambda: context.fresh_position() is not None, "a fresh position")
    context.detail = "counting telemetry rates and reading the autopilot's parameters"
    evidence = await context.preflight.require(stage)
    set_heartbeat_limit(context, evidence)
    report_offboard_loss(context, evidence.survey.values)
    require(context)


def _require_flying(context: FlightContext) -> None:
    if not context.armed() or not context.link.state.flying:
        raise FlightEnded("the vehicle does not fly: take off first", Exit.LEAVE)


def _require_armed_on_ground(context: FlightContext) -> None:
    if not context.armed():
        raise FlightEnded("the vehicle is not armed: arm it first", Exit.LEAVE)
    if not context.link.state.landed:
        raise FlightEnded("the vehicle has left the ground: request control again", Exit.LEAVE)
