"""The phases on the ground, and the phase that disarms after a failure, one coroutine each."""

import asyncio
from collections.abc import Callable
from contextlib import suppress

from companion.config.known_drag import drag_before_connecting
from companion.control.expected_response import gain_warning
from companion.files.yaml_file import ConfigError
from companion.flight.commands import command_if_ours, in_role, require_role
from companion.flight.context import INITIAL_HEARTBEAT_LIMIT, FlightContext
from companion.flight.leave_offboard import leave_offboard
from companion.flight.maneuver_checks import require_inside, require_still_flyable
from companion.flight.vehicle_identity import LONGEST_SILENCE
from companion.guidance.fence import LatLon
from companion.mavlink.commands import ARM, DISARM
from companion.preflight import vehicle_checks
from companion.preflight.evidence import Evidence, Stage
from companion.preflight.finding import Finding
from companion.safety.actions import ARMED_UNKNOWN, Exit, FlightEnded
from companion.vehicle.autopilot import Role
from companion.vehicle.parameter_rules import CheckResult, Values

_HEARTBEATS_MISSED = 3
_SHORTEST_HEARTBEAT_LIMIT = 0.8
_ARMED_REPORT_TIMEOUT = 1.5
"""Longest time from arming to a heartbeat with the armed flag, s: PX4 sends one a second."""


async def connect(context: FlightContext) -> None:
    """Wait for the autopilot's heartbeat."""
    context.waiting_for = f"no heartbeat yet on {context.config.link.endpoint}"
    await context.link.wait_connected(context.config.flight.connect_timeout_s)


async def checks(context: FlightContext) -> None:
    """Request telemetry, wait until the vehicle is ready, and run the preflight checks."""
    context.replacement_detector.begin()
    await request_telemetry(context)
    if context.config.flight.arm:  # a pilot who arms may have chosen the mode by a switch
        await leave_offboard(context, context.link.autopilot.cannot_arm_in)
    else:
        await leave_offboard(context)
    await context.until(lambda: _ready(context))
    # Positions are sent only once the estimator has one, so the rates are counted now.
    evidence = await check_vehicle(context, Stage.GROUND)
    warning = gain_warning(context.config)
    if warning is not None:
        context.note(warning)
    use_evidence(context, evidence)
    context.mode_at_checks = context.link.state.mode


async def request_telemetry(context: FlightContext) -> None:
    """Request the telemetry that a flight needs."""
    context.heartbeat_limit = INITIAL_HEARTBEAT_LIMIT
    context.waiting_for = "requesting telemetry"
    await context.preflight.ask_for_telemetry()


async def check_vehicle(context: FlightContext, stage: Stage) -> Evidence:
    """Run the preflight checks; set `FlightContext.heartbeat_limit` from the heartbeat rate."""
    context.waiting_for = "counting telemetry rates and reading the autopilot's parameters"
    evidence = await context.preflight.require(stage)
    heartbeats = evidence.streams.get("HEARTBEAT")  # not requested from PX4, whose rate is fixed
    if heartbeats is not None and heartbeats.achieved > 0.0:
        limit = max(_SHORTEST_HEARTBEAT_LIMIT, _HEARTBEATS_MISSED / heartbeats.achieved)
        context.heartbeat_limit = limit
    return evidence


def use_evidence(context: FlightContext, evidence: Evidence) -> None:
    """Check the maneuvers with the vehicle's drag and place, and report its offboard-loss failsafe.

    Raises:
        FlightEnded: a maneuver leaves the fence or exceeds a limit.
    """
    context.known_drag = evidence.known_drag
    _require_flyable_by_vehicle(context)
    _report_offboard_loss(context, evidence.survey.values)


async def stream(context: FlightContext) -> None:
    """Start to send setpoints, on the ground with zero thrust; wait until enough were sent."""
    context.loop.on = True
    setpoint_goal = context.loop.record.setpoints + round(context.config.link.min_attitude_rate_hz)
    await context.until(
        lambda: context.loop.record.setpoints >= setpoint_goal, "the first setpoints"
    )


async def arm(context: FlightContext) -> None:
    """Arm if `flight.arm` is true; else wait until the pilot arms and hands the vehicle over."""
    if context.config.flight.arm:
        await _arm(context)
        return
    ready = context.link.autopilot.ready_mode
    if context.link.state.mode == ready:
        context.note(f"the vehicle is in {ready} already: arming it starts the flight")
    await context.until(lambda: _pilot_has_armed(context))
    await context.preflight.require(Stage.ARMED)
    await context.until(
        lambda: _handed_over(context),
        f"the pilot to hand over, by switching to {ready} on the ground",
    )


async def undo_arming(context: FlightContext) -> None:
    """Disarm the vehicle that we armed, or whose take-off we commanded: it may still climb."""
    context.release()
    context.waiting_for = "the autopilot to accept disarming"

    def require_control() -> None:
        require_role(context.link, {Role.READY, Role.TAKEOFF})
        if context.ground.has_lifted_off:  # earlier tries may have been lost
            raise FlightEnded("the vehicle has left the ground, so it is not disarmed", Exit.LAND)

    # Sent even if the newest heartbeat says disarmed: it may be older than our arming.
    await command_if_ours(context, DISARM, require_control, lambda: not context.armed())
    await context.fresh_heartbeat()
    await context.until(lambda: not context.armed())


async def _arm(context: FlightContext) -> None:
    """Arm, after the checks are repeated."""
    state = context.link.state
    await context.next_position()
    context.waiting_for = "the autopilot to accept arming"
    autopilot = context.link.autopilot
    await command_if_ours(
        context,
        autopilot.set_mode(autopilot.ready_mode),
        lambda: _require_unchanged_by_others(context),
        lambda: in_role(context.link, Role.READY),
    )
    await context.until(lambda: in_role(context.link, Role.READY))
    await context.preflight.require(Stage.GROUND)
    arming_count = state.arming_count

    def armed() -> bool:
        if state.arming_count > arming_count and not context.armed():
            raise FlightEnded("the pilot disarmed again", Exit.LEAVE)
        return context.armed()

    def require_control() -> None:
        _refuse_unsafe(vehicle_checks.armed(state))
        require_role(context.link, {Role.READY})
        context.must_disarm = True  # only now: a vehicle that somebody else armed is not disarmed

    context.replacement_detector.note_arming()
    await command_if_ours(context, ARM, require_control, armed)
    await wait_until_armed(context, armed)
    if not armed():
        try:
            async with asyncio.timeout(INITIAL_HEARTBEAT_LIMIT):
                await context.fresh_heartbeat()
        except TimeoutError:
            raise FlightEnded(ARMED_UNKNOWN) from None
    if not armed():
        raise FlightEnded(
            "the autopilot accepted arming, but reports that it is disarmed", Exit.LEAVE
        )


async def wait_until_armed(context: FlightContext, armed: Callable[[], bool]) -> None:
    """Wait until `armed` is true, at most `_ARMED_REPORT_TIMEOUT`; raises what `armed` raises.

    The wait is needed because the newest heartbeat may be older than the arming.
    """
    with suppress(TimeoutError):
        async with asyncio.timeout(_ARMED_REPORT_TIMEOUT):
            await context.until(armed, "the vehicle to show that it is armed")


def _require_unchanged_by_others(context: FlightContext) -> None:
    """Raise `FlightEnded` if somebody armed the vehicle or changed its mode since the checks."""
    state = context.link.state
    _refuse_unsafe(vehicle_checks.armed(state))
    if state.mode != context.mode_at_checks:
        raise FlightEnded(
            f"the pilot or another station took over before arming: mode {state.mode}"
        )


def _require_flyable_by_vehicle(context: FlightContext) -> None:
    """Check the maneuvers again, with this vehicle's drag and its latitude and longitude.

    Raises:
        FlightEnded: a maneuver leaves the fence or exceeds a limit.
    """
    config, maneuvers, drag = context.config, context.maneuvers, context.known_drag
    global_position = context.link.state.global_position
    try:
        if drag != drag_before_connecting(config):
            require_still_flyable(config, maneuvers, drag)
        if config.safety.fence_polygon_deg and global_position is not None:
            position = LatLon(global_position.latitude_deg, global_position.longitude_deg)
            require_inside(config, maneuvers.parts, position, drag)
    except ConfigError as error:
        raise FlightEnded(str(error)) from error


def _ready(context: FlightContext) -> bool:
    state = context.link.state
    _refuse_unsafe(vehicle_checks.armed(state))
    _refuse_unsafe(vehicle_checks.battery(context.config, state))
    missing = context.link.autopilot.why_not_ready(state.readiness)
    context.waiting_for = "" if missing is None else f"{missing}, in mode {state.mode}"
    return missing is None


def _refuse_unsafe(finding: Finding) -> None:
    if finding.result is CheckResult.UNSAFE:
        raise FlightEnded(finding.sentence())


def _report_offboard_loss(context: FlightContext, values: Values) -> None:
    """Report the autopilot's reaction to the loss of our setpoints."""
    autopilot = context.link.autopilot
    failsafe = autopilot.offboard_loss_failsafe
    hold_time = values.get(failsafe.parameter)
    hold_time_text = "an unknown time" if hold_time is None else f"{hold_time:g} s"
    context.note(
        f"offboard loss: if our setpoints stop, {autopilot.name} holds the last rates for "
        f"{hold_time_text} ({failsafe.parameter}); then {failsafe.action}"
    )


def _pilot_has_armed(context: FlightContext) -> bool:
    silence = context.snapshot_builder.long_silence(asyncio.get_running_loop().time())
    context.waiting_for = "the pilot to arm (flight.arm is false, --arm was not given)"
    if silence is not None and silence > LONGEST_SILENCE:  # its arming would not be seen
        others = context.heard_instead()
        context.waiting_for = f"the vehicle, which has not been heard for {silence:.0f} s{others}"
    return context.armed()


def _handed_over(context: FlightContext) -> bool:
    if not context.armed():
        raise FlightEnded("the pilot disarmed again", Exit.LEAVE)
    if not context.link.state.landed:
        raise FlightEnded("the pilot took off", Exit.RELEASE)
    return context.link.state.mode == context.link.autopilot.ready_mode
