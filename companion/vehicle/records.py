"""Records of the vehicle's telemetry; `received` is the event-loop time of arrival, s."""

from typing import NamedTuple

from companion.attitude.types import BodyRates, Quaternion
from companion.vehicle.clock_jumps import Misfit

Vector = tuple[float, float, float]

MAX_TELEMETRY_AGE = 5.0
"""Age from which telemetry counts as unknown, s; every message should come at 1 Hz or faster."""

_MAX_KEPT_CHARGE_AGE = 1.5
"""Age up to which a charge is kept although a newer message lacks it, s.

The charge is in SYS_STATUS and BATTERY_STATUS, which come at 1 Hz or faster."""


def is_outdated(received: float, now: float) -> bool:
    """Whether telemetry received at `received` is too old at `now`; both are loop times, s."""
    return now - received > MAX_TELEMETRY_AGE


GPS_FIX_3D = 3
"""GPS_FIX_TYPE of a 3D fix; higher numbers are 3D fixes too."""


class AttitudeSample(NamedTuple):
    """One ATTITUDE_QUATERNION. All numbers are finite; the norm of `q` has not been checked."""

    time_boot_ms: int
    """The vehicle's time stamp as received, ms since its boot."""
    vehicle_time: float
    """Time stamp for the control laws, s, without jumps and restarts of the vehicle's clock."""
    received: float
    """Event-loop time of arrival, s, for the watchdogs."""
    received_ns: int
    """`time.perf_counter_ns()` of arrival, to measure latency. Over UDP it is the time at which the
    kernel received the datagram, otherwise the time of reading."""
    q: Quaternion
    """Attitude (w, x, y, z), body FRD -> world NED."""
    body_rates: BodyRates
    """Measured rates about body x, y, z, rad/s."""
    age: float = 0.0
    """Age at arrival by `VehicleClock`, s; NaN for a misfit."""
    misfit: Misfit | None = None
    """Why the sample does not fit the vehicle's clock and must not be used, or None."""
    age_known: bool = False
    """See `VehicleClock.age_known`."""


class Heartbeat(NamedTuple):
    """HEARTBEAT of the autopilot."""

    received: float
    mode: str
    """The autopilot's name for the mode."""
    armed: bool
    system_status: int
    """MAV_STATE: 3 standby, 4 active; 5 critical, 6 emergency, 8 termination."""


class CurrentMode(NamedTuple):
    """CURRENT_MODE of the autopilot."""

    received: float
    mode: str
    """The autopilot's name for the mode."""
    intended: str
    """The mode that the user commanded last; it differs from `mode` while a failsafe acts."""


class LocalPosition(NamedTuple):
    """LOCAL_POSITION_NED."""

    received: float
    vehicle_time: float
    """The vehicle's time stamp, s, on the clock of `AttitudeSample.vehicle_time`."""
    position_ned: Vector
    """Position, m NED."""
    velocity_ned: Vector
    """Velocity, m/s NED."""


class LandedState(NamedTuple):
    """EXTENDED_SYS_STATE."""

    received: float
    state: int
    """MAV_LANDED_STATE: 1 on ground, 2 in air, 3 taking off, 4 landing."""


class GlobalPosition(NamedTuple):
    """GLOBAL_POSITION_INT."""

    received: float
    latitude_deg: float
    """Latitude (WGS84), °."""
    longitude_deg: float
    """Longitude (WGS84), °."""


class Battery(NamedTuple):
    """SYS_STATUS or BATTERY_STATUS; a value that the vehicle does not know is `None`."""

    received: float
    voltage_v: float | None
    """Voltage of the whole battery, V."""
    remaining: float | None
    """Remaining charge, 0..1."""
    charge_received: float | None = None
    """Event-loop time at which a charge was last received, s."""

    def replaced_by(self, newer: "Battery") -> "Battery":
        """The newer record; if it lacks a charge, with the charge of this record.

        Some vehicles send the charge only in SYS_STATUS or only in BATTERY_STATUS. A charge is kept
        for `_MAX_KEPT_CHARGE_AGE`.
        """
        if newer.remaining is not None or self.charge_received is None:
            return newer
        is_kept = newer.received - self.charge_received <= _MAX_KEPT_CHARGE_AGE
        return Battery(
            newer.received,
            self.voltage_v if is_kept and newer.voltage_v is None else newer.voltage_v,
            self.remaining if is_kept else None,
            self.charge_received,
        )


class AttitudeTargetThrust(NamedTuple):
    """ATTITUDE_TARGET: the thrust setpoint of the autopilot, whatever its source."""

    received: float
    thrust: float
    """Collective thrust, 0..1."""


class AttitudeTarget(NamedTuple):
    """ATTITUDE_TARGET: ArduPilot's attitude setpoint; the body rates act about its axes."""

    time_boot_ms: int
    """The vehicle's time stamp as received, ms since its boot."""
    q: Quaternion
    """Attitude (w, x, y, z), body FRD -> world NED, of unit norm."""


class Gps(NamedTuple):
    """GPS_RAW_INT."""

    received: float
    fix_type: int
    """GPS_FIX_TYPE; 3 or more is a 3D fix."""
    satellites: int | None
    """Number of satellites; `None`: unknown."""
    altitude_m: float
    """Altitude above mean sea level, m."""


def gps_fault(gps: Gps | None, now: float) -> str | None:
    """Fault of a GPS that had a 3D fix, in words, at loop time `now` (s); `None`: no fault."""
    if gps is None or is_outdated(gps.received, now):
        return "GPS is not reported any more"
    return "GPS position lost" if gps.fix_type < GPS_FIX_3D else None


class PrearmStatus(NamedTuple):
    """SYS_STATUS: the autopilot's own pre-arm checks."""

    received: float
    passed: bool
    """Whether the checks pass."""


class Home(NamedTuple):
    """HOME_POSITION."""

    received: float
    latitude_deg: float
    """Latitude (WGS84), °."""
    longitude_deg: float
    """Longitude (WGS84), °."""
    altitude_m: float
    """Altitude above mean sea level, m."""
    down: float
    """Down coordinate in the frame of LOCAL_POSITION_NED, m."""


class EstimatorStatus(NamedTuple):
    """ESTIMATOR_STATUS (PX4) or EKF_STATUS_REPORT (ArduPilot), whose flags mean the same."""

    received: float
    flags: int
    """ESTIMATOR_STATUS_FLAGS."""
