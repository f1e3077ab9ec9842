"""What the control loop receives from the link."""

from typing import NamedTuple

from companion.attitude.types import BodyRates, Quaternion


class AttitudeSample(NamedTuple):
    """One ATTITUDE_QUATERNION, every number finite; the norm of `q` is not judged here.

    Attributes:
        time_boot_ms: The vehicle's time stamp as it came, ms since its boot.
        vehicle_time: The same in s; the control law's clock.
        received: Event-loop time of arrival, s; the watchdogs' clock.
        received_ns: `time.perf_counter_ns()` at which it reached this computer (over UDP, by the
            kernel's stamp) or was read; for latency.
        q: Attitude (w, x, y, z), body FRD -> world NED.
        body_rates: Measured rates about body x, y, z, rad/s.
    """

    time_boot_ms: int
    vehicle_time: float
    received: float
    received_ns: int
    q: Quaternion
    body_rates: BodyRates
