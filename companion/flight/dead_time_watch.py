"""Measures the dead time of the body rates, repeatedly in flight and once over the whole flight."""

from collections import deque
from collections.abc import Callable, Mapping
from math import inf

import numpy as np
from numpy.typing import NDArray

from companion.config.vehicle import AxisKeys
from companion.identification import dead_time_by_correlation
from companion.recording.mcap_file.loop_channels import rate_names
from companion.recording.measurements.dead_time import AxisDeadTime, DeadTimes, SampleAge
from companion.recording.trace import RATE_COLUMNS, FlightTrace
from companion.safety.actions import fault_message

_MEASURING_PERIOD = 2.0
"""Time between two measurements, s; the axes take turns."""
_WINDOW_PERIODS = 4
"""Length of the window of a measurement, in periods of `_MEASURING_PERIOD`; the first window is one
period shorter."""
_MIN_ROW_AGE = 1.5
"""Smallest age of the records used, s. Newer ones may come from after the end of offboard mode,
which the autopilot has not reported yet."""
_MAX_ROWS = 75_000
"""Largest number of records for the measurement after the flight: 5 min at 250 Hz."""
_AXES = ("roll", "pitch", "yaw")
_TIME_COLUMN, _AGE_COLUMN = RATE_COLUMNS.index("vehicle_time_s"), RATE_COLUMNS.index("age_s")


class DeadTimeWatch:
    """Correlates commanded and measured rates; warns once if a configured dead time is wrong.

    A measurement runs right after a setpoint was sent, when the time until the next sample is
    longest, and takes 1 ms (2 to 3 ms on an axis with an acceleration limit). In a thread of its
    own, a measurement could delay a setpoint by 5 ms.

    Args:
        trace: records of the flight, with the commanded and the measured body rates.
        axes: configured response of "roll", "pitch" and "yaw".
        note: called with the warning.
    """

    def __init__(
        self, trace: FlightTrace, axes: Mapping[str, AxisKeys], note: Callable[[str], None]
    ) -> None:
        self._trace = trace
        self._axes = axes
        self._note = note
        self._due_at = -inf
        self._measurement_count = 0
        # Number of rows at each of the latest measurements.
        self._row_counts = deque([0], maxlen=_WINDOW_PERIODS + 1)
        self._suspected_axes: set[str] = set()
        self._warned = False
        time = np.arange(0.0, 3.0, 0.01)
        dead_time_by_correlation(time, np.sin(time), time, np.sin(time))  # the first use is slow

    def after_setpoint(self, now: float) -> None:
        """Measure the dead time of the next axis, if due at `now`, s of event-loop time."""
        if now < self._due_at:
            return
        self._due_at = now + _MEASURING_PERIOD
        try:
            self._measure_next_axis()
        except Exception as error:  # a mere measurement must not end a flight
            self._due_at = inf
            self._note(f"the dead time is no longer measured: {fault_message(error)}")

    def _measure_next_axis(self) -> None:
        self._row_counts.append(len(self._trace.rates))
        if len(self._row_counts) > _WINDOW_PERIODS:
            first_row = self._row_counts[0]
            name = _AXES[self._measurement_count % len(_AXES)]
            self._measurement_count += 1
            self._check_axis(name, self._dead_time(name, self._trace.rates.rows(first_row)))

    def measure_whole_flight(self) -> DeadTimes:
        """Measure the dead times over the last `_MAX_ROWS` records of the flight.

        Warn if a configured dead time is wrong, unless a warning was given already.
        """
        first_row = max(0, len(self._trace.rates) - _MAX_ROWS)
        rows = self._trace.rates.rows(first_row)
        ages = rows[:, _AGE_COLUMN]
        ages = ages[np.isfinite(ages)]
        measured = DeadTimes(
            {name: self._dead_time(name, rows) for name in _AXES},
            SampleAge(*np.percentile(ages, (50, 99)).tolist()) if ages.size else SampleAge(),
            lag_known=any(axis.lag is not None for axis in self._axes.values()),
        )
        self._warn_once(measured)
        return measured

    def _dead_time(self, name: str, rows: NDArray[np.float64]) -> AxisDeadTime:
        """Measured and configured dead time of one axis."""
        axis, dead_time = self._axes[name], None
        if axis.lag is not None:
            axis_number = _AXES.index(name)
            commanded, measured = (
                RATE_COLUMNS.index(rate_names(which)[axis_number])
                for which in ("commanded", "measured")
            )
            time, commanded_rates, measured_rates = rows[:, [_TIME_COLUMN, commanded, measured]].T
            is_old_enough = time < time[-1:] - _MIN_ROW_AGE
            dead_time = dead_time_by_correlation(
                time[is_old_enough],
                commanded_rates[is_old_enough],
                time[is_old_enough],
                measured_rates[is_old_enough],
                axis.lag,
                axis.acceleration_limit,
                inf if axis.damping is None else axis.damping,
            )
        return AxisDeadTime(dead_time, axis.dead_time)

    def _check_axis(self, name: str, dead_time: AxisDeadTime) -> None:
        """Warn at the second wrong dead time in a row; a gust may cause a single wrong one."""
        if not dead_time.is_wrong:
            self._suspected_axes.discard(name)
        elif name in self._suspected_axes:
            self._warn_once(DeadTimes({name: dead_time}))
        else:
            self._suspected_axes.add(name)

    def _warn_once(self, dead_times: DeadTimes) -> None:
        warning = dead_times.warning()
        if warning is not None and not self._warned:
            self._warned = True
            self._note(warning)
