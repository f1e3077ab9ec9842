"""What is done in the air, one coroutine a phase; each returns when the phase is at its end."""

import asyncio

from companion.flight.ending import Exit, FlightEnded, internal
from companion.flight.rig import Rig
from companion.flight.roles import require_role, roles_of
from companion.mavlink.errors import CommandRefused
from companion.mavlink.roles import Role

_SETTLING = 1.0
"""Hold in offboard before the programme begins, s: the take-over is not part of it."""

_REACHED = 0.5
"""Height below the wanted one at which a climb that has ended counts as done, m."""

_STOPPED = 1.5
"""Height below the wanted one at which a hold is somebody's wish and not the climb's end, m."""

_ON_GROUND = 1.5
"""Height above home that may be read on the ground, m: the estimate drifts."""

_LIFTS_OFF = 3.0
"""After its command, until the autopilot says that it does not stand any more, s."""

_ENTERED = 1.0
"""A mode whose command was accepted shows in a heartbeat within so long, s, or was left again."""

_SELF_DISARM = 8.0
"""How long the autopilot may take to disarm itself after landing, s."""


async def takeoff(rig: Rig) -> None:
    """Let the autopilot take off, and wait for the height."""
    state, height = rig.link.state, rig.config.flight.takeoff_height_m
    await rig.until(lambda: rig.fresh_position() is not None, "a fresh position")
    await rig.fresh_heartbeat()
    _require_ground(rig)
    rig.detail = "the autopilot to accept the take-off"
    await _ask_for_take_off(rig)
    climbing = False

    def reached() -> bool:
        nonlocal climbing
        now, position = state.height, rig.fresh_position()
        if now is None or position is None:
            return False
        rig.detail = f"{height:g} m, now {now:.1f} m"
        climbs = _in(rig, Role.TAKEOFF)
        climbing = climbing or climbs
        if climbing and not climbs and _in(rig, Role.HOLD) and now < height - _STOPPED:
            raise FlightEnded(f"the climb was stopped at {now:.1f} m, not by us", Exit.LET_GO)
        there = now > height - _REACHED and abs(position.velocity_ned[2]) < 0.3
        return there and not state.taking_off

    await rig.until(reached)


async def offboard(rig: Rig) -> None:
    """Hand control over to our stream, and settle."""
    rig.guide.hold_here()
    rig.lookout.begin(asyncio.get_running_loop().time())
    # The mode we know may be a second old; never take the vehicle from a pilot who took it.
    await rig.fresh_heartbeat()
    require_role(rig.link, {Role.READY})
    await _take_over(rig)
    rig.guide.hold_here()
    rig.loop.guarded = True
    await asyncio.sleep(_SETTLING)


async def programme(rig: Rig) -> None:
    """Fly the programme to its end, or until it is given up."""
    now = asyncio.get_running_loop().time
    began, sent = now(), rig.loop.setpoints
    rig.guide.follow(rig.programme)

    def over() -> bool:
        elapsed = now() - began
        rig.rate_hz = (rig.loop.setpoints - sent) / elapsed if elapsed > 0.0 else 0.0
        if rig.guide.given_up is not None:
            raise FlightEnded(rig.guide.given_up)
        part, _ = rig.programme.part_at(elapsed)
        rig.detail = f"{part.name}, {elapsed:.0f} of {rig.programme.duration:.0f} s flown"
        return rig.guide.finished

    await rig.until(over)


async def hand_back(rig: Rig) -> None:
    """Stop moving, and stream until the autopilot holds by itself."""
    _stop_moving(rig)
    if not rig.loop.guarded:
        # Control stood still, and what was heard since may be old: who has the vehicle now?
        rig.detail = "the autopilot's mode"
        await rig.caught_up()
        await rig.fresh_heartbeat()
        require_role(rig.link, {Role.TAKEOFF, Role.READY, Role.HOLD, Role.OFFBOARD})
    rig.detail = "the autopilot to hold"
    await rig.link.command(*rig.link.family.hold())
    await rig.until(lambda: _in(rig, Role.HOLD))
    rig.release()


async def land(rig: Rig) -> None:
    """Let the autopilot land; if we still steer, until it has taken over."""
    _stop_moving(rig)
    rig.detail = "the autopilot to accept the landing"
    await rig.link.command(*rig.link.family.land())
    await rig.until(lambda: _in(rig, Role.LAND) or not rig.armed())
    rig.release()

    def down() -> bool:
        height = rig.link.state.height
        rig.detail = "touchdown" + ("" if height is None else f", now {height:.1f} m")
        return rig.link.state.landed

    await rig.until(down)


async def disarm(rig: Rig) -> None:
    """Wait for the autopilot to disarm itself; ask it to after a while."""
    rig.detail = "the autopilot to disarm itself"
    try:
        async with asyncio.timeout(_SELF_DISARM):
            await rig.until(lambda: not rig.armed())
    except TimeoutError:
        rig.detail = "the autopilot to accept disarming"
        await rig.link.command(*rig.link.family.disarm())
        await rig.until(lambda: not rig.armed())


def _stop_moving(rig: Rig) -> None:
    if not rig.loop.guarded:
        return
    try:
        rig.loop.plan_anew()  # the estimator may have jumped
        rig.guide.hold_here()
    except Exception as error:  # whatever is wrong with guidance, the autopilot must be asked
        rig.note(internal(error))
        rig.release()


def _require_ground(rig: Rig) -> None:
    """See that it stands ready for the take-off, and that heights mean what they should."""
    state = rig.link.state
    require_role(rig.link, {Role.READY})
    if not (state.landed and state.armed):
        raise FlightEnded("the vehicle does not stand armed on the ground any more", Exit.LET_GO)
    if state.height is not None and abs(state.height) > _ON_GROUND:
        raise FlightEnded(
            f"the vehicle stands {state.height:.1f} m above home by what it says, so take-off "
            "height and limits.fence_floor_m would be wrong; have the autopilot set home here"
        )


async def _ask_for_take_off(rig: Rig) -> None:
    try:
        await rig.link.command(
            *rig.link.family.take_off(rig.config.flight.takeoff_height_m, _home_altitude(rig))
        )
    except CommandRefused as refused:
        if not refused.repeated:
            raise
        # The answer to the first may be lost, and one that flies already refuses the second.
        try:
            async with asyncio.timeout(_LIFTS_OFF):
                await rig.until(lambda: not rig.link.state.landed)
        except TimeoutError:
            raise refused from None


async def _take_over(rig: Rig) -> None:
    """Have our setpoints obeyed: by a command, or by the first of them."""
    # An idle one of the time on the ground, obeyed in the air, would let the vehicle fall.
    await rig.until(lambda: _commands_flight(rig), "a target from guidance")
    command = rig.link.family.take_over()
    if command is None:
        rig.loop.on = True
        await rig.until(lambda: _in(rig, Role.OFFBOARD), "the autopilot to obey our rates")
        return
    rig.detail = "the autopilot to enter offboard"
    await rig.link.command(*command)
    accepted = asyncio.get_running_loop().time()

    def obeyed() -> bool:
        heartbeat = rig.link.state.heartbeat
        if _in(rig, Role.OFFBOARD):
            return True
        if heartbeat is not None and heartbeat.received > accepted + _ENTERED:
            raise FlightEnded(
                f"offboard was accepted and left again, not by us: {heartbeat.mode}", Exit.LET_GO
            )
        return False

    await rig.until(obeyed, "the autopilot to obey our rates")


def _commands_flight(rig: Rig) -> bool:
    return rig.loop.command is not None and not rig.loop.command.idle


def _in(rig: Rig, role: Role) -> bool:
    return role in roles_of(rig.link)


def _home_altitude(rig: Rig) -> float:
    home = rig.link.state.home
    if home is None:
        raise FlightEnded("the autopilot never sent its home position")
    return home.altitude_m
