"""Hands the vehicle over to its autopilot, which then holds it or lands it."""

import asyncio
from collections.abc import Awaitable, Callable

from companion.flight.commands import (
    IsDone,
    RequireControl,
    ask_to_hold,
    change_mode,
    in_role,
    require_armed_in_air,
    require_role,
)
from companion.flight.context import FlightContext, cancel
from companion.mavlink.commands import Command
from companion.mavlink.errors import CommandRefused, CommandTimeout, LinkError, LinkLost
from companion.mavlink.messages import dialect
from companion.mavlink.texts import status_texts
from companion.safety.actions import Exit, FlightEnded, fault_message
from companion.vehicle.autopilot import Role

_REPETITION_PAUSE = 1.0
"""Time from a refused or unanswered landing command to the next landing command, s. The reason for
a refusal may have ended by then."""

_PILOT_WARNING_TIME = 10.0
"""Time after which the pilot of a vehicle that has not begun to land is warned, s; also the time
between two warnings."""

_FALLING_SPEED = 2.5
"""Downward speed above which a disarmed vehicle is falling, m/s; a landed vehicle stands still."""

_PILOT_WARNING = "Companion: vehicle does not land. Switch its mode!"
"""Text for the pilot's ground station; it fits into one STATUSTEXT."""

ROLES_BEFORE_LANDING = frozenset({Role.TAKEOFF, Role.READY, Role.HOLD, Role.OFFBOARD})
"""Roles of the modes in which a vehicle that we have flown may be commanded to hold or to land."""

_PrepareRepetition = Callable[[LinkError], Awaitable[RequireControl]]
"""Called with the error of a mode command: raises it, or returns `require_control` for a retry."""


async def hand_over_to_hold(context: FlightContext) -> None:
    """Command hold mode until the autopilot holds; then release control.

    Raises:
        FlightEnded: somebody else has the vehicle, or it was disarmed in the air.
        CommandRefused: the autopilot refused.
    """

    def require_control() -> None:
        require_role(context.link, ROLES_BEFORE_LANDING)
        require_armed_in_air(context)

    def holding() -> bool:
        require_armed_in_air(context)
        return in_role(context.link, Role.HOLD)

    async def prepare_repetition(error: LinkError) -> RequireControl:
        if isinstance(error, CommandRefused):
            raise error
        return require_control

    await _hand_over(
        context, context.link.autopilot.hold(), require_control, holding, prepare_repetition
    )


async def hand_over_to_landing(context: FlightContext) -> None:
    """Command the landing until the autopilot lands, even after refusals; then release control.

    Before each repetition, a vehicle that still obeys us is asked to hold: ArduPilot would not hold
    its position after our last setpoint. If others command a hold meanwhile, they keep control.

    The time allowed is `flight.landing_timeout_s`. After this time, a vehicle that would drift
    without our setpoints is still held and asked to land, until somebody takes it over.

    Raises:
        FlightEnded: somebody else has the vehicle, or the time allowed is over.
    """
    refusal_noted = False
    time_limit = _LandingTimeLimit(context)

    def require_control() -> None:
        require_role(context.link, ROLES_BEFORE_LANDING | {Role.LAND})

    def require_offboard_or_landing() -> None:
        require_role(context.link, {Role.OFFBOARD, Role.LAND})

    def landing() -> bool:
        return in_role(context.link, Role.LAND) or not context.armed()

    async def prepare_repetition(error: LinkError) -> RequireControl:
        nonlocal refusal_noted
        if isinstance(error, CommandRefused) and not refusal_noted:
            refusal_noted = True
            context.note(f"{error}; the landing is requested again every second")
        time_limit.check()
        was_offboard = in_role(context.link, Role.OFFBOARD)
        await asyncio.sleep(_REPETITION_PAUSE)
        if was_offboard and not landing():
            await _hold_before_repetition(context, landing)
        return (
            require_offboard_or_landing if in_role(context.link, Role.OFFBOARD) else require_control
        )

    await _hand_over(
        context, context.link.autopilot.land(), require_control, landing, prepare_repetition
    )


class _LandingTimeLimit:
    """Limits the time for which the landing command is repeated, and warns the pilot."""

    def __init__(self, context: FlightContext) -> None:
        self._context, self._clock = context, asyncio.get_running_loop().time
        self._began = self._warned_at = self._clock()
        self._extension_noted = False

    def check(self) -> None:
        """Check the time before each repetition of the landing command.

        Raises:
            FlightEnded: the time allowed is over, and the vehicle does not need our setpoints.
        """
        context, now = self._context, self._clock()
        timeout = context.config.flight.landing_timeout_s
        if now - self._warned_at >= _PILOT_WARNING_TIME:
            self._warned_at = now
            for text in status_texts(_PILOT_WARNING, dialect.MAV_SEVERITY_CRITICAL, 1):
                context.link.send(text)
        if now - self._began < timeout:
            return
        if not _drifts_without_setpoints(context):
            raise context.timed_out(timeout, "the autopilot to begin the landing")
        if not self._extension_noted:
            self._extension_noted = True
            context.note(
                f"the vehicle has not begun to land within {timeout:g} s. Without setpoints it "
                "would drift, so the program keeps it in place and goes on asking it to land; "
                "switch its mode by transmitter"
            )


def _drifts_without_setpoints(context: FlightContext) -> bool:
    """Whether the vehicle obeys our setpoints, and its autopilot would not stop it without them."""
    is_obeying = context.loop.offboard_active and in_role(context.link, Role.OFFBOARD)
    return is_obeying and not context.link.autopilot.offboard_loss_failsafe.brakes


async def _hand_over(
    context: FlightContext,
    command: Command,
    require_control: RequireControl,
    done: IsDone,
    prepare_repetition: _PrepareRepetition,
) -> None:
    """Stop the motion, command a mode until the autopilot has entered it, and release control.

    A command that has no effect is sent again until the phase is over: a vehicle whose uplink loses
    frames must not be left in the air. Before each try, the vehicle is held at its present place.
    """
    release_task = asyncio.create_task(_release_when_offboard_ends(context))
    try:
        while True:
            stop_moving(context)
            try:
                await change_mode(context, command, require_control, done)
                break
            except (CommandTimeout, CommandRefused, LinkLost) as error:
                context.waiting_for = str(error)
                require_control = await prepare_repetition(error)
            if done():
                break
    finally:
        await cancel(release_task)
    context.release()


async def _release_when_offboard_ends(context: FlightContext) -> None:
    """Stop the setpoints as soon as the autopilot does not obey them, whoever changed its mode."""
    if in_role(context.link, Role.OFFBOARD):
        await context.until(lambda: not in_role(context.link, Role.OFFBOARD))
        context.release()


async def _hold_before_repetition(context: FlightContext, landing: IsDone) -> None:
    """Command hold mode, then release control, before the landing command is repeated.

    Control is not released if the hold command fails or the autopilot has begun to land.
    """
    try:
        await ask_to_hold(context, lambda: require_role(context.link, {Role.OFFBOARD}))
    except (CommandRefused, CommandTimeout, LinkLost):
        return
    except FlightEnded:
        if not landing():
            raise
        return
    context.release()


def require_not_falling(context: FlightContext) -> None:
    """Raise `FlightEnded` if the vehicle was disarmed in the air and falls."""
    position = context.fresh_position()
    is_falling = position is not None and position.velocity_ned[2] > _FALLING_SPEED
    if is_falling and not context.armed():
        raise FlightEnded(
            "the pilot, the autopilot or another station disarmed the vehicle in the air during "
            "the landing, and it fell",
            Exit.RELEASE,
        )


def stop_moving(context: FlightContext) -> None:
    """If the autopilot obeys us, brake and hold; an error in guidance ends the setpoints."""
    if not context.loop.offboard_active:
        return
    try:
        context.loop.restart_planner()  # the estimator may have been reset
        context.guidance_loop.hold_here()
    except Exception as error:  # the exit must go on, even if guidance fails
        context.note(fault_message(error))
        context.end_stream()
