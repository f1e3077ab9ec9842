"""What the control loop receives from the link."""

from typing import NamedTuple

from companion.attitude.types import BodyRates, Quaternion
from companion.vehicle.clock import Misfit


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
