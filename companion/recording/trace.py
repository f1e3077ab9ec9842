"""What control did, sample by sample, kept in memory for the measurements after the flight."""

from array import array
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from companion.attitude import BodyRates, Quaternion, Target

_MAX_SAMPLES = 500_000
"""Half an hour at 250 Hz; later samples are not measured, only recorded in the tlog."""

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
)


@dataclass(slots=True)
class FlightTrace:
    """Rows of plain numbers, appended in flight; `fromlist` takes half the time that `extend` does.

    Attributes:
        response: rows (vehicle time s, w, x, y, z, target north, target east), of steps only.
        tracking: rows (vehicle time s, reference north, east, down, measured north, east, down).
        rates: rows (vehicle time s, when it was received on our clock s, commanded roll, pitch, yaw
            rad/s, thrust 0..1, measured roll, pitch, yaw rad/s), while the autopilot obeys us,
            for all that its heartbeats tell. Once full, a new row takes the oldest one's place.
        rates_count: rows of `rates` that were ever noted.
        latencies_ns: sample in → setpoint out inside this process, ns.
    """

    response: "array[float]" = field(default_factory=lambda: array("d"))
    tracking: "array[float]" = field(default_factory=lambda: array("d"))
    rates: "array[float]" = field(default_factory=lambda: array("d"))
    rates_count: int = 0
    latencies_ns: "array[int]" = field(default_factory=lambda: array("q"))

    def add_response(self, vehicle_time: float, q: Quaternion, target: Target) -> None:
        """Note an attitude sample that was answered during a step."""
        if len(self.response) < len(_RESPONSE) * _MAX_SAMPLES:
            self.response.fromlist([vehicle_time, *q, target.north, target.east])

    def add_tracking(
        self,
        vehicle_time: float,
        reference: tuple[float, float, float],
        measured: tuple[float, float, float],
    ) -> None:
        """Note where the vehicle ought to be and where it is (NED, m)."""
        if len(self.tracking) < len(_TRACKING) * _MAX_SAMPLES:
            self.tracking.fromlist([vehicle_time, *reference, *measured])

    def add_rates(
        self,
        vehicle_time: float,
        received: float,
        commanded: BodyRates,
        thrust: float,
        measured: BodyRates,
    ) -> None:
        """Note what was answered to a sample, and the rates that the sample told."""
        row = [vehicle_time, received, *commanded, thrust, *measured]
        if self.rates_count < _MAX_SAMPLES:
            self.rates.fromlist(row)
        else:
            start = self.rates_count % _MAX_SAMPLES * len(_RATES)
            self.rates[start : start + len(_RATES)] = array("d", row)
        self.rates_count += 1

    def add_latency(self, nanoseconds: int) -> None:
        """Note how long one answer took."""
        if len(self.latencies_ns) < _MAX_SAMPLES:
            self.latencies_ns.append(nanoseconds)

    def save(self, folder: Path) -> None:
        """Write `response.csv`, `tracking.csv` and `rates.csv`, those that have rows.

        Raises:
            OSError: a file cannot be written.
        """
        for name, columns, rows in (
            ("response.csv", _RESPONSE, self.response_rows()),
            ("tracking.csv", _TRACKING, self.tracking_rows()),
            ("rates.csv", _RATES, self.rates_rows()),
        ):
            if len(rows):
                header = ",".join(columns)
                np.savetxt(folder / name, rows, "%.9g", ",", header=header, comments="")

    def response_rows(self) -> NDArray[np.float64]:
        """(N, 7), as `response`."""
        return np.array(self.response).reshape(-1, len(_RESPONSE))

    def tracking_rows(self) -> NDArray[np.float64]:
        """(N, 7), as `tracking`."""
        return np.array(self.tracking).reshape(-1, len(_TRACKING))

    def rates_rows(self, since: int = 0) -> NDArray[np.float64]:
        """(N, 9), as `rates`, from row `since` of all that were noted on; older ones are gone."""
        width, count = len(_RATES), self.rates_count
        first = max(since, count - _MAX_SAMPLES)
        begin, end = first % _MAX_SAMPLES * width, count % _MAX_SAMPLES * width
        if first < count and begin >= end:  # the newest stand before the oldest
            rows = self.rates[begin:] + self.rates[:end]
        else:
            rows = self.rates[begin:end]
        return np.array(rows).reshape(-1, width)
