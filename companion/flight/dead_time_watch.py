"""How long the vehicle takes to answer, measured all the time: in flight, and over all of it."""

from collections import deque
from collections.abc import Callable
from math import inf, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.flight.ending import internal
from companion.identification import dead_time_by_correlation
from companion.recording.dead_time import AxisDeadTime, DeadTimes, SampleAge
from companion.recording.trace import FlightTrace

_PERIOD = 2.0
"""Between two looks, s. Each is at one axis, so every axis has its turn after three."""
_LOOKS = 4
"""A look is at what was flown within so many periods; the first one is a period early."""
_UNSURE = 1.5
"""So long before the last row the autopilot may have taken over, s: its heartbeat says so later."""
_LONGEST = 75_000
"""The measurement at the end is over so many rows at most, the newest: 5 min at 250 Hz."""
_OFFSETS = 1000
"""The clocks' offset is kept for so many looks: as long as so many rows take at 40 Hz."""
_AXES = ("roll", "pitch", "yaw")
_COMMANDED, _MEASURED = 2, 6
"""Columns of `FlightTrace.rates` at which roll, pitch and yaw begin."""


class RateLoop(NamedTuple):
    """What the configuration says of how one axis answers body rates; None where it does not.

    Attributes:
        lag: s.
        dead_time: s.
        acceleration_limit: rad/s².
    """

    lag: float | None = None
    dead_time: float | None = None
    acceleration_limit: float | None = None


class DeadTimeWatch:
    """Compares commands with the rates that follow, and warns once if the configuration is wrong.

    It looks right after an answer has left, when the longest pause until the next sample begins: a
    look takes about 1 ms (2 to 3 ms behind an acceleration limit), while Python may let what runs
    in a thread hold up a sample for 5 ms.

    Args:
        trace: the flight's rows.
        rate_loops: of roll, pitch and yaw.
        clock_offset: vehicle time minus ours in s, None while it is not known.
        note: takes the warning.
    """

    def __init__(
        self,
        trace: FlightTrace,
        rate_loops: tuple[RateLoop, RateLoop, RateLoop],
        clock_offset: Callable[[], float | None],
        note: Callable[[str], None],
    ) -> None:
        self._trace = trace
        self._rate_loops = dict(zip(_AXES, rate_loops, strict=True))
        self._clock_offset = clock_offset
        self._note = note
        self._due = -inf
        self._looks = 0
        # At each look: how many rows there were, and the offset until then, s.
        self._offsets = deque([(0, nan)], maxlen=_OFFSETS)
        self._suspected: set[str] = set()
        self._warned = False
        time = np.arange(0.0, 3.0, 0.01)
        dead_time_by_correlation(time, np.sin(time), time, np.sin(time))  # the first use is slow

    def after_answer(self, now: float) -> None:
        """Look, if it is time to; `now` is our clock, s."""
        if now < self._due:
            return
        self._due = now + _PERIOD
        try:
            self._look()
        except Exception as error:  # what only watches must not end a flight
            self._due = inf
            self._note(f"the dead time is watched no more: {internal(error)}")

    def _look(self) -> None:
        self._note_offset()
        if len(self._offsets) > _LOOKS:
            first, _ = self._offsets[-1 - _LOOKS]
            name = _AXES[self._looks % len(_AXES)]
            self._looks += 1
            self._judge(name, self._dead_time(name, self._trace.rates_rows(first)))

    def over_the_flight(self) -> DeadTimes:
        """Measure over all that was flown, and warn if that is still to be done."""
        first = max(0, len(self._trace.rates) - _LONGEST)
        rows = self._trace.rates_rows(first)
        ages = self._ages(rows, first)
        measured = DeadTimes(
            {name: self._dead_time(name, rows) for name in _AXES},
            SampleAge(*np.percentile(ages, (50, 99)).tolist()) if ages.size else SampleAge(),
            lag_known=any(loop.lag is not None for loop in self._rate_loops.values()),
        )
        self._warn(measured)
        return measured

    def _note_offset(self) -> None:
        """By how much the clocks differed for the samples since the last look."""
        offset = self._clock_offset()
        self._offsets.append((len(self._trace.rates), nan if offset is None else offset))

    def _ages(self, rows: NDArray[np.float64], first: int) -> NDArray[np.float64]:
        """How old the samples were when they arrived, s, where that is known.

        Args:
            rows: of the flight.
            first: number of the first of them.
        """
        until, offsets = np.array([*self._offsets, (np.inf, nan)]).T
        look = np.searchsorted(until, first + np.arange(len(rows)), side="right")
        ages = rows[:, 1] + offsets[look] - rows[:, 0]
        known: NDArray[np.float64] = ages[np.isfinite(ages)]
        return known

    def _dead_time(self, name: str, rows: NDArray[np.float64]) -> AxisDeadTime:
        """What the rows say of one axis."""
        loop, axis = self._rate_loops[name], _AXES.index(name)
        measured = None
        if loop.lag is not None:
            time, commanded, followed = rows[:, [0, _COMMANDED + axis, _MEASURED + axis]].T
            sure = time < time[-1:] - _UNSURE
            measured = dead_time_by_correlation(
                time[sure],
                commanded[sure],
                time[sure],
                followed[sure],
                loop.lag,
                loop.acceleration_limit,
            )
        return AxisDeadTime(measured, loop.dead_time)

    def _judge(self, name: str, found: AxisDeadTime) -> None:
        """Warn at the second look in a row that finds the axis wrong: one may be a gust's doing."""
        if not found.is_wrong:
            self._suspected.discard(name)
        elif name in self._suspected:
            self._warn(DeadTimes({name: found}))
        else:
            self._suspected.add(name)

    def _warn(self, found: DeadTimes) -> None:
        warning = found.warning()
        if warning is not None and not self._warned:
            self._warned = True
            self._note(warning)
