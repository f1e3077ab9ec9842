"""What is done on the ground, one coroutine a phase, and how arming is undone."""

from companion.flight.autopilot_setup import autopilot_setup
from companion.flight.ending import Exit, FlightEnded
from companion.flight.rig import Rig
from companion.mavlink.parameter_rules import Verdict, judge
from companion.mavlink.parameter_survey import survey

_HEARTBEATS_MISSED = 3
_SHORTEST_HEARTBEAT_LIMIT = 0.8


async def connect(rig: Rig) -> None:
    """Wait for the autopilot's heartbeat."""
    rig.detail = f"no heartbeat yet on {rig.config.link.endpoint}"
    await rig.link.wait_connected(rig.config.flight.connect_timeout_s)


async def checks(rig: Rig) -> None:
    """Ask for the telemetry we fly on, wait for readiness, and measure what arrives."""
    link, config = rig.link, rig.config
    rig.detail = "asking for telemetry"
    wanted = {
        **link.family.wanted_rates,
        "ATTITUDE_QUATERNION": config.link.attitude_rate_hz,
        "LOCAL_POSITION_NED": config.link.position_rate_hz,
    }
    for message, rate in (await link.set_rates(wanted, window_s=0.1)).items():
        if rate.granted < rate.asked:
            rig.note(f"{message}: asked for {rate.asked:g} Hz, granted {rate.granted:g} Hz")
    await rig.until(lambda: _ready(rig))
    await _check_vital_parameters(rig)
    # Measured only now: a position is not sent before the estimator has one.
    rig.detail = "measuring the telemetry that arrives"
    achieved = await link.measure_rates(wanted, 1.0)
    for message, least, key in (
        ("ATTITUDE_QUATERNION", config.link.min_attitude_rate_hz, "min_attitude_rate_hz"),
        ("LOCAL_POSITION_NED", config.link.min_position_rate_hz, "min_position_rate_hz"),
    ):
        if achieved[message] < least:
            raise FlightEnded(
                f"{message} arrives at {achieved[message]:.0f} Hz, less than "
                f"link.{key} = {least:g}; raise the link's speed or lower the limit"
            )
    if achieved["HEARTBEAT"] > 0.0:
        limit = _HEARTBEATS_MISSED / achieved["HEARTBEAT"]
        rig.heartbeat_limit = max(_SHORTEST_HEARTBEAT_LIMIT, limit)
    _check_delay(rig)
    rig.mode_at_checks = link.state.mode


async def stream(rig: Rig) -> None:
    """Begin to answer samples, idle, and see that setpoints really flow."""
    rig.loop.on = True
    enough = rig.loop.setpoints + round(rig.config.link.min_attitude_rate_hz)
    await rig.until(lambda: rig.loop.setpoints >= enough, "setpoints to flow")


async def arm(rig: Rig) -> None:
    """Arm if we were told to; else wait for the pilot to do it, and to hand the vehicle over."""
    if rig.config.flight.arm:
        # What was good at the checks may not be so any more.
        await rig.until(lambda: rig.fresh_position() is not None, "a fresh position")
        _check_battery(rig)
        await rig.fresh_heartbeat()
        if rig.link.state.mode != rig.mode_at_checks:
            raise FlightEnded(
                f"the pilot or another station took over before arming: mode {rig.link.state.mode}"
            )
        rig.detail = "the autopilot to accept arming"
        rig.arm_sent = True
        for command in rig.link.family.arm():
            await rig.link.command(*command)
        await rig.until(rig.armed, "the vehicle to be armed")
        return
    await rig.until(rig.armed, "the pilot to arm (flight.arm is false, --arm was not given)")
    ready = rig.link.family.ready_mode
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
    await rig.link.command(*rig.link.family.disarm())
    await rig.fresh_heartbeat()
    await rig.until(lambda: not rig.armed())


def _ready(rig: Rig) -> bool:
    state = rig.link.state
    if state.armed:
        raise FlightEnded("the vehicle is already armed; land and disarm it first")
    _check_battery(rig)
    missing = rig.link.family.not_ready(state.readiness)
    rig.detail = missing or ""
    return missing is None


def _check_battery(rig: Rig) -> None:
    battery = rig.link.state.battery_remaining
    least = rig.config.limits.min_battery_percent / 100.0
    if battery is not None and battery < least:
        raise FlightEnded(
            f"battery at {100 * battery:.0f} %, below limits.min_battery_percent; charge it"
        )


async def _check_vital_parameters(rig: Rig) -> None:
    """Refuse an autopilot that would take our setpoints for something else.

    And tell what it would do without them.
    """
    rig.detail = "reading the autopilot's parameters"
    family = rig.link.family
    dead_man = family.dead_man
    vital = [rule for rule in family.parameters if rule.vital]
    held = [rule for rule in family.parameters if rule.name == dead_man.parameter]
    values = await survey(rig.link, [*vital, *held])
    for rule in vital:
        if rule.name not in values:
            raise FlightEnded(
                f"the autopilot has no parameter {rule.name}, so that it cannot be known "
                f"{rule.meaning}; this needs a newer version of {family.name}"
            )
    for finding in judge(vital, values, autopilot_setup(rig.config)):
        if finding.verdict is not Verdict.SAFE:
            raise FlightEnded(finding.sentence())
    seconds = values.get(dead_man.parameter, dead_man.default)
    rig.note(
        f"should our setpoints stop, {family.name} holds the last rates for {seconds:g} s "
        f"({dead_man.parameter}); then {dead_man.then}"
    )


def _check_delay(rig: Rig) -> None:
    """A delay that is always there cannot be seen from the samples, but from TIMESYNC."""
    round_trip, limit = rig.link.timesync.round_trip_s, rig.config.deadman.telemetry_stale_ms / 1e3
    if round_trip is not None and round_trip > limit:
        raise FlightEnded(
            f"the link's round trip takes {1e3 * round_trip:.0f} ms, longer than "
            "deadman.telemetry_stale_ms; use a faster link"
        )


def _handed_over(rig: Rig) -> bool:
    if not rig.armed():
        raise FlightEnded("the pilot disarmed again", Exit.LEAVE)
    if not rig.link.state.landed:
        raise FlightEnded("the pilot took off", Exit.LET_GO)
    return rig.link.state.mode == rig.link.family.ready_mode
