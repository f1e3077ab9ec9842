"""Shares of lost frames, missed deadlines and CPU starvation, and rates, over the last second."""

from collections import deque
from math import inf
from typing import NamedTuple

from companion.control.loop_record import LoopRecord
from companion.mavlink.stats import share_lost
from companion.safety.snapshot import Health
from companion.vehicle.interval_sums import IntervalSums
from companion.vehicle.link import Link

_AVERAGING_TIME = 1.0
"""Averaging time of shares and rates, s."""
_FILLED_SHARE = 0.9
"""Share of the window that must be filled before shares and rates are known."""
_LONGEST_READING_INTERVAL = 0.03
"""A longer interval between two readings is a stall, s; the timer's period is 0.02 s."""

_LONG_STALL = 2.0
"""Shortest stall in which a failsafe may land the vehicle, s."""


class _Counters(NamedTuple):
    """The counters at one reading; `late_by`: how late the reading was, s."""

    now: float
    frames: int
    lost_frames: int
    setpoints: int
    missed_deadlines: int
    late_by: float
    setpoint_intervals: IntervalSums
    positions: int


class CounterWindow:
    """The readings of the counters over the last second.

    Args:
        real_time: whether deadlines and stalls count; in lockstep they do not, because the vehicle
            waits for this program.

    Attributes:
        long_stall_ended_at: event-loop time of the end of the last stall of 2 s or more, s; −inf
            without one. A failsafe may have landed the vehicle in such a stall.
    """

    def __init__(self, link: Link, record: LoopRecord, *, real_time: bool) -> None:
        self._link, self._record, self._real_time = link, record, real_time
        self._readings: deque[_Counters] = deque()
        self.long_stall_ended_at = -inf
        self._latest_stall = -inf  # when a late reading was made, s; most flights have none

    def clear(self) -> None:
        """Forget all readings."""
        self._readings.clear()

    def read(self, now: float) -> None:
        """Read the counters at `now`, s of event-loop time."""
        readings, stats, record = self._readings, self._link.stats, self._record
        late_by = 0.0
        if readings and self._real_time:
            late_by = max(0.0, now - readings[-1].now - _LONGEST_READING_INTERVAL)
        if late_by > 0.0:
            self._latest_stall = now
        if late_by >= _LONG_STALL:
            self.long_stall_ended_at = now
        readings.append(
            _Counters(
                now,
                stats.frames,
                stats.lost,
                record.setpoints,
                record.missed_deadlines,
                late_by,
                record.setpoint_intervals.copy(),
                self._link.state.position_count,
            )
        )
        while len(readings) > 2 and now - readings[1].now >= _AVERAGING_TIME:
            readings.popleft()

    def stall_time(self, since: float) -> float:
        """Total time, s, of the stalls that ended after `since`, s of event-loop time.

        Stalls that ended more than about a second ago are forgotten.
        """
        if self._latest_stall <= since:
            return 0.0
        return sum(reading.late_by for reading in self._readings if reading.now > since)

    def health(self) -> Health:
        """The shares and rates of a `Health`; all are unknown until the window is filled."""
        first, last = self._readings[0], self._readings[-1]
        span = last.now - first.now
        if span < _FILLED_SHARE * _AVERAGING_TIME:
            return Health()
        stalled_time = self.stall_time(since=first.now)
        missed_share = (last.missed_deadlines - first.missed_deadlines) / max(
            1, last.setpoints - first.setpoints
        )
        lost_frames = last.lost_frames - first.lost_frames
        return Health(
            lost_share=share_lost(last.frames - first.frames, lost_frames),
            missed_share=missed_share if self._real_time else None,
            starved_share=stalled_time / span,
            answer_rate=last.setpoint_intervals.rate_since(first.setpoint_intervals),
            position_rate=(last.positions - first.positions) / span,
        )
