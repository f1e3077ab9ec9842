"""What is done under our control and after it, one coroutine a phase."""

import asyncio
from math import degrees

from companion.flight.context import Rig
from companion.flight.left_in_offboard import leave_offboard
from companion.flight.mode_roles import in_role, in_roles, require_role
from companion.flight.orders import enter, order
from companion.safety.ending import FlightEnded, internal
from companion.vehicle.roles import Role

_SELF_DISARM = 8.0
"""How long the autopilot may take to disarm itself after landing, s."""

_LEAST_TILT = 5.0
"""A vehicle whose thrust allows less, °, cannot be held against a breeze."""

_OURS = frozenset({Role.TAKEOFF, Role.READY, Role.HOLD, Role.OFFBOARD})


async def programme(rig: Rig) -> None:
    """Fly the programme to its end, or until it is given up."""
    now = asyncio.get_running_loop().time
    began, sent = now(), rig.loop.setpoints
    thrust = _ThrustForTilt(rig)
    thrust.look()
    rig.guide.follow(rig.programme)

    def over() -> bool:
        elapsed = now() - began
        rig.rate_hz = (rig.loop.setpoints - sent) / elapsed if elapsed > 0.0 else 0.0
        if rig.guide.given_up is not None:
            raise FlightEnded(rig.guide.given_up)
        thrust.look()
        part, _ = rig.programme.part_at(elapsed)
        rig.detail = f"{part.name}, {elapsed:.0f} of {rig.programme.duration:.0f} s flown"
        return rig.guide.finished

    await rig.until(over)


class _ThrustForTilt:
    """Tells when the vehicle's thrust allows less tilt than the configuration does."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._told = False

    def look(self) -> None:
        """Tell it once; end the flight where there is no thrust to tilt with at all.

        Raises:
            FlightEnded: the hover takes all of the thrust.
        """
        limits, learning = self._rig.config.limits, self._rig.guide.learning
        tilt, hover = degrees(learning.largest_tilt()), learning.hover
        if tilt < _LEAST_TILT:
            raise FlightEnded(
                f"the vehicle hovers at a thrust of {hover:.2f}: limits.max_thrust "
                f"{limits.max_thrust:g} leaves nothing to steer with"
            )
        if tilt < limits.max_tilt_deg and not self._told:
            self._told = True
            self._rig.note(
                f"the vehicle hovers at a thrust of {hover:.2f}, so limits.max_thrust "
                f"{limits.max_thrust:g} holds the height up to {tilt:.0f}° of tilt: no more is "
                f"asked for, although limits.max_tilt_deg is {limits.max_tilt_deg:g}"
            )


async def hand_back(rig: Rig) -> None:
    """Stop moving, and stream until the autopilot holds by itself."""
    _stop_moving(rig)
    rig.detail = "the autopilot to hold"
    ours = in_roles(rig.link, _OURS)
    await enter(rig, rig.link.family.hold(), ours, lambda: in_role(rig.link, Role.HOLD))
    rig.release()


async def land(rig: Rig) -> None:
    """Let the autopilot land; if we still steer, until it has taken over."""
    _stop_moving(rig)
    rig.detail = "the autopilot to accept the landing"

    def landing() -> bool:
        return in_role(rig.link, Role.LAND) or not rig.armed()

    await enter(rig, rig.link.family.land(), in_roles(rig.link, _OURS | {Role.LAND}), landing)
    rig.release()

    def down() -> bool:
        height = rig.link.state.height
        rig.detail = "touchdown" + ("" if height is None else f", now {height:.1f} m")
        _require_landing(rig)
        return rig.ground.touched_down

    await rig.until(down)


async def disarm(rig: Rig) -> None:
    """Wait until the autopilot disarmed itself, or ask it to; leave it fit to be armed again."""
    rig.detail = "the autopilot to disarm itself"

    def disarmed() -> bool:
        _require_landing(rig)
        return not rig.armed()

    try:
        async with asyncio.timeout(_SELF_DISARM):
            await rig.until(disarmed)
    except TimeoutError:
        rig.detail = "the autopilot to accept disarming"
        await order(rig, rig.link.family.disarm(), in_roles(rig.link, {Role.LAND}), disarmed)
        await rig.until(disarmed)
    await rig.fresh_heartbeat()
    await leave_offboard(rig)


def _require_landing(rig: Rig) -> None:
    """The landing under way is ours until a pilot ends it; disarmed, any mode is.

    PX4 goes to another mode when it disarms, and tells of that before it tells that it disarmed.
    """
    if rig.armed() and rig.link.state.heartbeat_is_newest:
        require_role(rig.link, {Role.LAND})


def _stop_moving(rig: Rig) -> None:
    if not rig.loop.guarded:
        return
    try:
        rig.loop.plan_anew()  # the estimator may have jumped
        rig.guide.hold_here()
    except Exception as error:  # whatever is wrong with guidance, the autopilot must be asked
        rig.note(internal(error))
        rig.release()
