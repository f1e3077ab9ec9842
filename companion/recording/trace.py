"""Rows of the control loop and of guidance, for the measurements in flight and after it."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from companion.attitude import BodyRates, Quaternion, Target
from companion.recording.mcap_file.channels import MOTION
from companion.recording.measurements.verdict import LOST_ROWS
from companion.recording.recorder import FlightRecorder
from companion.recording.series import Series, Spool

_KEPT_RATES = 10_240
"""Number of rows of `FlightTrace.rates` kept in memory for reading in flight: 10 s at 1000 Hz."""

_RESPONSE = ("vehicle_time_s", "q_w", "q_x", "q_y", "q_z", "target_north", "target_east")
_TRACKING = (
    "vehicle_time_s",
    *(f"reference_{axis}_m" for axis in ("north", "east", "down")),
    *(f"measured_{axis}_m" for axis in ("north", "east", "down")),
)
_RATES = (
    "vehicle_time_s",
    "received_s",
    *(f"commanded_{axis}_rad_s" for axis in ("roll", "pitch", "yaw")),
    "thrust",
    *(f"measured_{axis}_rad_s" for axis in ("roll", "pitch", "yaw")),
    "age_s",
)
_MOTION = ("time_s", "vehicle_time_s", "height_m", "speed_m_s", "tilt_deg", "error_m")


class ManeuverMark(NamedTuple):
    """The beginning of a maneuver, or the end of the last one."""

    time: float
    """Time on our clock, s."""
    vehicle_time: float
    """Time on the vehicle's clock, s."""
    name: str | None
    """Name of the maneuver; None: the last one has ended."""


class FlightTrace:
    """All rows of one flight.

    Args:
        folder: folder for older rows on the disk; None: they stay in memory. The rows are deleted
            with the trace.
        recorder: see the attribute.

    Attributes:
        recorder: writes `flight.mcap`; None: the flight is not recorded.
        response: (vehicle time s, w, x, y, z, target north, target east), only during steps.
        tracking: (vehicle time s, reference north, east, down, estimated north, east, down m) while
            offboard control is active; NaN: there is no reference along this axis.
        rates: (vehicle time s, arrival on our clock s, commanded roll, pitch, yaw rad/s, thrust
            0..1, measured roll, pitch, yaw rad/s, age of the sample s or NaN), while the
            vehicle's heartbeats show offboard control.
        latencies_ns: latencies from sample to setpoint inside this process, ns.
        motion: (time since the flight began s, vehicle time s, height over home m, speed m/s, tilt
            °, distance from the reference m), ten times a second in all phases; NaN: unknown.
        maneuvers: beginning of each maneuver, and end of the last one.
    """

    def __init__(self, folder: Path | None = None, recorder: FlightRecorder | None = None) -> None:
        self.recorder = recorder
        self._spool = Spool(folder)
        self.response = Series(_RESPONSE, self._spool)
        self.tracking = Series(_TRACKING, self._spool)
        self.rates = Series(_RATES, self._spool, rows_in_memory=_KEPT_RATES)
        self.latencies_ns = Series(("latency_ns",), self._spool)
        self.motion = Series(_MOTION, self._spool)
        self.maneuvers: list[ManeuverMark] = []

    def add_response(self, vehicle_time: float, q: Quaternion, target: Target) -> None:
        """Record an attitude sample and its target during a step."""
        self.response.add([vehicle_time, *q, target.north, target.east])

    def add_tracking(
        self,
        vehicle_time: float,
        reference: tuple[float, float, float],
        estimated: tuple[float, float, float],
    ) -> None:
        """Record reference and estimated position (NED, m)."""
        self.tracking.add([vehicle_time, *reference, *estimated])

    def add_rates(
        self,
        vehicle_time: float,
        received: float,
        commanded: BodyRates,
        thrust: float,
        measured: BodyRates,
        age: float,
    ) -> None:
        """Record the setpoint for a sample, the measured rates, and the age (NaN: unknown)."""
        self.rates.add([vehicle_time, received, *commanded, thrust, *measured, age])

    def add_latency(self, nanoseconds: int) -> None:
        """Record the latency of a setpoint."""
        self.latencies_ns.add([nanoseconds])

    def add_motion(self, time: float, row: Iterable[float]) -> None:
        """Record a row of `motion` at `time`, s on our clock."""
        numbers = list(row)
        self.motion.add(numbers)
        if self.recorder is not None:
            self.recorder.row(time, MOTION, numbers)

    def begin_maneuver(self, time: float, vehicle_time: float, name: str | None) -> None:
        """Record the beginning of a maneuver (None: end of the last one); see `ManeuverMark`."""
        self.maneuvers.append(ManeuverMark(time, vehicle_time, name))
        if self.recorder is not None:
            self.recorder.maneuver(time, vehicle_time, name)

    def lost_rows_warning(self) -> str | None:
        """A warning for the user if rows were lost, else None."""
        all_series = self.response, self.tracking, self.rates, self.latencies_ns, self.motion
        lost = sum(series.lost for series in all_series)
        if lost == 0:
            return None
        why = self._spool.failure or "the disk was too slow"
        return f"{lost} {LOST_ROWS}: {why}"
