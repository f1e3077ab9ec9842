"""Records of the vehicle's telemetry, each with its time of arrival."""

from typing import NamedTuple

from companion.attitude.types import BodyRates, Quaternion
from companion.vehicle.clock_jumps import Misfit

Vector = tuple[float, float, float]

_MAX_TELEMETRY_AGE = 5.0
"""Age from which telemetry counts as unknown, s; every message should come at 1 Hz or faster."""

_MAX_CHARGE_AGE = 1.5
"""Age up to which a charge is kept although a newer message lacks it, s.

The charge is in SYS_STATUS and BATTERY_STATUS, which come at 1 Hz or faster."""


def outdated(received: float, now: float) -> bool:
    """Whether telemetry received at `received` is too old at `now`; both are loop times, s."""
    return now - received > _MAX_TELEMETRY_AGE


GPS_FIX_3D = 3
"""GPS_FIX_TYPE of a 3D fix; higher numbers are 3D fixes too."""


class AttitudeSample(NamedTuple):
    """One ATTITUDE_QUATERNION. All numbers are finite; the norm of `q` has not been checked.

    Attributes:
        time_boot_ms: The vehicle's time stamp as received, ms since its boot.
        vehicle_time: The time stamp in s, without jumps and restarts of the vehicle's clock. The
            control laws use it.
        received: Event-loop time of arrival, s. The watchdogs use it.
        received_ns: `time.perf_counter_ns()` of arrival, to measure latency. Over UDP it is the
            time at which the kernel received the datagram, otherwise the time of reading.
        q: Attitude (w, x, y, z), body FRD -> world NED.
        body_rates: Measured rates about body x, y, z, rad/s.
        age: Age at arrival by `VehicleClock`, s; NaN for a misfit.
        misfit: Why the sample does not fit the vehicle's clock and must not be used, or None.
        age_known: Whether `age` is absolute; see `VehicleClock.age_known`.
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
        mode: The autopilot's name for the mode.
        custom_mode: The autopilot's number for the mode.
        armed: Whether the vehicle is armed.
        system_status: MAV_STATE: 3 standby, 4 active; 5 critical, 6 emergency, 8 termination.
    """

    received: float
    autopilot: int
    mode: str
    custom_mode: int
    armed: bool
    system_status: int


class CurrentMode(NamedTuple):
    """CURRENT_MODE of the autopilot.

    Attributes:
        received: Event-loop time, s.
        mode: The autopilot's name for the mode.
        intended: The mode that the user commanded last; it differs while a failsafe acts.
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


class LandedState(NamedTuple):
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
    """SYS_STATUS or BATTERY_STATUS; a value that the vehicle does not know is `None`.

    Attributes:
        received: Event-loop time, s.
        voltage_v: Voltage of the whole battery, V.
        remaining: Remaining charge, 0..1.
        charge_received: Event-loop time at which a charge was last received, s.
    """

    received: float
    voltage_v: float | None
    remaining: float | None
    charge_received: float | None = None

    def replaced_by(self, newer: "Battery") -> "Battery":
        """The newer record; a charge that it lacks is taken from this one.

        Some vehicles send the charge in one of the two messages only. It is kept for
        `_MAX_CHARGE_AGE`.
        """
        if newer.remaining is not None:
            return newer
        if self.remaining is None or newer.received - self.received > _MAX_CHARGE_AGE:
            return newer._replace(charge_received=self.charge_received)
        return self if newer.voltage_v is None else self._replace(voltage_v=newer.voltage_v)


class AttitudeTargetThrust(NamedTuple):
    """ATTITUDE_TARGET: the thrust setpoint of the autopilot, whatever its source.

    Attributes:
        received: Event-loop time, s.
        thrust: Collective thrust, 0..1.
    """

    received: float
    thrust: float


class AttitudeTarget(NamedTuple):
    """ATTITUDE_TARGET: the attitude along whose axes the autopilot takes body rates.

    Attributes:
        time_boot_ms: The vehicle's time stamp as received, ms since its boot.
        q: Attitude (w, x, y, z), body FRD -> world NED, of unit norm.
    """

    time_boot_ms: int
    q: Quaternion


class Gps(NamedTuple):
    """GPS_RAW_INT.

    Attributes:
        received: Event-loop time, s.
        fix_type: GPS_FIX_TYPE; 3 or more is a 3D fix.
        satellites: Number of satellites; `None`: unknown.
        altitude_m: Altitude above mean sea level, m.
    """

    received: float
    fix_type: int
    satellites: int | None
    altitude_m: float


def gps_fault(gps: Gps | None, now: float) -> str | None:
    """Fault of a GPS that had a 3D fix, in words, at loop time `now` (s); `None`: no fault."""
    if gps is None or outdated(gps.received, now):
        return "GPS is not reported any more"
    return "GPS position lost" if gps.fix_type < GPS_FIX_3D else None


class Prearm(NamedTuple):
    """SYS_STATUS: the autopilot's own pre-arm checks.

    Attributes:
        received: Event-loop time, s.
        good: Whether the checks pass.
    """

    received: float
    good: bool


class Home(NamedTuple):
    """HOME_POSITION.

    Attributes:
        received: Event-loop time, s.
        latitude_deg: WGS84.
        longitude_deg: WGS84.
        altitude_m: Altitude above mean sea level, m.
        down: Down coordinate in the frame of LOCAL_POSITION_NED, m.
    """

    received: float
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    down: float


class Estimator(NamedTuple):
    """ESTIMATOR_STATUS (PX4) or EKF_STATUS_REPORT (ArduPilot), whose flags mean the same.

    Attributes:
        received: Event-loop time, s.
        flags: ESTIMATOR_STATUS_FLAGS.
    """

    received: float
    flags: int
