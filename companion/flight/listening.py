"""The phase after a lost link: wait until the vehicle is heard again, then let it hold or land."""

import asyncio
from math import dist

from companion.flight.commands import ask_to_hold, in_role, require_role
from companion.flight.context import FlightContext
from companion.flight.takeoff import MAX_OVERSHOOT, MAX_UNDERSHOOT
from companion.mavlink.errors import CommandRefused, CommandTimeout, LinkLost
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.autopilot import Role

_LISTENING_TIMEOUT = 10.0
"""Longest wait for a frame of the vehicle after the link was lost, s."""

_HOLD_TIMEOUT = 10.0
"""Time allowed to enter hold mode after the vehicle is heard again, s; then it is asked to land."""

_LARGEST_DRIFT = 3.0
"""Largest horizontal drift by wind in a climb, m; a vehicle farther away was flown by somebody."""


async def hold_when_heard(context: FlightContext) -> None:
    """Send nothing until the vehicle is heard; if it still obeys us, command it to hold.

    If a landing or a take-off was commanded before, or the vehicle does not hold, command landing.
    ArduPilot stays in GUIDED when setpoints end, and does not hold its position.

    Raises:
        FlightEnded: the vehicle is not heard in time, must land, or is controlled by others.
    """
    frames_before = context.link.stats.frames
    was_heard = False
    try:
        async with asyncio.timeout(_LISTENING_TIMEOUT) as deadline:
            await context.until(lambda: context.link.stats.frames > frames_before, "its next frame")
            was_heard = True
            deadline.reschedule(asyncio.get_running_loop().time() + _HOLD_TIMEOUT)
            await _hold_if_ours(context)
    except TimeoutError:
        if not was_heard:
            context.waiting_for += context.heard_instead()
            raise context.timed_out(_LISTENING_TIMEOUT, "the vehicle to be heard") from None
        if _obeys_setpoints(context):
            raise context.timed_out(_HOLD_TIMEOUT, "the vehicle to hold", Exit.LAND) from None
        _note_left_alone(context, f", after {_HOLD_TIMEOUT:g} s without {context.waiting_for}")


def _obeys_setpoints(context: FlightContext) -> bool:
    return context.armed() and in_role(context.link, Role.OFFBOARD)


def _note_left_alone(context: FlightContext, reason: str = "") -> None:
    armed = "armed" if context.armed() else "disarmed"
    detector = context.replacement_detector  # ends the flight by itself if it shows another vehicle
    restart = detector.restart_in_words() if detector.is_same_vehicle else None
    context.note(
        f"the vehicle is heard again, {armed} in {context.link.state.mode}{reason}: "
        f"nothing is commanded{'' if restart is None else f'; {restart}'}"
    )


async def _hold_if_ours(context: FlightContext) -> None:
    """Command a vehicle that is heard again, and still obeys us, until it holds."""
    context.waiting_for = "the vehicle's heartbeat"
    context.link.timesync.send_exchange_request()  # its answer shows a restart
    await context.fresh_heartbeat()  # only now, because a request during the silence is lost
    mode = context.link.state.mode
    lost_in_takeoff = context.armed() and await _is_in_our_takeoff(context)
    if not (_obeys_setpoints(context) or lost_in_takeoff):
        _note_left_alone(context)
        return
    if context.landing_requested:
        reason = f"the vehicle is heard again, still in {mode}: its landing was requested before"
        raise FlightEnded(reason, Exit.LAND)
    if lost_in_takeoff:
        raise FlightEnded(f"the vehicle is heard again after its take-off, in {mode}", Exit.LAND)
    context.note(f"the vehicle is heard again, still in {mode}: asking it to hold")
    context.waiting_for = "the vehicle's report that it holds"
    while True:
        try:
            await ask_to_hold(context, lambda: require_role(context.link, {Role.OFFBOARD}))
        except CommandRefused as error:  # without setpoints it would drift, so it must land
            await context.fresh_heartbeat()
            require_role(context.link, {Role.OFFBOARD})  # a pilot may have taken over meanwhile
            raise FlightEnded(str(error), Exit.LAND) from error
        except (CommandTimeout, LinkLost) as error:
            context.waiting_for = str(error)
        else:
            return


async def _is_in_our_takeoff(context: FlightContext) -> bool:
    """Whether a vehicle that is heard again takes off for us, or holds at the take-off height.

    If the vehicle holds lower or elsewhere, somebody else has stopped it or flown it there.
    """
    state, takeoff_position = context.link.state, context.takeoff_position
    if takeoff_position is None:
        return False
    position = await context.next_position()
    if dist(takeoff_position, position.position_ned[:2]) > _LARGEST_DRIFT:
        return False
    if in_role(context.link, Role.TAKEOFF):
        return True
    if not in_role(context.link, Role.READY) or state.mode_by_failsafe or state.height is None:
        return False
    height_error = state.height - context.config.flight.takeoff_height_m
    return -MAX_UNDERSHOOT < height_error < MAX_OVERSHOOT
