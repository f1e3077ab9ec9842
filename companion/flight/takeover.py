"""Checks a vehicle that somebody else armed, and takes over a vehicle that flies."""

import asyncio
from collections.abc import Callable
from math import degrees, hypot

from companion.attitude.kinematics import tilt_angle
from companion.flight.commands import change_mode, in_role, require_armed_in_air, require_role
from companion.flight.context import FlightContext
from companion.flight.preflight_phases import (
    check_vehicle,
    checks,
    request_telemetry,
    stream,
    use_evidence,
    wait_until_armed,
)
from companion.flight.takeoff import (
    MAX_UNDERSHOOT,
    climb_has_ended,
    require_steady_heading,
)
from companion.preflight.evidence import Stage
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.autopilot import ControlEntry, Role

_LARGEST_HELD_SPEED = 3.0
"""Largest horizontal speed of a vehicle that is taken over, m/s."""

_LONGEST_DISTURBANCE = 4.0
"""Longest time for which a disturbed link delays the takeover before the flight ends, s."""

_BRAKING_TIME = 5.0
"""Time for the autopilot to brake to `_LARGEST_HELD_SPEED` and to limits.max_tilt_deg, s."""

_HOVER_LEARNING_TIME = 3.0
"""Time allowed to learn the hover thrust from the autopilot's thrust, s."""

_SETTLE_TIME = 1.0
"""Time of holding in offboard before the maneuvers begin, s: the takeover must not disturb them."""


async def check_unless_flying(context: FlightContext) -> None:
    """Run the checks if the vehicle is on the ground; if it flies, only request telemetry.

    Raises:
        FlightEnded: the vehicle is armed on the ground, or a finding blocks the flight.
    """
    if context.armed():
        context.replacement_detector.begin()
        await request_telemetry(context)
        await _wait_for_landed_state(context)
        if context.link.state.flying:
            return
    await checks(context)


async def wait_for_handover(context: FlightContext) -> None:
    """Wait until the vehicle flies high enough, and its pilot lets the autopilot hold it.

    A vehicle that still takes off or climbs is not held yet. A vehicle that holds because of a
    failsafe, such as offboard loss, was not handed over.
    """
    state, ready_mode = context.link.state, context.link.autopilot.ready_mode
    min_height = context.config.flight.takeoff_height_m - MAX_UNDERSHOOT

    def handed_over() -> bool:
        if not context.armed() or not state.flying:
            context.waiting_for = "the pilot to take off"
            return False
        context.ground.note_flying()
        if state.height is None or state.height < min_height:
            height = "unknown" if state.height is None else f"{state.height:.1f} m"
            context.waiting_for = (
                f"a height of {min_height:.1f} m (flight.takeoff_height_m), now {height}"
            )
            return False
        if state.mode != ready_mode or not in_role(context.link, Role.READY):
            by_failsafe = " by the autopilot's failsafe" if state.mode == ready_mode else ""
            context.waiting_for = (
                f"the pilot to switch to {ready_mode}, now {state.mode}{by_failsafe}"
            )
            return False
        context.waiting_for = "the vehicle to keep its height"
        return climb_has_ended(context)

    await context.until(handed_over)


async def check_airborne(context: FlightContext) -> None:
    """Check a vehicle that already flies; command nothing, only request telemetry.

    Raises:
        FlightEnded: the vehicle does not fly, or a finding blocks the takeover.
    """
    await _check_stage(context, Stage.AIRBORNE, _require_flying)
    context.ground.note_flying()


async def check_armed_on_ground(context: FlightContext) -> None:
    """Check a vehicle that somebody else armed on the ground; only request telemetry.

    Raises:
        FlightEnded: the vehicle is not armed on the ground, or a finding blocks the take-off.
    """
    await wait_until_armed(context, context.armed)
    await _check_stage(context, Stage.ARMED, _require_armed_on_ground)
    await context.until(lambda: context.link.state.home is not None, "the home position")


async def _check_stage(
    context: FlightContext, stage: Stage, require: Callable[[FlightContext], None]
) -> None:
    """Run the checks of a stage; before and after them, `require` raises if the state is wrong."""
    context.replacement_detector.begin()
    context.replacement_detector.note_arming()
    await request_telemetry(context)
    await _wait_for_landed_state(context)
    require(context)
    await context.next_position()
    evidence = await check_vehicle(context, stage)
    use_evidence(context, evidence)
    require(context)


async def _wait_for_landed_state(context: FlightContext) -> None:
    state = context.link.state
    await context.until(
        lambda: state.landed or state.flying, "the vehicle to report landed or flying"
    )


def _require_flying(context: FlightContext) -> None:
    if not context.armed() or not context.link.state.flying:
        raise FlightEnded("the vehicle does not fly: take off first", Exit.LEAVE)


def _require_armed_on_ground(context: FlightContext) -> None:
    if not context.armed():
        raise FlightEnded("the vehicle is not armed: arm it first", Exit.LEAVE)
    if not context.link.state.landed:
        raise FlightEnded("the vehicle has left the ground: request control again", Exit.LEAVE)


async def offboard(context: FlightContext) -> None:
    """Check the vehicle again, take over, and hold for `_SETTLE_TIME`."""
    context.waiting_for = "the preflight checks before the takeover"
    await context.preflight.require_within(_LONGEST_DISTURBANCE, Stage.AIRBORNE)
    require_steady_heading(context)
    await _wait_until_held(context)
    await _require_learned_hover(context)
    require_steady_heading(context)
    context.guidance_loop.hold_here()
    context.snapshot_builder.begin(asyncio.get_running_loop().time(), context.fence_centre)
    position_jump = hypot(*context.loop.resets.position_shift)
    if position_jump and context.takeoff_position is not None:  # the monitors count from here on
        context.note(f"before the takeover the estimated position jumped by {position_jump:.1f} m")
    await _take_over(context)
    context.guidance_loop.hold_here()
    context.loop.offboard_active, context.loop.taking_over = True, False
    context.takeoff_position = None
    await asyncio.sleep(_SETTLE_TIME)


async def _wait_until_held(context: FlightContext) -> None:
    """Wait until the autopilot holds the vehicle still: it may have to brake first.

    Raises:
        FlightEnded: after `_BRAKING_TIME` the vehicle is still too tilted or too fast, as in wind.
    """
    try:
        async with asyncio.timeout(_BRAKING_TIME):
            await context.until(lambda: _is_held(context), "the autopilot to hold the vehicle")
    except TimeoutError:
        raise FlightEnded(
            f"not taken over: waited {_BRAKING_TIME:g} s for {context.waiting_for}; fly in less "
            "wind, check the compass if the vehicle circled, or take over a vehicle that hovers"
        ) from None


async def _require_learned_hover(context: FlightContext) -> None:
    """Wait until the learned hover thrust is good enough to hold the vehicle's height.

    Raises:
        FlightEnded: the hover thrust is too far from the configured one, or our smallest thrust
            carries nearly the whole weight.
    """
    learning = context.guidance_loop.learning
    try:
        async with asyncio.timeout(_HOVER_LEARNING_TIME):
            await context.until(lambda: learning.takeover_refusal() is None, "the hover thrust")
    except TimeoutError:
        refusal = learning.takeover_refusal()
        if refusal is not None:
            raise FlightEnded(refusal) from None


def _is_held(context: FlightContext) -> bool:
    attitude_sample, position = context.loop.resets.newest_attitude, context.fresh_position()
    if attitude_sample is None or position is None:
        return False
    tilt = tilt_angle(attitude_sample.q[1], attitude_sample.q[2])
    speed = hypot(*position.velocity_ned[:2])
    context.waiting_for = (
        f"the autopilot to hold the vehicle (tilt {degrees(tilt):.0f}°, speed {speed:.1f} m/s)"
    )
    return tilt <= context.config.limits.max_tilt and speed <= _LARGEST_HELD_SPEED


async def _take_over(context: FlightContext) -> None:
    """Take over, by a command or by the first setpoint, as the autopilot needs."""
    # An idle command from the ground, obeyed in the air, would let the vehicle fall.
    await context.until(lambda: _has_flight_command(context), "a target from guidance")
    autopilot = context.link.autopilot
    if autopilot.control_entry is ControlEntry.BY_COMMAND and not context.loop.on:
        await stream(context)
    context.waiting_for = "the autopilot to obey our body rates"
    context.loop.taking_over = True

    def require_control() -> None:
        require_role(context.link, {Role.READY})
        require_armed_in_air(context)

    def is_obeying() -> bool:
        require_armed_in_air(context)
        return in_role(context.link, Role.OFFBOARD)

    if autopilot.control_entry is ControlEntry.BY_FIRST_SETPOINT:
        # The known mode may be a second old, and a pilot may have taken over since.
        await context.fresh_heartbeat()
        require_control()
        context.loop.on = True
        await context.until(is_obeying)
        return
    offboard_command = autopilot.set_mode(autopilot.offboard_mode)
    await change_mode(context, offboard_command, require_control, is_obeying)


def _has_flight_command(context: FlightContext) -> bool:
    return context.loop.command is not None and not context.loop.command.idle
