"""The phases in which we control the vehicle or end the control, one coroutine each."""

import asyncio
from collections import deque
from collections.abc import Callable
from math import degrees, radians

from companion.flight.commands import command_if_ours, require_role
from companion.flight.context import FlightContext
from companion.flight.hand_over import hand_over_to_hold, hand_over_to_landing
from companion.flight.leave_offboard import leave_offboard
from companion.guidance import ManeuverSequence
from companion.guidance.fence import height_in_words
from companion.guidance.source import ManeuverSource, Source
from companion.mavlink.commands import DISARM
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.autopilot import Role

_SELF_DISARM_TIMEOUT = 8.0
"""Time allowed for the autopilot to disarm itself after landing, s."""

_UPRIGHT_TILT = radians(45.0)
"""Largest tilt of a vehicle that stands after a landing, rad; no slope to land on is steeper."""

_MIN_HOLDING_TILT_DEG = 5.0
"""Smallest tilt that limits.max_thrust must allow, °: the vehicle must hold against a breeze."""

_UNREPORTED_REDUCTION_DEG = 0.5
"""Largest reduction of the tilt that is not reported, °: rounded to whole degrees it would be 0."""

_TILT_WINDOW = 1.0
"""Window over which `_TiltMargin` takes the maximum of the allowed tilt, s."""


async def maneuvers(context: FlightContext) -> None:
    """Fly the flight's maneuvers to their end, or until guidance aborts them."""
    await fly_maneuvers(context, context.maneuvers)


async def fly_maneuvers(context: FlightContext, sequence: ManeuverSequence) -> None:
    """Fly `sequence` to its end, or until guidance aborts it."""
    clock = asyncio.get_running_loop().time
    began = clock()

    def progress() -> str:
        elapsed = clock() - began
        maneuver, _ = sequence.maneuver_at(elapsed)
        return f"{maneuver.name}, {elapsed:.0f} of {sequence.duration:.0f} s flown"

    await _fly(context, ManeuverSource(sequence), progress)
    context.guidance_loop.hold_reference()


async def fly_commanded(context: FlightContext, commands: Source) -> None:
    """Fly the commands of another program until it ends its control, then brake and hold.

    The phase waits until the vehicle has stopped, because the autopilot would brake a moving
    vehicle harder than guidance does.
    """
    await _fly(context, commands, lambda: f"commanded by {commands.name}")
    context.guidance_loop.hold_here()
    context.waiting_for = "the vehicle to stop"
    await asyncio.sleep(context.guidance_loop.remaining_braking_time)


async def _fly(context: FlightContext, source: Source, progress: Callable[[], str]) -> None:
    """Wait until the vehicle has stopped, then fly the references of `source` until it is finished.

    Raises:
        FlightEnded: guidance gave up, the source failed, or the thrust is too small to steer.
    """
    clock = asyncio.get_running_loop().time
    await asyncio.sleep(context.guidance_loop.remaining_braking_time)
    began, setpoints_before = clock(), context.loop.record.setpoints
    tilt_margin = _TiltMargin(context)
    tilt_margin.check()
    context.guidance_loop.follow(source)

    def is_over() -> bool:
        elapsed = clock() - began
        context.setpoint_rate_hz = (
            (context.loop.record.setpoints - setpoints_before) / elapsed if elapsed > 0.0 else 0.0
        )
        if context.guidance_loop.hold.give_up_reason is not None:
            raise FlightEnded(context.guidance_loop.hold.give_up_reason)
        if source.failure is not None:
            raise FlightEnded(source.failure, Exit.HOLD)
        tilt_margin.check()
        context.waiting_for = progress()
        return context.guidance_loop.finished

    await context.until(is_over)


class _TiltMargin:
    """Checks the largest tilt that `limits.max_thrust` allows at the learned hover thrust.

    The maximum over a second counts, because the learned thrust may be too large for a moment: a
    vehicle that gets no setpoints for some tenths of a second falls, and seems heavy.
    """

    def __init__(self, context: FlightContext) -> None:
        self._context = context
        self._reported = False
        self._tilts_deg: deque[tuple[float, float]] = deque()  # s of event-loop time, °

    def check(self) -> None:
        """Report once if the thrust allows less tilt than `limits.max_tilt_deg`.

        Raises:
            FlightEnded: the thrust allows less than 5° of tilt.
        """
        limits, learning = self._context.config.limits, self._context.guidance_loop.learning
        now, tilts_deg = asyncio.get_running_loop().time(), self._tilts_deg
        tilts_deg.append((now, degrees(learning.largest_tilt())))
        while now - tilts_deg[0][0] > _TILT_WINDOW:
            tilts_deg.popleft()
        tilt_deg, hover = max(each for _, each in tilts_deg), learning.hover_thrust.present_hover
        if tilt_deg < _MIN_HOLDING_TILT_DEG:
            raise FlightEnded(
                f"the vehicle hovers at a thrust of {hover:.2f}, so limits.max_thrust "
                f"{limits.max_thrust:g} leaves no thrust to steer with; raise limits.max_thrust, "
                "or make the vehicle lighter"
            )
        if tilt_deg < limits.max_tilt_deg - _UNREPORTED_REDUCTION_DEG and not self._reported:
            self._reported = True
            self._context.note(
                f"the vehicle hovers at a thrust of {hover:.2f}, so limits.max_thrust "
                f"{limits.max_thrust:g} holds the height only up to {tilt_deg:.0f}° of tilt; the "
                "flight is limited to this tilt, although limits.max_tilt_deg is "
                f"{limits.max_tilt_deg:g}"
            )


async def hand_back(context: FlightContext) -> None:
    """Stop the motion, and send setpoints until the autopilot holds by itself."""
    context.waiting_for = "the autopilot to hold"
    await hand_over_to_hold(context)


async def land(context: FlightContext) -> None:
    """Command the landing, send setpoints until the autopilot lands, and wait for touchdown.

    Raises:
        FlightEnded: somebody else has the vehicle or disarmed it, or it does not land in time.
    """
    context.waiting_for = "the autopilot to accept the landing"
    context.landing_requested = True
    await hand_over_to_landing(context)
    context.takeoff_position = None  # from here on only somebody else can end the landing
    timeout = context.config.flight.landing_timeout_s

    def touched_down() -> bool:
        height = context.link.state.height
        context.waiting_for = "touchdown" + (
            "" if height is None else f", now {height_in_words(height)}"
        )
        _require_landing(context)
        return context.ground.has_touched_down

    try:
        async with asyncio.timeout(timeout):
            await context.until(touched_down)
    except TimeoutError:
        raise FlightEnded(
            f"waited {timeout:g} s for {context.waiting_for}: watch the vehicle land, and if it "
            "stands with turning motors, disarm it by transmitter or ground station"
        ) from None


async def disarm(context: FlightContext) -> None:
    """Wait until the autopilot disarms, else command disarming; leave modes that forbid arming.

    Raises:
        FlightEnded: somebody else has the vehicle, or it does not stand upright.
    """
    context.waiting_for = "the autopilot to disarm itself"

    def disarmed() -> bool:
        _require_landing(context)
        return not context.armed()

    def require_control() -> None:
        require_role(context.link, {Role.LAND})
        if not context.ground.has_touched_down:  # the autopilot's flag may have been wrong before
            raise FlightEnded("the vehicle reports that it flies again, so it is not disarmed")

    try:
        async with asyncio.timeout(_SELF_DISARM_TIMEOUT):
            await context.until(disarmed)
    except TimeoutError:
        await context.until(
            lambda: disarmed() or context.ground.has_touched_down,
            "the autopilot to report that the vehicle stands on the ground",
        )
        if context.armed():
            context.waiting_for = "the autopilot to accept disarming"
            await command_if_ours(context, DISARM, require_control, disarmed)
        await context.until(disarmed)
    await context.fresh_heartbeat()
    await leave_offboard(context)
    _require_undamaged(context)


def _require_undamaged(context: FlightContext) -> None:
    """Raise `FlightEnded` if the vehicle fell in its landing, or lies on its side or its back."""
    tilt = context.tilt()
    if tilt is not None and tilt > _UPRIGHT_TILT:
        raise FlightEnded(
            f"the vehicle lies tilted by {degrees(tilt):.0f}° after the landing: it tipped over or "
            "crashed"
        )
    if context.ground.has_hit_ground:
        raise FlightEnded("the vehicle hit the ground hard: it fell in its landing or crashed")


def _require_landing(context: FlightContext) -> None:
    """Release control if the pilot ends the landing; a disarmed vehicle may be in any mode.

    PX4 changes its mode when it disarms, and reports the new mode first. So a mode counts only
    together with a heartbeat, which contains both mode and arming state.
    """
    if context.armed() and context.link.state.heartbeat_is_newest:
        require_role(context.link, {Role.LAND})
