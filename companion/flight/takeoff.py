"""From the ground to control by our rates; each returns when its phase is at its end."""

import asyncio

from companion.flight.commands import change_mode, command_if_ours, in_role, in_roles, require_role
from companion.flight.context import FlightContext
from companion.preflight.evidence import Stage
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.autopilot import ControlEntry, Role

_SETTLING = 1.0
"""Hold in offboard before the maneuver begins, s: the take-over is not part of it."""

_REACHED = 0.5
"""Height below the wanted one at which a climb that has ended counts as done, m."""

_PAST = 3.0
"""Height above the wanted one at which a climb has gone wrong, m; PX4 overshoots by some tenths."""

_ARRIVES = 2.0
"""So long a climb that has become a hold may still take to arrive, s; else somebody stopped it."""


async def takeoff(context: FlightContext) -> None:
    """Let the autopilot take off, and wait for the height."""
    state = context.link.state
    context.same_vehicle.commit()
    await context.until(lambda: context.fresh_position() is not None, "a fresh position")
    await context.preflight.require(Stage.ARMED)
    await context.fresh_heartbeat()
    _require_ground(context)
    context.detail = "the autopilot to accept the take-off"
    height = context.config.flight.takeoff_height_m
    command = context.link.autopilot.take_off(height, _home_altitude(context))
    context.ground.command_takeoff()
    context.loop.command = None  # an idle one, which nothing may send from here on
    context.guidance_loop.step()
    # Asked again right before it is sent: PX4 that is told so disarmed takes off once a pilot arms.
    await command_if_ours(
        context, command, lambda: _require_ground(context), lambda: not state.landed
    )
    climb = _Climb(context, height)
    await context.until(climb.over)


async def offboard(context: FlightContext) -> None:
    """Hand control over to our stream, and settle."""
    context.detail = "the vehicle to be as it was at the checks"
    await context.preflight.require(Stage.AIRBORNE)
    context.guidance_loop.hold_here()
    context.snapshot_builder.begin(asyncio.get_running_loop().time())
    await _take_over(context)
    context.guidance_loop.hold_here()
    context.loop.offboard_active, context.loop.taking_over = True, False
    await asyncio.sleep(_SETTLING)


class _Climb:
    """Watches the autopilot's own take-off."""

    def __init__(self, context: FlightContext, height: float) -> None:
        self._context, self._height = context, height
        self._begun = False
        self._held_at: float | None = None

    def over(self) -> bool:
        """Whether it has arrived; raises `FlightEnded` if somebody ended it."""
        context, state = self._context, self._context.link.state
        if not context.armed():
            raise FlightEnded("the vehicle disarmed in the take-off, not by us", Exit.RELEASE)
        height, position = state.height, context.fresh_position()
        if height is None or position is None:
            return False
        context.detail = f"{self._height:g} m, now {height:.1f} m"
        if height > self._height + _PAST:
            raise FlightEnded(
                f"the vehicle climbed to {height:.1f} m, and flight.takeoff_height_m is "
                f"{self._height:g}"
            )
        near = height > self._height - _REACHED
        if not near and self._stopped():
            raise FlightEnded(f"the climb was stopped at {height:.1f} m, not by us", Exit.RELEASE)
        return near and abs(position.velocity_ned[2]) < 0.3 and not state.taking_off

    def _stopped(self) -> bool:
        """Whether what was a climb has been a hold for a while."""
        now = asyncio.get_running_loop().time()
        if in_role(self._context.link, Role.TAKEOFF):
            self._begun, self._held_at = True, None
        elif self._begun and self._held_at is None:
            self._held_at = now
        return self._held_at is not None and now - self._held_at > _ARRIVES


def _require_ground(context: FlightContext) -> None:
    """See that it stands ready for the take-off."""
    state = context.link.state
    require_role(context.link, {Role.READY})
    if not context.armed() or state.flying:
        raise FlightEnded("the vehicle does not stand armed on the ground any more", Exit.RELEASE)
    if not state.landed:
        raise FlightEnded("the autopilot does not say any more that it stands on the ground")


async def _take_over(context: FlightContext) -> None:
    """Have our setpoints obeyed: by a command, or by the first of them."""
    # An idle one of the time on the ground, obeyed in the air, would let the vehicle fall.
    await context.until(lambda: _commands_flight(context), "a target from guidance")
    context.detail = "the autopilot to obey our rates"
    context.loop.taking_over = True
    autopilot = context.link.autopilot
    if autopilot.control_entry is ControlEntry.BY_FIRST_SETPOINT:
        # The mode we know may be a second old; never take the vehicle from a pilot who took it.
        await context.fresh_heartbeat()
        require_role(context.link, {Role.READY})
        context.loop.on = True
        await context.until(lambda: in_role(context.link, Role.OFFBOARD))
        return
    ours = in_roles(context.link, {Role.READY})
    command = autopilot.set_mode(autopilot.offboard_mode)
    await change_mode(context, command, ours, lambda: in_role(context.link, Role.OFFBOARD))


def _commands_flight(context: FlightContext) -> bool:
    return context.loop.command is not None and not context.loop.command.idle


def _home_altitude(context: FlightContext) -> float:
    home = context.link.state.home
    if home is None:
        raise FlightEnded("the autopilot never sent its home position")
    return home.altitude_m
