"""Rows of the control loop and of guidance, for the measurements in flight and after it.

The rows have the columns of the channels of `flight.mcap`, so a recorded flight gives the same rows
(`recorded_summary.trace_of`).
"""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from companion.recording.mcap_file.channels import MOTION
from companion.recording.mcap_file.loop_channels import QUATERNION, rate_names, vector_names
from companion.recording.measurements.verdict import LOST_ROWS
from companion.recording.recorder import FlightRecorder
from companion.recording.series import Series, Spool

_RATE_ROWS_IN_MEMORY = 10_240
"""Number of rows of `FlightTrace.rates` kept in memory for reading in flight: 10 s at 1000 Hz."""

SENT_COLUMNS = ("vehicle_time_s", "received_s", *rate_names("commanded"), "thrust")
"""Columns of SETPOINT, with which a row of `FlightTrace.rates` begins."""
ANSWERED_COLUMNS = (*rate_names("measured"), "age_s")
"""Columns of SAMPLE, with which a row of `FlightTrace.rates` ends."""
RATE_COLUMNS = SENT_COLUMNS + ANSWERED_COLUMNS
RESPONSE_COLUMNS = ("vehicle_time_s", *QUATERNION, "target_north", "target_east")
"""Columns of SETPOINT, which form a row of `FlightTrace.response`."""
TRACKING_COLUMNS = (
    "vehicle_time_s",
    *vector_names("reference", "m"),
    *vector_names("measured", "m"),
)


class ManeuverChange(NamedTuple):
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
        response: rows of RESPONSE_COLUMNS, only during steps.
        tracking: (vehicle time s, reference north, east, down, estimated north, east, down m) while
            offboard control is active; NaN: there is no reference along this axis.
        rates: rows of RATE_COLUMNS while the vehicle's heartbeats show offboard control; `age_s` is
            NaN unless the age is absolute (`AttitudeSample.age_known`).
        latencies_ns: latencies from sample to setpoint inside this process, ns.
        motion: rows of MOTION, ten times a second in all phases.
        maneuvers: beginning of each maneuver, and end of the last one.
    """

    def __init__(self, folder: Path | None = None, recorder: FlightRecorder | None = None) -> None:
        self.recorder = recorder
        self._spool = Spool(folder)
        self.response = Series(RESPONSE_COLUMNS, self._spool)
        self.tracking = Series(TRACKING_COLUMNS, self._spool)
        self.rates = Series(RATE_COLUMNS, self._spool, rows_in_memory=_RATE_ROWS_IN_MEMORY)
        self.latencies_ns = Series(("latency_ns",), self._spool)
        self.motion = Series(MOTION.columns, self._spool)
        self.maneuvers: list[ManeuverChange] = []

    def add_motion(self, time: float, row: Iterable[float]) -> None:
        """Record a row of `motion` at `time`, s on our clock."""
        numbers = list(row)
        self.motion.add(numbers)
        if self.recorder is not None:
            self.recorder.row(time, MOTION, numbers)

    def begin_maneuver(self, time: float, vehicle_time: float, name: str | None) -> None:
        """Record the beginning of a maneuver (None: end of the last one); see `ManeuverChange`."""
        self.maneuvers.append(ManeuverChange(time, vehicle_time, name))
        if self.recorder is not None:
            self.recorder.maneuver(time, vehicle_time, name)

    def lost_rows_warning(self) -> str | None:
        """A warning for the user if rows were lost, else None."""
        all_series = self.response, self.tracking, self.rates, self.latencies_ns, self.motion
        lost_count = sum(series.lost_count for series in all_series)
        if lost_count == 0:
            return None
        reason = self._spool.failure or "the disk was too slow"
        return f"{lost_count} {LOST_ROWS}: {reason}"
