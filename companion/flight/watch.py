"""The watch: checks mode, heartbeat and safety monitors, on a timer and at every heartbeat."""

import asyncio
from collections.abc import Callable
from math import inf

from companion.flight.commands import require_role, roles_of
from companion.flight.context import INITIAL_HEARTBEAT_LIMIT, FlightContext
from companion.flight.hand_over import require_not_falling, stop_moving
from companion.flight.hold_inside import brake_inside_fence
from companion.flight.phase import Phase
from companion.flight.rate_requester import RateRequester
from companion.safety import SafetyLadder
from companion.safety.actions import (
    ARMED_UNKNOWN,
    EXIT_OF_ACTION,
    Action,
    Exit,
    FlightEnded,
    StreamEffect,
)
from companion.vehicle.autopilot import Role
from companion.vehicle.records import is_outdated

_CURRENT_MODE_PERIOD = 0.45
"""If a CURRENT_MODE comes earlier than this after the last one, it reports a change, s; without
changes PX4 sends CURRENT_MODE every 0.5 s."""
_HEARTBEAT_REQUEST_PERIOD = 0.15
"""Shortest time between two requests for a heartbeat, s."""


class Watch:
    """Detects what the control loop cannot: silence, pilot takeovers, breaches of safety limits.

    Args:
        ladder: runs the safety monitors while the autopilot obeys us.
        clock: returns event-loop time, s.
    """

    def __init__(
        self,
        context: FlightContext,
        ladder: SafetyLadder,
        rate_requester: RateRequester,
        clock: Callable[[], float],
    ) -> None:
        self._context = context
        self._safety_ladder = ladder
        self._clock = clock
        self._rate_requester = rate_requester
        # Whether setpoints were stopped while the autopilot obeyed them: it may still wait for us.
        self._was_stopped_in_control = False
        self._current_mode_received = self._heartbeat_requested_at = -inf
        self._heartbeat_request: asyncio.Task[None] | None = None
        self._mode_request: asyncio.Task[None] | None = None

    def check(self, phase: Phase) -> None:
        """Check the vehicle's identity, its mode and heartbeat, and the safety monitors once.

        Raises:
            FlightEnded: the phase must end; contains the reason and the exit.
        """
        now = self._clock()
        self._context.snapshot_builder.read_counters(now)
        self._context.ground.update()
        self._context.replacement_detector.update()
        self._context.replacement_detector.require()
        if phase.lands:  # also while its command is not answered: a fall is soon over
            self._context.ground.note_landing()
            require_not_falling(self._context)
        in_control = phase.monitored and self._context.loop.offboard_active
        if in_control and self._context.link.state.armed is False:
            self._check_snapshot(now)  # first: ArduPilot also changes its mode then
        if phase.allowed_roles:
            require_role(self._context.link, phase.allowed_roles, self._context.released_by())
        if in_control:
            self._check_snapshot(now)
        if phase.allowed_roles:
            self._rate_requester.check_statuses(now, self._context.heartbeat_limit)
            self._check_heartbeat(now, monitored=phase.monitored)

    def on_current_mode(self, phase: Phase) -> None:
        """Check a CURRENT_MODE, which comes twice a second and at once after a status change.

        An early CURRENT_MODE may mean that the vehicle disarmed or is in a failsafe. Only a
        heartbeat can confirm it, so the watch requests a heartbeat.

        Raises:
            FlightEnded: the phase must end; see `check`.
        """
        now = self._clock()
        is_early = now - self._current_mode_received < _CURRENT_MODE_PERIOD
        self._current_mode_received = now
        if is_early:
            self._request_heartbeat(now)
        self.check(phase)

    def _request_heartbeat(self, now: float) -> None:
        """Request a heartbeat, unless one was requested within `_HEARTBEAT_REQUEST_PERIOD`."""
        is_requesting = self._heartbeat_request is not None and not self._heartbeat_request.done()
        if not is_requesting and now - self._heartbeat_requested_at >= _HEARTBEAT_REQUEST_PERIOD:
            self._heartbeat_requested_at = now
            self._heartbeat_request = asyncio.create_task(self._context.fresh_heartbeat())

    def request_mode(self) -> None:
        """After a gap in the setpoints, request a heartbeat to decide whether to resume them."""
        # Without an answer the silence monitor ends the flight.
        self._mode_request = asyncio.create_task(self._confirm_control())

    async def _confirm_control(self) -> None:
        """Wait for a fresh heartbeat; resume the setpoints if its mode requires them.

        Offboard mode requires setpoints, and during the takeover also a mode from which offboard
        can begin. A queued heartbeat may carry an old mode.
        """
        await self._context.fresh_heartbeat()
        loop, state = self._context.loop, self._context.link.state
        roles = roles_of(self._context.link)
        # The takeover needs the stream before offboard is entered. During a failsafe the stream
        # must not resume, because it would end the failsafe.
        may_enter = loop.taking_over and Role.READY in roles and not state.failsafe
        if loop.awaiting_mode and (Role.OFFBOARD in roles or may_enter):
            # Only in a phase that is not monitored: the vehicle has moved away from its hold.
            if self._clock() - loop.record.gap_start > self._context.config.deadman.silence_limit:
                stop_moving(self._context)
                self._context.guidance_loop.step()  # the newest command leads to the old place
            loop.resume()

    def _check_snapshot(self, now: float) -> None:
        """Run the safety monitors on a snapshot, and take the action that they demand."""
        self._context.link.timesync.probe()
        snapshot = self._context.snapshot_builder.snapshot(now)
        # A foreign setpoint may also be the autopilot's own, in a new mode.
        if snapshot.health.foreign_reports:
            self._request_heartbeat(now)
        self._rate_requester.check(now, snapshot.health)
        verdict = self._safety_ladder.step(snapshot)
        if verdict is None:
            return
        if verdict.action is Action.HOLD:
            brake_inside_fence(self._context)
            return
        if verdict.stream is StreamEffect.STOPS_AT_ONCE:
            self._context.release()
        elif verdict.stream is StreamEffect.ENDS_WITH_ZERO_RATES:
            self._context.end_stream()
        self._was_stopped_in_control |= verdict.stream is not StreamEffect.CONTINUES
        raise FlightEnded(verdict.reason, EXIT_OF_ACTION[verdict.action])

    def _check_heartbeat(self, now: float, *, monitored: bool) -> None:
        """Judge the age of the mode and of the heartbeat at `now`, s of event-loop time.

        Stalls of this program count as age only in a monitored phase while the autopilot obeys us:
        heartbeats that came during a stall are read after it, and a stall must end neither a
        take-off nor a landing. After a gap no setpoint is sent before the mode is confirmed.
        """
        state, loop = self._context.link.state, self._context.loop
        # In a takeover the autopilot may obey a setpoint before a heartbeat reports the new mode.
        in_control = loop.offboard_active or loop.taking_over or self._was_stopped_in_control
        climbs_without_us = self._context.takeoff_position is not None
        exit_ = Exit.LISTEN if in_control or climbs_without_us else Exit.RELEASE

        def age(received: float) -> float:
            stalled = self._context.snapshot_builder.counters.stall_time(since=received)
            return now - received - (0.0 if in_control and monitored else stalled)

        # While the autopilot flies by itself, as in a take-off, a short silence changes nothing.
        min_limit = 0.0 if in_control else INITIAL_HEARTBEAT_LIMIT
        if age(state.mode_received_at) > max(self._context.heartbeat_limit, min_limit):
            raise FlightEnded(
                "no heartbeat from the vehicle, so its mode is not known any more", exit_
            )
        if state.heartbeat is None or is_outdated(now - age(state.heartbeat.received), now):
            raise FlightEnded(ARMED_UNKNOWN, exit_)
