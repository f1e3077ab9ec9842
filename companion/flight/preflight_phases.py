"""What is done on the ground, one coroutine a phase, and how arming is undone."""

from companion.files.yaml_file import ConfigError
from companion.flight.context import SLOWEST_HEARTBEAT, Rig
from companion.flight.left_in_offboard import leave_offboard
from companion.flight.maneuvers import require_inside
from companion.flight.mode_roles import in_role, in_roles, require_role
from companion.flight.orders import order
from companion.guidance.fence import Place
from companion.preflight import vehicle_checks
from companion.preflight.evidence import Stage
from companion.preflight.finding import Finding
from companion.safety.ending import Exit, FlightEnded
from companion.vehicle.parameter_rules import Values, Verdict
from companion.vehicle.roles import Role

_HEARTBEATS_MISSED = 3
_SHORTEST_HEARTBEAT_LIMIT = 0.8


async def connect(rig: Rig) -> None:
    """Wait for the autopilot's heartbeat."""
    rig.detail = f"no heartbeat yet on {rig.config.link.endpoint}"
    await rig.link.wait_connected(rig.config.flight.connect_timeout_s)


async def checks(rig: Rig) -> None:
    """Ask for the telemetry we fly on, wait for readiness, and let the doctor look at it all."""
    rig.same_vehicle.begin()
    rig.heartbeat_limit = SLOWEST_HEARTBEAT
    rig.detail = "asking for telemetry"
    await rig.preflight.ask_for_telemetry()
    if rig.config.flight.arm:  # else the pilot, who may have chosen the mode by a switch
        await leave_offboard(rig, rig.link.family.unready_in)
    else:
        await leave_offboard(rig)
    await rig.until(lambda: _ready(rig))
    # Counted only now: a position is not sent before the estimator has one.
    rig.detail = "counting the telemetry that arrives, reading the autopilot's parameters"
    evidence = await rig.preflight.require(Stage.GROUND)
    heartbeats = evidence.streams.get("HEARTBEAT")  # PX4's is not asked for: its rate is fixed
    if heartbeats is not None and heartbeats.achieved > 0.0:
        limit = max(_SHORTEST_HEARTBEAT_LIMIT, _HEARTBEATS_MISSED / heartbeats.achieved)
        rig.heartbeat_limit = limit
    _require_inside_map(rig)
    _tell_dead_man(rig, evidence.survey.values)
    rig.mode_at_checks = rig.link.state.mode


async def stream(rig: Rig) -> None:
    """Begin to answer samples, idle, and see that setpoints really flow."""
    rig.loop.on = True
    enough = rig.loop.setpoints + round(rig.config.link.min_attitude_rate_hz)
    await rig.until(lambda: rig.loop.setpoints >= enough, "setpoints to flow")


async def arm(rig: Rig) -> None:
    """Arm if we were told to; else wait for the pilot to do it, and to hand the vehicle over."""
    if rig.config.flight.arm:
        await _arm(rig)
        return
    ready = rig.link.family.ready_mode
    if rig.link.state.mode == ready:
        rig.note(f"the vehicle is in {ready} already: arming it starts the flight")
    await rig.until(rig.armed, "the pilot to arm (flight.arm is false, --arm was not given)")
    await rig.preflight.require(Stage.ARMED)
    await rig.until(
        lambda: _handed_over(rig), f"the pilot to hand over, by switching to {ready} on the ground"
    )


async def undo_arming(rig: Rig) -> None:
    """Disarm if it was us who armed; an arming of the pilot's is the pilot's."""
    rig.release()
    if not rig.arm_sent:
        return
    rig.detail = "the autopilot to accept disarming"
    # The heartbeat may be older than our arming, so it is not asked whether this is needed.
    ours = in_roles(rig.link, {Role.READY, Role.TAKEOFF})
    await order(rig, rig.link.family.disarm(), ours, lambda: not rig.armed())
    await rig.fresh_heartbeat()
    await rig.until(lambda: not rig.armed())


async def _arm(rig: Rig) -> None:
    """Arm; what was good at the checks may not be so any more."""
    state = rig.link.state
    await rig.until(lambda: rig.fresh_position() is not None, "a fresh position")
    rig.detail = "the autopilot to accept arming"
    *before, command = rig.link.family.arm()
    for each in before:
        await order(rig, each, lambda: _untouched(rig), lambda: in_role(rig.link, Role.READY))
    await rig.until(lambda: in_role(rig.link, Role.READY))
    await rig.preflight.require(Stage.GROUND)
    armings = state.armings

    def armed() -> bool:
        if state.armings > armings and not rig.armed():
            raise FlightEnded("the pilot disarmed again", Exit.LEAVE)
        return rig.armed()

    def ready() -> None:
        _refuse(vehicle_checks.armed(state))
        require_role(rig.link, {Role.READY})

    rig.arm_sent = True
    rig.same_vehicle.commit()
    await order(rig, command, ready, armed)
    await rig.until(armed, "the vehicle to be armed")


def _untouched(rig: Rig) -> None:
    """Raise `FlightEnded` if somebody armed it or chose another mode since the checks."""
    state = rig.link.state
    _refuse(vehicle_checks.armed(state))
    if state.mode != rig.mode_at_checks:
        raise FlightEnded(
            f"the pilot or another station took over before arming: mode {state.mode}"
        )


def _require_inside_map(rig: Rig) -> None:
    """See that all programmes stay inside a fence on the map, which needs the vehicle's place."""
    told = rig.link.state.global_position
    if not rig.config.safety.fence_polygon_deg or told is None:
        return  # without a place the checks have refused already
    try:
        place = Place(told.latitude_deg, told.longitude_deg)
        require_inside(rig.config, rig.programme.parts, place)
    except ConfigError as error:
        raise FlightEnded(str(error)) from error


def _ready(rig: Rig) -> bool:
    state = rig.link.state
    _refuse(vehicle_checks.armed(state))
    _check_battery(rig)
    missing = rig.link.family.not_ready(state.readiness)
    rig.detail = "" if missing is None else f"{missing}, in mode {state.mode}"
    return missing is None


def _check_battery(rig: Rig) -> None:
    _refuse(vehicle_checks.battery(rig.config, rig.link.state))


def _refuse(finding: Finding) -> None:
    if finding.verdict is Verdict.UNSAFE:
        raise FlightEnded(finding.sentence())


def _tell_dead_man(rig: Rig, values: Values) -> None:
    """Tell what the autopilot would do without our setpoints."""
    family = rig.link.family
    dead_man = family.dead_man
    seconds = values.get(dead_man.parameter)
    how_long = "a time that is not known" if seconds is None else f"{seconds:g} s"
    rig.note(
        f"should our setpoints stop, {family.name} holds the last rates for {how_long} "
        f"({dead_man.parameter}); then {dead_man.then}"
    )


def _handed_over(rig: Rig) -> bool:
    if not rig.armed():
        raise FlightEnded("the pilot disarmed again", Exit.LEAVE)
    if not rig.link.state.landed:
        raise FlightEnded("the pilot took off", Exit.LET_GO)
    return rig.link.state.mode == rig.link.family.ready_mode
