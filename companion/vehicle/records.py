"""Records of the vehicle's telemetry, each with its time of arrival."""

from typing import NamedTuple

from companion.attitude.types import BodyRates, Quaternion
from companion.vehicle.clock_jumps import Misfit

Vector = tuple[float, float, float]

_LASTS = 5.0
"""Telemetry that comes at 1 Hz or faster counts as unknown after this time without it, s."""


def outdated(received: float, now: float) -> bool:
    """Whether a status from `received` is too old at `now` to count; both in s of our clock."""
    return now - received > _LASTS


GPS_FIX_3D = 3
"""Of GPS_FIX_TYPE, this and above."""


class AttitudeSample(NamedTuple):
    """One ATTITUDE_QUATERNION, every number finite; the norm of `q` is not judged here.

    Attributes:
        time_boot_ms: The vehicle's time stamp as it came, ms since its boot.
        vehicle_time: The same in s; the control law's clock. It goes on where the vehicle's clock
            jumps or restarts.
        received: Event-loop time of arrival, s; the watchdogs' clock.
        received_ns: `time.perf_counter_ns()` at which it reached this computer (over UDP, by the
            kernel's stamp) or was read; for latency.
        q: Attitude (w, x, y, z), body FRD -> world NED.
        body_rates: Measured rates about body x, y, z, rad/s.
        age: How old it was when it arrived, s, as `VehicleClock` says; NaN for a misfit.
        misfit: Why it does not fit the vehicle's clock and must not be used, or None.
        age_known: Whether `age` is absolute; else it counts from the quickest sample's.
    """

    time_boot_ms: int
    vehicle_time: float
    received: float
    received_ns: int
    q: Quaternion
    body_rates: BodyRates
    age: float = 0.0
    misfit: Misfit | None = None
    age_known: bool = False


class Heartbeat(NamedTuple):
    """HEARTBEAT of the autopilot.

    Attributes:
        received: Event-loop time, s.
        autopilot: MAV_AUTOPILOT.
        vehicle_type: MAV_TYPE.
        mode: The autopilot's name for the mode.
        custom_mode: The same as a number.
        armed: Motors may turn.
        system_status: MAV_STATE: 3 standby, 4 active, 5 critical (failsafe).
    """

    received: float
    autopilot: int
    vehicle_type: int
    mode: str
    custom_mode: int
    armed: bool
    system_status: int


class CurrentMode(NamedTuple):
    """CURRENT_MODE of the autopilot.

    Attributes:
        received: Event-loop time, s.
        mode: The autopilot's name for the mode.
        intended: The mode that the user commanded last; differs while a failsafe acts.
    """

    received: float
    mode: str
    intended: str


class LocalPosition(NamedTuple):
    """LOCAL_POSITION_NED.

    Attributes:
        received: Event-loop time, s.
        vehicle_time: The vehicle's time stamp, s, on the clock of `AttitudeSample.vehicle_time`.
        position_ned: m.
        velocity_ned: m/s.
    """

    received: float
    vehicle_time: float
    position_ned: Vector
    velocity_ned: Vector


class Landed(NamedTuple):
    """EXTENDED_SYS_STATE.

    Attributes:
        received: Event-loop time, s.
        state: MAV_LANDED_STATE: 1 on ground, 2 in air, 3 taking off, 4 landing.
    """

    received: float
    state: int


class GlobalPosition(NamedTuple):
    """GLOBAL_POSITION_INT.

    Attributes:
        received: Event-loop time, s.
        latitude_deg: WGS84.
        longitude_deg: WGS84.
    """

    received: float
    latitude_deg: float
    longitude_deg: float


class Battery(NamedTuple):
    """SYS_STATUS and BATTERY_STATUS; `None` where the vehicle does not know.

    Attributes:
        received: Event-loop time, s.
        voltage_v: Of the whole battery, V.
        remaining: 0..1.
    """

    received: float
    voltage_v: float | None
    remaining: float | None


class AttitudeTargetThrust(NamedTuple):
    """ATTITUDE_TARGET: the setpoint of the autopilot's attitude and rate control, from any source.

    Attributes:
        received: Event-loop time, s.
        thrust: Collective, 0..1.
    """

    received: float
    thrust: float


class AttitudeTarget(NamedTuple):
    """ATTITUDE_TARGET: the attitude along whose axes the autopilot takes body rates.

    Attributes:
        time_boot_ms: The vehicle's time stamp as it came, ms since its boot.
        q: Body FRD -> world NED, of unit length.
    """

    time_boot_ms: int
    q: Quaternion


class Gps(NamedTuple):
    """GPS_RAW_INT.

    Attributes:
        received: Event-loop time, s.
        fix_type: GPS_FIX_TYPE; 3 or more is a 3D fix.
        satellites: Number in use; `None`: unknown.
        altitude_m: Above mean sea level, m.
    """

    received: float
    fix_type: int
    satellites: int | None
    altitude_m: float


def gps_fault(gps: Gps | None, now: float) -> str | None:
    """What is wrong at `now`, s of our clock, with a GPS that had a 3D fix; `None`: nothing."""
    if gps is None or outdated(gps.received, now):
        return "GPS is not reported any more"
    return "GPS position lost" if gps.fix_type < GPS_FIX_3D else None


class Prearm(NamedTuple):
    """SYS_STATUS: the autopilot's own pre-arm checks.

    Attributes:
        received: Event-loop time, s.
        good: They pass.
    """

    received: float
    good: bool


class Home(NamedTuple):
    """HOME_POSITION.

    Attributes:
        received: Event-loop time, s.
        latitude_deg: WGS84.
        longitude_deg: WGS84.
        altitude_m: Above mean sea level, m.
        down: In the local frame of LOCAL_POSITION_NED, m.
    """

    received: float
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    down: float


class Estimator(NamedTuple):
    """ESTIMATOR_STATUS, or EKF_STATUS_REPORT, whose flags mean the same.

    Attributes:
        received: Event-loop time, s.
        flags: ESTIMATOR_STATUS_FLAGS.
    """

    received: float
    flags: int
