"""The state of a flight for the screen and for the record, ten times a second."""

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from math import degrees, hypot, inf, nan
from types import MappingProxyType
from typing import Any, NamedTuple

from companion.control.loop_record import LoopRecord
from companion.flight.context import FlightContext
from companion.flight.phase import Phase
from companion.flight.status_rows import StatusRows
from companion.flight.view import view
from companion.recording.trace import FlightTrace
from companion.safety import SafetyLadder
from companion.safety.actions import fault_message
from companion.vehicle.records import Battery, LocalPosition

_STATUS_PERIOD = 0.1
_RATE_WINDOW = 1.0
"""Time over which the rate of setpoints is counted, s."""
_MAX_TELEMETRY_AGE = 1.0
"""Age above which a position counts as unknown, s."""


class FlightStatus(NamedTuple):
    """The state of a flight at one time; None: unknown, or does not apply."""

    time: float
    """Time since the flight began, s."""
    airborne_time: float | None
    """Time since the vehicle left the ground, s."""
    phase: str
    waiting_for: str
    """What the phase waits for."""
    elapsed: float
    """Time since the phase began, s."""
    timeout: float
    """Timeout of the phase, s; may be infinite."""
    maneuver: str | None = None
    """Name of the maneuver that is flown."""
    maneuver_elapsed: float = 0.0
    """Time since the maneuver began, s."""
    maneuver_duration: float | None = None
    """Duration of the maneuver, s; None: no maneuver, or another program ends it."""
    height: float | None = None
    """Height above home, m."""
    speed: float | None = None
    """Speed, horizontal and vertical together, m/s."""
    tilt: float | None = None
    """Tilt, rad."""
    tracking_error: float | None = None
    """Distance from the reference, m."""
    setpoint_rate: float | None = None
    """Rate of setpoints, Hz."""
    latency: float | None = None
    """Time from the last answered sample to its setpoint, s; None in lockstep, and while the
    control loop is off."""
    missed_deadlines: int | None = None
    """Deadlines missed so far; None in lockstep."""
    battery: Battery | None = None
    monitored: bool = False
    """Whether the safety monitors are active."""
    alarms: tuple[str, ...] = ()
    """Names of the safety monitors whose alarm is raised."""
    view: Mapping[str, Any] = MappingProxyType({})
    """Values for a picture, such as attitude, target, motion and reference; see `flight.view`."""


class StatusReporter:
    """Records the motion in all phases, and shows the state of the flight.

    Attributes:
        takeoff_time: when the vehicle left the ground, s of event-loop time; None: not yet.
        battery_at_takeoff: remaining charge at the take-off, 0..1; None: unknown.
        real_time: whether latencies are meaningful; False in lockstep.

    Args:
        ladder: tells which safety monitors have raised an alarm.
        began: when the flight began, s of event-loop time.
        current_phase: returns the running phase, and when it began, s of event-loop time.
        show: called with the state; it must return at once. None: the state is not shown.
        clock: returns event-loop time, s.
    """

    def __init__(
        self,
        context: FlightContext,
        ladder: SafetyLadder,
        trace: FlightTrace,
        began: float,
        current_phase: Callable[[], tuple[Phase, float]],
        show: Callable[[FlightStatus], None] | None,
        clock: Callable[[], float],
        *,
        real_time: bool,
    ) -> None:
        self.takeoff_time: float | None = None
        self.battery_at_takeoff: float | None = None
        self._context, self._safety_ladder, self._trace = context, ladder, trace
        self.real_time = real_time
        self._began = began
        self._current_phase = current_phase
        self._show = show
        self._clock = clock
        self._setpoint_counts: deque[tuple[float, int]] = deque()
        self._status_rows = StatusRows(context, trace.recorder, clock)

    async def run(self) -> None:
        """Record and show the state until cancelled; steps that were missed are not repeated."""
        next_time = self._clock()
        while True:
            self.record()
            self._show_status()
            next_time = max(next_time + _STATUS_PERIOD, self._clock())
            await asyncio.sleep(next_time - self._clock())

    def _show_status(self) -> None:
        """Show the state; once the observer has raised an exception, show no more states."""
        if self._show is None:
            return
        try:
            self._show(self.status())
        except Exception as error:
            self._show = None
            self._context.note(fault_message(error))

    def record(self) -> None:
        """Record the motion, and note the take-off."""
        now, context, state = self._clock(), self._context, self._context.link.state
        ground = context.ground
        if self.takeoff_time is None and ground.takeoff_commanded and not ground.standing:
            self.takeoff_time = now
            self.battery_at_takeoff = None if state.battery is None else state.battery.remaining
        self._status_rows.record(now)
        vehicle_time, tilt = context.loop.record.last_vehicle_time, context.tilt()
        values = (
            None if vehicle_time == -inf else vehicle_time,
            self._height(now),
            self._speed(now),
            None if tilt is None else degrees(tilt),
            self._tracking_error(),
        )
        row = (nan if value is None else value for value in values)
        self._trace.add_motion(now, (now - self._began, *row))

    def status(self) -> FlightStatus:
        """The present state."""
        now, context = self._clock(), self._context
        (phase, phase_began), record = self._current_phase(), context.loop.record
        maneuver = context.guidance_loop.flown_source.part(now)
        return FlightStatus(
            time=now - self._began,
            airborne_time=None if self.takeoff_time is None else now - self.takeoff_time,
            phase=phase.name,
            waiting_for=context.waiting_for,
            elapsed=now - phase_began,
            timeout=phase.timeout,
            maneuver=None if maneuver is None else maneuver.name,
            maneuver_elapsed=0.0 if maneuver is None else maneuver.elapsed,
            maneuver_duration=None if maneuver is None else maneuver.duration,
            height=self._height(now),
            speed=self._speed(now),
            tilt=context.tilt(),
            tracking_error=self._tracking_error(),
            setpoint_rate=self._setpoint_rate(now, record),
            latency=1e-9 * record.latency_ns if self.real_time and context.loop.on else None,
            missed_deadlines=record.missed_deadlines if self.real_time else None,
            battery=context.link.state.battery,
            monitored=phase.monitored and context.loop.offboard_active,
            alarms=self._safety_ladder.raised_alarms,
            view=view(context, now),
        )

    def _setpoint_rate(self, now: float, record: LoopRecord) -> float | None:
        """Rate of setpoints over the last second, Hz; None if none was sent."""
        counts = self._setpoint_counts
        counts.append((now, record.setpoints))
        while len(counts) > 2 and now - counts[1][0] >= _RATE_WINDOW:
            counts.popleft()
        window_began, count_before = counts[0]
        sent_count = record.setpoints - count_before
        return sent_count / (now - window_began) if sent_count and now > window_began else None

    def _position(self, now: float) -> LocalPosition | None:
        position = self._context.link.state.position
        return position if position and now - position.received <= _MAX_TELEMETRY_AGE else None

    def _height(self, now: float) -> float | None:
        return self._context.link.state.height if self._position(now) else None

    def _speed(self, now: float) -> float | None:
        position = self._position(now)
        return None if position is None else hypot(*position.velocity_ned)

    def _tracking_error(self) -> float | None:
        loop = self._context.loop
        return self._context.guidance_loop.tracking_error if loop.offboard_active else None
