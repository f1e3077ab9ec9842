"""From the ground to control by our rates; each returns when its phase is at its end."""

import asyncio

from companion.flight.context import Rig
from companion.flight.mode_roles import in_role, in_roles, require_role
from companion.flight.orders import enter, order
from companion.preflight.evidence import Stage
from companion.safety.ending import Exit, FlightEnded
from companion.vehicle.roles import Role

_SETTLING = 1.0
"""Hold in offboard before the programme begins, s: the take-over is not part of it."""

_REACHED = 0.5
"""Height below the wanted one at which a climb that has ended counts as done, m."""

_PAST = 3.0
"""Height above the wanted one at which a climb has gone wrong, m; PX4 overshoots by some tenths."""

_ARRIVES = 2.0
"""So long a climb that has become a hold may still take to arrive, s; else somebody stopped it."""


async def takeoff(rig: Rig) -> None:
    """Let the autopilot take off, and wait for the height."""
    state = rig.link.state
    rig.same_vehicle.commit()
    await rig.until(lambda: rig.fresh_position() is not None, "a fresh position")
    await rig.preflight.require(Stage.ARMED)
    await rig.fresh_heartbeat()
    _require_ground(rig)
    rig.detail = "the autopilot to accept the take-off"
    height = rig.config.flight.takeoff_height_m
    command = rig.link.family.take_off(height, _home_altitude(rig))
    rig.ground.command_takeoff()
    rig.loop.command = None  # an idle one, which nothing may send from here on
    rig.guide.step()
    # Asked again right before it is sent: PX4 that is told so disarmed takes off once a pilot arms.
    await order(rig, command, lambda: _require_ground(rig), lambda: not state.landed)
    climb = _Climb(rig, height)
    await rig.until(climb.over)


async def offboard(rig: Rig) -> None:
    """Hand control over to our stream, and settle."""
    rig.detail = "the vehicle to be as it was at the checks"
    await rig.preflight.require(Stage.AIRBORNE)
    rig.guide.hold_here()
    rig.lookout.begin(asyncio.get_running_loop().time())
    await _take_over(rig)
    rig.guide.hold_here()
    rig.loop.guarded, rig.loop.taking_over = True, False
    await asyncio.sleep(_SETTLING)


class _Climb:
    """Watches the autopilot's own take-off."""

    def __init__(self, rig: Rig, height: float) -> None:
        self._rig, self._height = rig, height
        self._begun = False
        self._held_at: float | None = None

    def over(self) -> bool:
        """Whether it has arrived; raises `FlightEnded` if somebody ended it."""
        rig, state = self._rig, self._rig.link.state
        if not rig.armed():
            raise FlightEnded("the vehicle disarmed in the take-off, not by us", Exit.LET_GO)
        height, position = state.height, rig.fresh_position()
        if height is None or position is None:
            return False
        rig.detail = f"{self._height:g} m, now {height:.1f} m"
        if height > self._height + _PAST:
            raise FlightEnded(
                f"the vehicle climbed to {height:.1f} m, and flight.takeoff_height_m is "
                f"{self._height:g}"
            )
        near = height > self._height - _REACHED
        if not near and self._stopped():
            raise FlightEnded(f"the climb was stopped at {height:.1f} m, not by us", Exit.LET_GO)
        return near and abs(position.velocity_ned[2]) < 0.3 and not state.taking_off

    def _stopped(self) -> bool:
        """Whether what was a climb has been a hold for a while."""
        now = asyncio.get_running_loop().time()
        if in_role(self._rig.link, Role.TAKEOFF):
            self._begun, self._held_at = True, None
        elif self._begun and self._held_at is None:
            self._held_at = now
        return self._held_at is not None and now - self._held_at > _ARRIVES


def _require_ground(rig: Rig) -> None:
    """See that it stands ready for the take-off."""
    state = rig.link.state
    require_role(rig.link, {Role.READY})
    if not rig.armed() or state.flying:
        raise FlightEnded("the vehicle does not stand armed on the ground any more", Exit.LET_GO)
    if not state.landed:
        raise FlightEnded("the autopilot does not say any more that it stands on the ground")


async def _take_over(rig: Rig) -> None:
    """Have our setpoints obeyed: by a command, or by the first of them."""
    # An idle one of the time on the ground, obeyed in the air, would let the vehicle fall.
    await rig.until(lambda: _commands_flight(rig), "a target from guidance")
    rig.detail = "the autopilot to obey our rates"
    rig.loop.taking_over = True
    command = rig.link.family.take_over()
    if command is None:
        # The mode we know may be a second old; never take the vehicle from a pilot who took it.
        await rig.fresh_heartbeat()
        require_role(rig.link, {Role.READY})
        rig.loop.on = True
        await rig.until(lambda: in_role(rig.link, Role.OFFBOARD))
        return
    ours = in_roles(rig.link, {Role.READY})
    await enter(rig, command, ours, lambda: in_role(rig.link, Role.OFFBOARD))


def _commands_flight(rig: Rig) -> bool:
    return rig.loop.command is not None and not rig.loop.command.idle


def _home_altitude(rig: Rig) -> float:
    home = rig.link.state.home
    if home is None:
        raise FlightEnded("the autopilot never sent its home position")
    return home.altitude_m
