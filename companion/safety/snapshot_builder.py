"""Builds the snapshots from the newest telemetry, and from counters since control began."""

from math import dist, inf

from companion.attitude.representation import wrap_angle
from companion.control.control_loop import ControlLoop
from companion.control.guidance_loop import GuidanceLoop
from companion.control.heading_frame import HeadingFrame
from companion.guidance.fence import FenceCentre, LatLon
from companion.guidance.reference import Vector, minus
from companion.safety.counter_window import CounterWindow
from companion.safety.frozen_telemetry import FrozenTelemetry
from companion.safety.heading_drift import HeadingDrift
from companion.safety.height_contradiction import HeightContradiction
from companion.safety.setpoint_echo import SetpointEcho
from companion.safety.snapshot import (
    HEARD_TIMEOUT_S,
    AutopilotStatus,
    Control,
    Health,
    Motion,
    Resets,
    Snapshot,
)
from companion.vehicle.link import Link

_MAX_LAT_LON_AGE = 1.0
"""Largest age of the GLOBAL_POSITION_INT that gives the place where control begins, s."""
_HOLD_ERROR = 0.3
"""A vehicle farther from the place of its hold still moves there, m: wind may slow it."""
_GAP_COUNTING_TIME = 5.0
"""Time over which gaps in the setpoints are counted, s."""
_RESET_COUNTING_TIME = 30.0
"""Time over which estimator resets are counted, s."""


class SnapshotBuilder:
    """Collects the data that the monitors judge.

    Attributes:
        echo: gets each ATTITUDE_TARGET.
        counters: the counters of the last second, and our own stalls.
        fence_centre_ned: centre of the fence in the frame without estimator resets, m NED; None:
            not known. The centre is where control began, unless `begin` got another one.

    Args:
        real_time: whether deadlines count; in lockstep they do not, because the vehicle waits.
    """

    def __init__(
        self, link: Link, loop: ControlLoop, guidance_loop: GuidanceLoop, *, real_time: bool
    ) -> None:
        self._link, self._loop, self._guidance_loop = link, loop, guidance_loop
        self.echo = SetpointEcho(loop.record.sent_setpoints)
        self.counters = CounterWindow(link, loop.record, real_time=real_time)
        self._frozen_telemetry = FrozenTelemetry()
        self._heading_drift = HeadingDrift(loop.resets)
        self._height_contradiction = HeightContradiction(loop.resets)
        self._frames_heard = 0
        self._heard_at = 0.0
        self.fence_centre_ned: Vector | None = None
        self._fence_lat_lon: LatLon | None = None
        self._control_start = 0.0
        self._heading_frame_at_start = HeadingFrame()
        self._shift_at_start: Vector = (0.0, 0.0, 0.0)
        self._initial_estimator_flags = 0
        self._clock_change_count = 0

    def begin(self, now: float, centre: FenceCentre | None = None) -> None:
        """Note that control begins at `now`; earlier resets do not count.

        Args:
            now: s of event-loop time.
            centre: centre of the fence; None: the present position.
        """
        state, resets = self._link.state, self._loop.resets
        motion = self._guidance_loop.motion
        self.fence_centre_ned = None if motion is None else motion.position_ned
        self._fence_lat_lon = self._current_lat_lon(now)
        if centre is not None:
            self.fence_centre_ned = minus(centre.position_ned, resets.position_shift)
            self._fence_lat_lon = centre.lat_lon
        self._control_start = now
        self._heading_frame_at_start, self._shift_at_start = resets.frame, resets.position_shift
        resets.largest_tilt_jump = 0.0
        self._initial_estimator_flags = 0 if state.estimator is None else state.estimator.flags
        self._clock_change_count = self._link.clock.change_count
        self.counters.clear()
        self.echo.begin(self._link.autopilot)
        self._frozen_telemetry.begin(now)
        self._heading_drift.begin()
        self._height_contradiction.begin()

    def fence_centre_without_resets(self) -> FenceCentre | None:
        """Centre of the fence in the frame without resets; None: no position, or no control yet."""
        if self.fence_centre_ned is None:
            return None
        return FenceCentre(self.fence_centre_ned, self._fence_lat_lon)

    @property
    def fence_centre(self) -> FenceCentre | None:
        """Centre of the fence in the autopilot's frame; None: no position, or no control yet."""
        if self.fence_centre_ned is None:
            return None
        negative_shift = minus((0.0, 0.0, 0.0), self._loop.resets.position_shift)
        return FenceCentre(minus(self.fence_centre_ned, negative_shift), self._fence_lat_lon)

    def long_silence(self, now: float) -> float | None:
        """Silence of the vehicle at `now`, s; None if it is not longer than `HEARD_TIMEOUT_S`."""
        self.read_counters(now)
        silence = now - self._heard_at
        return silence if silence > HEARD_TIMEOUT_S else None

    def read_counters(self, now: float) -> None:
        """Read the counters at `now`; the watch calls this at least 50 times a second."""
        frames = self._link.stats.frames
        if frames != self._frames_heard:
            self._frames_heard, self._heard_at = frames, now
        self._loop.resets.on_counter(self._link.state.reset_counter, now)
        self.counters.read(now)

    def snapshot(self, now: float) -> Snapshot:
        """The snapshot at `now`, s of event-loop time; call `read_counters` before."""
        state, loop, clock = self._link.state, self._loop, self._link.clock
        record = loop.record
        non_finite_at = self._link.stats.non_finite_at
        position_received = -inf if state.position is None else state.position.received
        return Snapshot(
            now,
            AutopilotStatus(
                state.armed, state.landed, state.failsafe, state.battery, state.gps, state.estimator
            ),
            self._motion(),
            Control(
                record.last_answered_arrival,
                record.last_sample_arrival,
                non_finite_at.get("ATTITUDE_QUATERNION", -inf) > record.last_sample_arrival,
                record.reason,
                position_received,
                non_finite_at.get("LOCAL_POSITION_NED", -inf) > position_received,
                self._guidance_loop.command_not_finite,
                self._heard_at,
                self._guidance_loop.fresh_position() is not None,
                None if clock.change_count == self._clock_change_count else clock.last_change,
                self.counters.stall_time(since=record.last_answered_arrival),
            ),
            self._health(now),
            self._resets(now),
            state.gps_was_good,
            self._initial_estimator_flags,
        )

    def _motion(self) -> Motion:
        guidance_loop, loop, centre = self._guidance_loop, self._loop, self.fence_centre_ned
        offset, velocity = None, (0.0, 0.0, 0.0)
        if guidance_loop.motion is not None:
            position, velocity = guidance_loop.motion
            offset = None if centre is None else minus(position, centre)
        sample, idle = loop.resets.newest_attitude, loop.command is None or loop.command.idle
        return Motion(
            None if sample is None else sample.q,
            (0.0, 0.0, 0.0) if sample is None else sample.body_rates,
            offset,
            velocity,
            self._link.state.height,
            guidance_loop.tracking_error,
            None if idle else loop.record.thrust,
            self._fence_lat_lon,
            guidance_loop.acceleration,
            guidance_loop.estimate.disturbance,
            guidance_loop.remaining_braking_time > 0.0
            or (guidance_loop.tracking_error or 0.0) > _HOLD_ERROR,
        )

    def _health(self, now: float) -> Health:
        since = max(self._control_start, now - _GAP_COUNTING_TIME)
        timesync = self._link.timesync
        return self.counters.health()._replace(
            round_trip=timesync.round_trip_s,
            gaps=sum(at > since for at in self._loop.record.gaps),
            uplink=timesync.uplink,
            foreign_reports=self.echo.foreign_reports(now),
            any_foreign_report=self.echo.any_foreign,
            frozen_telemetry=self._find_frozen(now),
        )

    def _find_frozen(self, now: float) -> str | None:
        sent = self._loop.record.sent_setpoints
        if not sent:
            return None
        sample, position = self._loop.resets.newest_attitude, self._link.state.position
        return self._frozen_telemetry.find_frozen(now, sample, sent[-1][0], position)

    def _resets(self, now: float) -> Resets:
        resets = self._loop.resets
        since = max(self._control_start, now - _RESET_COUNTING_TIME)
        return Resets(
            sum(at > since for at in resets.reset_times),
            dist(resets.position_shift, self._shift_at_start),
            wrap_angle(resets.frame.offset - self._heading_frame_at_start.offset),
            resets.largest_tilt_jump,
            self._heading_drift.drift(now),
            self._height_contradiction.unexplained_change(self._link.state.position),
        )

    def _current_lat_lon(self, now: float) -> LatLon | None:
        """Latitude and longitude of the vehicle, or None if they are old."""
        newest = self._link.state.global_position
        if newest is None or now - newest.received > _MAX_LAT_LON_AGE:
            return None
        return LatLon(newest.latitude_deg, newest.longitude_deg)
