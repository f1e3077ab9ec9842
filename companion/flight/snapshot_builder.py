"""Makes the snapshots: newest telemetry, our own counters, and shares over the last second."""

from collections import deque
from math import dist, inf
from typing import NamedTuple

from companion.attitude.representation import wrap_angle
from companion.control.control_loop import ControlLoop
from companion.control.guidance_loop import GuidanceLoop
from companion.guidance.fence import Place
from companion.guidance.reference import Vector
from companion.mavlink.stats import share_lost
from companion.safety.snapshot import Autopilot, Control, Health, Motion, Resets, Snapshot
from companion.vehicle.held_rates import HeldRates
from companion.vehicle.link import Link

_WINDOW = 1.0
"""Shares are over the last of this, s."""
_EARLY = 0.9
"""Of the window; before so much of it is known there are no shares."""
_LATE = 0.03
"""Between two looks, s; the timer's period is 0.02 s."""
_PLACE_LASTS = 1.0
"""The vehicle hovers where control begins: where it was so long ago, s, is the same place."""
_GAPS_WITHIN = 5.0
"""Within this time, s, gaps in the answers are counted together."""
_WHILE = 30.0
"""Within so long, s, resets of the estimator are counted together."""


class _Counted(NamedTuple):
    """Counters at one look; `late` is by how long that look came late, s."""

    now: float
    frames: int
    lost: int
    setpoints: int
    missed: int
    late: float
    held: HeldRates
    positions: int


class SnapshotBuilder:
    """Looks at everything that the monitors judge.

    Args:
        link: to the vehicle.
        loop: answers the samples.
        guidance_loop: makes the commands.
        real_time: whether deadlines mean anything: in lockstep the vehicle waits for us.
    """

    def __init__(
        self, link: Link, loop: ControlLoop, guidance_loop: GuidanceLoop, *, real_time: bool
    ) -> None:
        self._link, self._loop, self._guidance_loop = link, loop, guidance_loop
        self._real_time = real_time
        self._counted: deque[_Counted] = deque()
        self._frames = 0
        self._heard_at = 0.0
        self._start: Vector | None = None
        self._origin: Place | None = None
        self._began_at = 0.0
        self._turn = 0.0
        self._shift: Vector = (0.0, 0.0, 0.0)
        self._good_flags = 0
        self._timeline = 0

    def begin(self, now: float) -> None:
        """Control begins: fences are about this place, and resets before this do not count."""
        state, resets = self._link.state, self._loop.resets
        motion = self._guidance_loop.motion
        self._start = None if motion is None else motion.position_ned
        self._origin = self._place(now)
        self._began_at, self._turn, self._shift = now, resets.turn, resets.shift
        resets.largest_tilt = 0.0
        self._good_flags = 0 if state.estimator is None else state.estimator.flags
        self._timeline = self._link.clock.timeline
        self._counted.clear()

    def listen(self, now: float) -> None:
        """Note what is heard, and count; at every look, whatever the phase."""
        stats, loop = self._link.stats, self._loop
        if stats.frames != self._frames:
            self._frames, self._heard_at = stats.frames, now
        loop.resets.on_counter(self._link.state.reset_counter, now)
        counted = self._counted
        late = max(0.0, now - counted[-1].now - _LATE) if counted else 0.0
        counted.append(
            _Counted(
                now,
                stats.frames,
                stats.lost,
                loop.record.setpoints,
                loop.record.missed_deadlines,
                late,
                loop.record.held.copy(),
                self._link.state.positions,
            )
        )
        while len(counted) > 2 and now - counted[1].now >= _WINDOW:
            counted.popleft()

    def snapshot(self, now: float) -> Snapshot:
        """What is known at `now`, s on our clock; after `listen`."""
        state, loop, clock = self._link.state, self._loop, self._link.clock
        command = loop.command
        return Snapshot(
            now,
            Autopilot(
                state.armed,
                state.landed,
                state.failsafe,
                state.battery,
                state.gps,
                state.estimator,
            ),
            self._motion(),
            Control(
                loop.record.last_answer,
                loop.record.last_sample,
                loop.record.reason,
                -inf if command is None else command.made_at,
                -inf if state.position is None else state.position.received,
                self._heard_at,
                self._guidance_loop.fresh_position() is not None,
                None if clock.timeline == self._timeline else clock.last_change,
                self.stood_still(since=loop.record.last_answer),
            ),
            self._health(now),
            self._resets(now),
            state.gps_was_good,
            self._good_flags,
        )

    def stood_still(self, since: float) -> float:
        """For how long our own timer did not run since then, s."""
        return sum(look.late for look in self._counted if look.now > since)

    def _motion(self) -> Motion:
        guidance_loop, loop, start = self._guidance_loop, self._loop, self._start
        offset, velocity = None, (0.0, 0.0, 0.0)
        if guidance_loop.motion is not None:
            (north, east, down), velocity = guidance_loop.motion
            if start is not None:
                offset = north - start[0], east - start[1], down - start[2]
        sample, idle = loop.resets.newest, loop.command is None or loop.command.idle
        return Motion(
            None if sample is None else sample.q,
            (0.0, 0.0, 0.0) if sample is None else sample.body_rates,
            offset,
            velocity,
            self._link.state.height,
            guidance_loop.off_course,
            None if idle else loop.record.thrust,
            self._origin,
        )

    def _health(self, now: float) -> Health:
        since = max(self._began_at, now - _GAPS_WITHIN)
        gaps = sum(at > since for at in self._loop.record.gaps)
        first, last = self._counted[0], self._counted[-1]
        span = last.now - first.now
        if span < _EARLY * _WINDOW:
            return Health(round_trip=self._link.timesync.round_trip_s, gaps=gaps)
        late = sum(counted.late for counted in self._counted) - first.late
        lost = last.lost - first.lost
        return Health(
            share_lost(last.frames - first.frames, lost),
            self._link.timesync.round_trip_s,
            (last.missed - first.missed) / max(1, last.setpoints - first.setpoints)
            if self._real_time
            else None,
            late / span,
            last.held.rate_since(first.held),
            gaps,
            (last.positions - first.positions) / span,
        )

    def _resets(self, now: float) -> Resets:
        resets = self._loop.resets
        since = max(self._began_at, now - _WHILE)
        return Resets(
            sum(at > since for at in resets.times),
            dist(resets.shift, self._shift),
            wrap_angle(resets.turn - self._turn),
            resets.largest_tilt,
        )

    def _place(self, now: float) -> Place | None:
        """Latitude and longitude of where the vehicle is, if they were told lately."""
        told = self._link.state.global_position
        if told is None or now - told.received > _PLACE_LASTS:
            return None
        return Place(told.latitude_deg, told.longitude_deg)
