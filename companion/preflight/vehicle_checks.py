"""Checks of the vehicle itself: readiness, battery, estimator, place and version."""

from collections.abc import Iterator

from companion.config import Config
from companion.guidance.fence import LatLon, height_in_words, inside, local_polygon
from companion.mavlink.messages import dialect
from companion.preflight.evidence import Evidence, Stage
from companion.preflight.finding import INEFFECTIVE, NOT_READY, SAFE, UNSAFE, Finding, Key
from companion.vehicle.state import GROUND_HEIGHT, VehicleState

_MAX_UNUSABLE_SHARE = 0.01
"""Largest share of unusable attitude samples that damaged messages can explain."""


def armed(state: VehicleState) -> Finding:
    """Whether the vehicle is already armed."""
    if state.armed:
        return Finding(
            Key.ARMED,
            UNSAFE,
            "the vehicle is already armed",
            fix="land and disarm it first",
            source="HEARTBEAT",
        )
    return Finding(Key.ARMED, SAFE, "the vehicle is disarmed", source="HEARTBEAT")


def battery(config: Config, state: VehicleState) -> Finding:
    """Whether the battery has enough charge, as far as the vehicle reports it."""
    remaining = None if state.battery is None else state.battery.remaining
    min_percent = config.limits.min_battery_percent
    source = "BATTERY_STATUS, SYS_STATUS"
    if state.battery_silent:
        return Finding(
            Key.BATTERY,
            UNSAFE,
            "the vehicle no longer reports its battery",
            "an empty battery would not be noticed",
            "find what blocks or delays the messages",
            source,
        )
    if remaining is None:
        return Finding(
            Key.BATTERY,
            INEFFECTIVE,
            "the vehicle does not report its battery's charge",
            "limits.min_battery_percent has no effect",
            "set the battery's capacity or number of cells in the autopilot",
            source,
        )
    if remaining < config.limits.min_battery:
        return Finding(
            Key.BATTERY,
            UNSAFE,
            f"battery at {100 * remaining:.0f} %, below "
            f"limits.min_battery_percent = {min_percent:g}",
            fix="charge it",
            source=source,
        )
    return Finding(Key.BATTERY, SAFE, f"battery at {100 * remaining:.0f} %", source=source)


def disarmed_on_ground(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the vehicle is disarmed before a flight begins."""
    if evidence.stage is Stage.GROUND:
        yield armed(evidence.state)


def battery_charge(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the battery has enough charge; not ready while a booting vehicle reports none."""
    if evidence.is_booting and evidence.state.battery is None:
        yield Finding(
            Key.BATTERY, NOT_READY, "the vehicle has not reported its battery's charge yet"
        )
    else:
        yield battery(config, evidence.state)


def failsafe(state: VehicleState) -> Iterator[Finding]:
    """Whether the autopilot is in a failsafe."""
    if state.failsafe:
        yield Finding(
            Key.FAILSAFE,
            UNSAFE,
            "the autopilot is in a failsafe",
            "the autopilot does what the failsafe asks for, not what we ask",
            "clear its cause first",
            "HEARTBEAT system_status",
        )


def readiness(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the autopilot is ready; if not, its own reasons."""
    state, stage = evidence.state, evidence.stage
    yield from failsafe(state)
    ready_state = state.readiness
    if stage is Stage.AIRBORNE:  # the pre-arm checks no longer apply
        ready_state = ready_state._replace(prearm_passed=True)
    missing_condition = evidence.autopilot.why_not_ready(ready_state)
    texts = "; ".join(dict.fromkeys(evidence.warnings))
    if missing_condition is not None:
        awaited = evidence.awaited_messages
        unsent = f", and does not send {', '.join(awaited)} yet" if awaited else ""
        yield Finding(
            Key.READY,
            NOT_READY,
            f"not ready {stage.value}, it lacks {missing_condition}{unsent}",
            f"the autopilot says: {texts}" if texts else "",
            "wait, or correct what the autopilot reports, and try again",
            "SYS_STATUS, estimator flags",
        )
        return
    flags = state.estimator.flags if state.estimator else 0
    fact = f"ready {stage.value}, estimator flags 0x{flags:x}"
    yield Finding(Key.READY, SAFE, fact, source="SYS_STATUS, estimator flags")
    if texts:
        yield Finding(
            Key.AUTOPILOT_TEXTS, SAFE, f"the autopilot says: {texts}", source="STATUSTEXT, EVENT"
        )


def gps(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether a GPS that had a fix still has it."""
    fault, newest, source = evidence.state.gps_fault, evidence.state.gps, "GPS_RAW_INT"
    if fault is not None:
        satellites = None if newest is None else newest.satellites
        yield Finding(
            Key.GPS,
            UNSAFE,
            fault
            if satellites is None
            else f"{fault}; satellites in its last message: {satellites}",
            "the vehicle does not know where it is",
            "wait for a GPS fix, with a clear view of the sky",
            source,
        )


def ground(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the vehicle stands on the ground, at the height of home."""
    state, source = evidence.state, "EXTENDED_SYS_STATE, LOCAL_POSITION_NED, HOME_POSITION"
    if evidence.stage is Stage.AIRBORNE:
        return
    if not state.landed:
        yield Finding(
            Key.LANDED,
            UNSAFE if state.flying else NOT_READY,
            "the vehicle reports that it flies"
            if state.flying
            else "the autopilot does not report that the vehicle is on the ground",
            "a flight that takes off must begin on the ground",
            "land it first, or find why EXTENDED_SYS_STATE does not report the ground",
            "EXTENDED_SYS_STATE",
        )
    height = state.height
    if height is not None and abs(height) > GROUND_HEIGHT:
        yield Finding(
            Key.HOME,
            UNSAFE,
            f"the vehicle reports that it stands {height_in_words(height)}",
            "flight.takeoff_height_m and limits.fence_floor_m would be wrong",
            "have the autopilot set home here",
            source,
        )


def attitude(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the attitude samples are usable."""
    unusable, count = evidence.samples.unusable_count, evidence.samples.sample_count
    if unusable:
        yield Finding(
            Key.ATTITUDE,
            UNSAFE if unusable > _MAX_UNUSABLE_SHARE * count else INEFFECTIVE,
            f"{unusable} of {count} attitude samples are no unit quaternion of finite numbers",
            "they are not answered, and if that lasts, the vehicle is handed back",
            "wait until the estimator has settled; if this goes on, do not fly",
            "ATTITUDE_QUATERNION",
        )


def estimator(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the estimator was reset while we listened."""
    if evidence.reset_count:
        yield Finding(
            Key.ESTIMATOR_RESETS,
            INEFFECTIVE,
            f"the estimate jumped {evidence.reset_count} times in {evidence.counting_time:g} s",
            "in flight, repeated jumps raise the alarm of the monitor `resets`",
            "wait until compass and GPS have settled",
            "ODOMETRY reset_counter",
        )


def fence(config: Config, evidence: Evidence) -> Iterator[Finding]:
    """Whether the vehicle stands inside a fence given by latitude and longitude."""
    corners, position = config.safety.fence_polygon_deg, evidence.state.global_position
    if not corners:
        return
    source = "GLOBAL_POSITION_INT"
    if position is None:
        yield Finding(
            Key.FENCE,
            NOT_READY if evidence.awaits_position else UNSAFE,
            "the vehicle does not report its latitude and longitude",
            "it is unknown whether the vehicle is inside safety.fence_polygon_deg",
            "wait for GPS",
            source,
        )
        return
    vehicle_lat_lon = LatLon(position.latitude_deg, position.longitude_deg)
    if inside(0.0, 0.0, local_polygon(corners, vehicle_lat_lon)):
        yield Finding(Key.FENCE, SAFE, "the vehicle stands inside its fence", source=source)
        return
    yield Finding(
        Key.FENCE,
        UNSAFE,
        f"the vehicle is at {vehicle_lat_lon.latitude:.5f}, {vehicle_lat_lon.longitude:.5f}, "
        "outside safety.fence_polygon_deg",
        "the flight would end as soon as it began",
        "bring it inside, or correct the corners: each is [latitude, longitude]",
        source,
    )


def version(_: Config, evidence: Evidence) -> Iterator[Finding]:
    """The autopilot's version, and whether it accepts our setpoints."""
    identity, name = evidence.identity, evidence.autopilot.name
    if identity.version is None or identity.capabilities is None:
        yield Finding(
            Key.VERSION,
            INEFFECTIVE,
            f"{name} does not report its version",
            "the behaviour of this version is unknown",
            "update the autopilot's firmware: newer versions report theirs",
            "AUTOPILOT_VERSION",
        )
    elif not identity.capabilities & dialect.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET:
        yield Finding(
            Key.VERSION,
            INEFFECTIVE,
            f"{name} {identity.version} does not take SET_ATTITUDE_TARGET",
            "it is the only setpoint that we send",
            "use a newer version, or a build with offboard control",
            "AUTOPILOT_VERSION capabilities",
        )
    else:
        fact = f"{name} {identity.version}"
        yield Finding(Key.VERSION, SAFE, fact, source="AUTOPILOT_VERSION")
