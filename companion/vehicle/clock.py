"""The vehicle's clock, compared with the event loop's: ages of samples, and jumps of the clock.

The offset is vehicle time minus event-loop time. The stamp of an attitude sample minus its arrival
is the offset minus the sample's delay. So the largest difference (`max_offset`) comes from the
sample with the smallest delay, the "quickest" sample. TIMESYNC measures the delay of that sample.
"""

from collections.abc import Callable
from math import inf, nan

from companion.vehicle.clock_estimates import ClockRate, DelayUnknown, TelemetryDelay
from companion.vehicle.clock_jumps import (
    RESTART_SETBACK,
    SAME_CLOCK_SPREAD,
    SMALLEST_JUMP,
    WRAP_PERIOD_NS,
    Misfit,
    MisfitRun,
    SampleTiming,
    Stamp,
    describe_change,
    has_wrapped,
)

_SETTLING_TIME = 2.0
"""Time after the first sample in which queued samples may falsify the offset, s."""
_MIN_CLOCK_SETBACK = 0.5
"""A TIMESYNC time this far behind the newest stamp, s, means that the clock was set back."""
_TIMESYNC_LAG = 0.012
"""Largest lag of TIMESYNC behind the samples' stamps in the simulators, s (measured)."""
_LONG_GAP = 1.0
"""After a longer gap, s, an old sample was queued: it says nothing of the clocks' drift."""
_TIMESYNC_WAIT = 3.0
"""Time from the first sample to the report that TIMESYNC does not measure ages, s."""


class VehicleClock:
    """One vehicle's clock, estimated from every attitude sample and TIMESYNC exchange.

    If the clock jumps, the vehicle times returned here continue without the jump.

    Args:
        lockstep: whether the event loop runs on the vehicle's clock, so that ages are known without
            TIMESYNC.

    Attributes:
        rate: estimates the rate of the vehicle's clock.
        delay: estimates the delay of the quickest sample, by TIMESYNC.
        change_count: counts jumps, wraps, standstills and restarts of the clock.
        restart_count: counts restarts of the autopilot, each of which sets its clock back.
        last_change: the newest change counted in `change_count`, in words; empty before the first.
        on_event: called with a sentence for the user.
    """

    def __init__(self, *, lockstep: bool = False) -> None:
        self.rate = ClockRate(same_clock=lockstep)
        self.delay = TelemetryDelay()
        self.change_count = self.restart_count = 0
        self.last_change = ""
        self.on_event: Callable[[str], None] = lambda _: None
        self._lockstep = lockstep
        self._start_time = inf
        self._jump_correction = 0.0
        self._max_offset = self._newest_time = -inf
        self._last_arrival = self._lateness = 0.0
        self._misfits = MisfitRun()
        self._reported_unknown = self._reported_outlier = False

    @property
    def age_known(self) -> bool:
        """Whether ages include the quickest sample's delay; otherwise that delay counts as 0."""
        return self._lockstep or self.delay.known

    @property
    def offset(self) -> float | None:
        """Vehicle time minus event-loop time, s; None before the first sample."""
        return None if self._start_time == inf else self._max_offset + self.delay.seconds

    def vehicle_time(self, time_boot_ms: int) -> float:
        """Convert the stamp of any message, ms, to vehicle time as in `SampleTiming`, s."""
        return time_boot_ms / 1000.0 + self._jump_correction

    def age(self, vehicle_time: float, now: float) -> float | None:
        """Age at the event-loop time `now` of a message stamped with `vehicle_time`; all in s.

        The age is never negative, and None before the first sample.
        """
        offset = self.offset
        return None if offset is None else max(0.0, now + offset - vehicle_time)

    def is_ahead(self, vehicle_time: float, now: float) -> bool:
        """Whether a stamp (s) is further ahead of the clock at time `now` than drift explains."""
        offset, spread = self.offset, self.rate.spread(max(0.0, now - self._last_arrival))
        return offset is not None and vehicle_time - now > offset + SMALLEST_JUMP + spread

    def take(self, time_boot_ms: int, received: float) -> SampleTiming:
        """Take the times of an attitude sample; return its vehicle time and age.

        Args:
            time_boot_ms: time stamp of the sample, ms.
            received: event-loop time of its arrival, s.
        """
        time = time_boot_ms / 1000.0 + self._jump_correction
        offset = time - received
        gap = received - self._last_arrival
        max_offset = self._max_offset + self.rate.lowest_rate * gap
        if gap > _LONG_GAP and offset < max_offset:  # queued in a stall of this program
            max_offset = self._max_offset + self.rate.rate * gap
        fits = time > self._newest_time and offset <= max_offset + SMALLEST_JUMP
        if not fits or self._misfits.stamps:
            misfit = self._fit_stamp(Stamp(time, offset, received), time_boot_ms, max_offset)
            if misfit is not None:
                return SampleTiming(time, nan, misfit)
            time = time_boot_ms / 1000.0 + self._jump_correction
            offset, max_offset = time - received, self._max_offset
        self._max_offset, self._last_arrival = max(max_offset, offset), received
        self._newest_time, self._lateness = time, self._max_offset - offset
        if received >= self.rate.next_offset_due:
            self.rate.add_offset(received, self._max_offset)
        return SampleTiming(time, self._lateness + self.delay.seconds)

    def take_timesync(self, sent: float, received: float, vehicle_ns: int) -> None:
        """Take a TIMESYNC exchange.

        An exchange also shows whether the clock has slipped: on a busy computer simulators lose
        time and do not catch up. From a slip until the next exchange, samples seem late.

        Args:
            sent: event-loop time of the request, s.
            received: event-loop time of the answer, s.
            vehicle_ns: the vehicle's time in the answer, ns.
        """
        if self._lockstep or self._start_time == inf:
            return
        boot_time = vehicle_ns % WRAP_PERIOD_NS * 1e-9  # wraps as the samples' stamps do
        time = boot_time + self._jump_correction
        middle_time, half_round_trip = 0.5 * (sent + received), 0.5 * (received - sent)
        max_offset = self._max_offset + self.rate.rate * (middle_time - self._last_arrival)
        attitude_fits = received - self._last_arrival < 1.0 and self._lateness < SMALLEST_JUMP
        error = half_round_trip + self.rate.spread(max(0.0, received - self._last_arrival))
        delay = time - middle_time - max_offset
        clock_setback = self.delay.take_exchange(received, error, delay)
        if clock_setback is None:
            if -delay < SMALLEST_JUMP:
                self._max_offset -= max(0.0, -delay - error - _TIMESYNC_LAG)
            return
        if attitude_fits:  # the samples are as before: only TIMESYNC's clock has changed
            self.delay.forget(DelayUnknown.OTHER_CLOCK)
        else:
            # The answer may be a little older than the newest sample.
            was_set_back = time < self._newest_time - _MIN_CLOCK_SETBACK
            self._accept_jump(-clock_setback, round(vehicle_ns * 1e-6), set_back=was_set_back)

    def update(self, now: float) -> None:
        """Drop exchanges too old at event-loop time `now` (s); report a change of `age_known`."""
        self.delay.expire(now)
        if now - self._start_time < _TIMESYNC_WAIT or self.age_known is not self._reported_unknown:
            return
        self._reported_unknown = not self.age_known
        if self._reported_unknown:
            self.on_event(
                f"the age of telemetry is not known, because {self.delay.why_unknown.value}; "
                "a single late sample is noticed, but a delay of all samples is not"
            )
        else:
            self.on_event("the age of telemetry is known by TIMESYNC")

    def _fit_stamp(self, stamp: Stamp, time_boot_ms: int, max_offset: float) -> Misfit | None:
        """Adapt the clock to a stamp; return why the stamp does not fit, or None.

        `max_offset`: largest offset, with the drift since the last sample that fitted, s.
        """
        if self._start_time == inf:
            self._start_time = self._last_arrival = stamp.received
            self._max_offset = 0.0 if self._lockstep else stamp.apparent_offset
        elif self._drift_explains(stamp, max_offset):
            self._max_offset = max_offset
            self._end_misfits(time_boot_ms, max_offset - stamp.apparent_offset)
        elif self._link_got_quicker(stamp, max_offset):
            self._max_offset = max_offset
            self.delay.shorten(stamp.apparent_offset - max_offset, stamp.received)
            self._drop_misfits()
        else:
            return self._take_misfit(stamp, time_boot_ms, max_offset)
        return None

    def _drift_explains(self, stamp: Stamp, max_offset: float) -> bool:
        """Whether `stamp` is newer, and ahead of the clock by no more than the largest drift."""
        limit = max_offset + SMALLEST_JUMP + self.rate.spread(stamp.received - self._last_arrival)
        return stamp.time > self._newest_time and stamp.apparent_offset <= limit

    def _link_got_quicker(self, stamp: Stamp, max_offset: float) -> bool:
        """Whether `stamp` seems ahead only because the link has become quicker.

        A quicker link puts `stamp` ahead by at most the delay that TIMESYNC measured before. Only
        exchanges until the last sample that fitted the clock count, because the clock may have
        jumped after this sample.
        """
        max_delay = self.delay.largest_possible(before=self._last_arrival - SAME_CLOCK_SPREAD)
        return stamp.time > self._newest_time and stamp.apparent_offset - max_offset <= max_delay

    def _take_misfit(self, stamp: Stamp, time_boot_ms: int, max_offset: float) -> Misfit | None:
        """Add a sample that does not fit; if the misfits show a jump, adopt it and return None."""
        if not self._misfits.agrees_with(stamp):
            self._drop_misfits()
        self._misfits.stamps.append(stamp)
        if not self._misfits.show_jump(max_offset):
            return Misfit.AHEAD if stamp.time > self._newest_time else Misfit.NOT_NEWER
        jump = self._misfits.largest_offset() - max_offset
        self._misfits.stamps.clear()
        self._max_offset, self._newest_time = max_offset, -inf
        self._accept_jump(jump, time_boot_ms, set_back=jump < 0.0)
        return None

    def _end_misfits(self, time_boot_ms: int, lateness: float) -> None:
        """Forget the misfits: a sample fits the clock again, and came `lateness` seconds late.

        If all misfits repeated the newest stamp that fitted, the vehicle's clock stood still.
        """
        if not self._misfits.stamps:
            return
        clock_stopped = self._misfits.clock_stopped(self._newest_time)
        duration = self._misfits.stamps[-1].received - self._last_arrival
        self._drop_misfits()
        if clock_stopped and min(duration, lateness) >= SMALLEST_JUMP:
            self._accept_jump(-lateness, time_boot_ms, set_back=False)

    def _drop_misfits(self) -> None:
        """Drop the misfits; report, only once, a sample that was stamped ahead of the clock."""
        any_ahead = any(stamp.time > self._newest_time for stamp in self._misfits.stamps)
        if any_ahead and not self._reported_outlier:
            self._reported_outlier = True
            lead = self._misfits.largest_offset() - self._max_offset
            self.on_event(
                f"a sample stamped {lead:.1f} s ahead of the vehicle's clock was dropped; such "
                "samples are counted"
            )
        self._misfits.stamps.clear()

    def _accept_jump(self, jump: float, time_boot_ms: int, *, set_back: bool) -> None:
        """Accept that the vehicle's clock jumped by `jump` s; vehicle times stay continuous."""
        before = self._last_arrival + self._max_offset - self._jump_correction
        self._jump_correction -= jump
        self.delay.forget_after(self._last_arrival - self.delay.seconds - SAME_CLOCK_SPREAD)
        if self._last_arrival - self._start_time < _SETTLING_TIME and jump > -RESTART_SETBACK:
            return
        self.change_count += 1
        self.restart_count += set_back and not has_wrapped(jump, before) and jump < -RESTART_SETBACK
        self.last_change = describe_change(jump, before, time_boot_ms / 1000.0, set_back=set_back)
        self.on_event(self.last_change)
