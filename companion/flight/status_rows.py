"""Records the thrust estimator, the program's resources, the link's counters, and the fence."""

import resource
from collections.abc import Callable
from math import nan
from time import process_time

from companion.flight.context import FlightContext
from companion.flight.fence_drawing import FenceDrawing
from companion.recording.mcap_file.channels import RESOURCES, THRUST
from companion.recording.recorder import FlightRecorder

_RESOURCES_PERIOD = 1.0
_KB_PER_MB = 1024.0


class StatusRows:
    """Records thrust ten times a second, and resources and link once a second.

    Args:
        context: context of the flight.
        recorder: recorder of the flight, or None.
        clock: our clock, s.
    """

    def __init__(
        self, context: FlightContext, recorder: FlightRecorder | None, clock: Callable[[], float]
    ) -> None:
        self._context, self._recorder, self._clock = context, recorder, clock
        self._fence = None if recorder is None else FenceDrawing(context, recorder)
        self._due = self._measured_at = clock()
        self._processor_s = process_time()

    def record(self, now: float) -> None:
        """Record what is due at `now`, s on our clock."""
        recorder = self._recorder
        if recorder is None or self._fence is None:
            return
        self._fence.record(now)
        recorder.row(now, THRUST, self._thrust_row(now))
        if now >= self._due:
            self._due = now + _RESOURCES_PERIOD
            recorder.row(now, RESOURCES, self._resources_row(now, recorder))

    def _thrust_row(self, now: float) -> tuple[float, ...]:
        context = self._context
        learning, battery = context.guidance_loop.learning, context.link.state.battery
        voltage = None if battery is None else battery.voltage_v
        remaining = None if battery is None else battery.remaining
        return (
            now,
            learning.learned_hover,
            *learning.thrust_limits,
            context.loop.record.thrust,
            nan if voltage is None else voltage,
            nan if remaining is None else remaining,
        )

    def _resources_row(self, now: float, recorder: FlightRecorder) -> tuple[float, ...]:
        """The row of `RESOURCES`; in a test, the mock vehicle's processor time is included."""
        processor_s, before = process_time(), self._processor_s
        elapsed, self._measured_at = now - self._measured_at, now
        self._processor_s = processor_s
        link, record = self._context.link, self._context.loop.record
        round_trip = link.timesync.round_trip_s
        return (
            now,
            (processor_s - before) / elapsed if elapsed > 0.0 else nan,
            resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / _KB_PER_MB,
            recorder.waiting,
            recorder.dropped,
            link.stats.frames,
            link.stats.lost,
            link.stats.sent,
            nan if round_trip is None else 1e3 * round_trip,
            record.setpoints,
            record.missed_deadlines,
        )
