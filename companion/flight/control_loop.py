"""The way of one sample: attitude in, body rates out, or a stated reason why not."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from time import perf_counter_ns
from typing import NamedTuple

from companion.attitude import (
    AttitudeError,
    BodyRates,
    InvalidQuaternionError,
    Limits,
    Planner,
    Target,
    is_unit,
)
from companion.attitude.rotation import within_limits
from companion.flight.estimator_resets import EstimatorResets
from companion.flight.freshness import SampleClock
from companion.guidance import HoverThrust
from companion.mavlink.errors import InvalidSetpoint
from companion.mavlink.samples import AttitudeSample
from companion.recording.trace import FlightTrace

SendSetpoint = Callable[[int, BodyRates, float], bool]

_LONGEST_STEP = 0.1
"""A planner never integrates over more than this, s."""


class Command(NamedTuple):
    """What guidance left behind for the loop.

    Attributes:
        target: for the planner; its heading is the one without jumps (`EstimatorResets`).
        acceleration_down: wanted vertical acceleration, m/s².
        made_at: when, s on our clock.
        idle: on the ground: no rates, no thrust.
        is_step: an open-loop step, whose response is measured.
        body_rates: instead of the planner's, rad/s; sent as far as the limits allow.
        turn: sum of the estimate's jumps in heading when it was made, rad.
    """

    target: Target
    acceleration_down: float
    made_at: float
    idle: bool = False
    is_step: bool = False
    body_rates: BodyRates | None = None
    turn: float = 0.0


@dataclass(frozen=True, slots=True)
class Deadlines:
    """When data is too old, and when an answer is too late; all in s."""

    telemetry_stale: float
    target_stale: float
    deadline: float


class ControlLoop:
    """Answers each fresh attitude sample with one setpoint; there is no other way to send one.

    While `taking_over` or `guarded` (the autopilot may obey us, or does), a gap in the answers is
    not silently closed: the autopilot may have left offboard meanwhile, and PX4 would enter it
    again on our next setpoint. So the loop asks for the mode and waits for `resume`.

    Attributes:
        command: the newest command; guidance writes it, None means none yet.
        on: whether samples are answered at all.
        taking_over: whether offboard was asked for, so that the autopilot may obey us any moment.
        guarded: whether a gap needs the autopilot's mode confirmed.
        held_back: a gap happened and `resume` has not come yet.
        resets: jumps of the estimate, which the planner does not see.
        ask_mode: called once a gap, when telemetry is back.
        thrust: as it was last sent, 0..1.
        last_answer, last_sample, last_newer, last_fresh: when a setpoint last left; when a sample
            last came; one that was newer than those before; and one that was fresh. s on our clock.
        samples, setpoints, missed_deadlines, stale, refused: counts since the loop was made.
    """

    def __init__(
        self,
        planner: Planner,
        hover_thrust: HoverThrust,
        send: SendSetpoint,
        deadlines: Deadlines,
        trace: FlightTrace,
        limits: Limits,
    ) -> None:
        self.command: Command | None = None
        self.on = False
        self.taking_over = False
        self.guarded = False
        self.held_back = False
        self.resets = EstimatorResets()
        self.thrust = 0.0
        self.ask_mode: Callable[[], None] = lambda: None
        self.last_answer = self.last_sample = self.last_newer = self.last_fresh = -inf
        self.samples = self.setpoints = self.missed_deadlines = self.stale = self.refused = 0
        self._planner = planner
        self._hover_thrust = hover_thrust
        self._send = send
        self._deadlines = deadlines
        self._trace = trace
        self._limits = limits
        self._clock = SampleClock()
        self._last_time = -inf
        self._planned_at = -inf
        self._period = 0.0
        self._gap_from = inf

    def resume(self) -> None:
        """The autopilot still is in offboard: go on after a gap."""
        self.held_back = False
        self._gap_from = inf

    def plan_anew(self) -> None:
        """Let the planner begin anew at the next sample: what it planned from does not hold."""
        self._planned_at = -inf

    def on_sample(self, sample: AttitudeSample) -> None:
        """Answer `sample`, or count why not. Called by the link as the datagram arrives."""
        age = self._clock.age(sample.vehicle_time, sample.received)
        if age is not None and self.resets.on_attitude(sample):
            self.plan_anew()
        fresh = age is not None and age <= self._deadlines.telemetry_stale
        dt = self._note_arrival(sample, newer=age is not None, fresh=fresh)
        if not self.on:
            return
        self.samples += 1
        command = self.command
        if (
            not fresh
            or command is None
            or sample.received - command.made_at > self._deadlines.target_stale
            or self._after_gap(sample.received)
        ):
            self.stale += 1
            return
        try:
            rates, thrust = self._answer(sample, command, dt)
            left = self._send(sample.time_boot_ms, rates, thrust)
        except (AttitudeError, InvalidSetpoint):
            left = False
        if not left:
            self.refused += 1
            return
        self._account(sample, command, rates, thrust)

    def _answer(
        self, sample: AttitudeSample, command: Command, dt: float
    ) -> tuple[BodyRates, float]:
        """Rates and thrust for a sample; raises `AttitudeError` where there are none."""
        if command.idle:
            return BodyRates(0.0, 0.0, 0.0), 0.0
        # Not left to the planner: rates by guidance do not ask it, and the thrust does not look.
        if not is_unit(sample.q):
            raise InvalidQuaternionError(f"attitude {sample.q} is no unit quaternion")
        return self._rates(sample, command, dt), self._hover_thrust.normalised(
            command.acceleration_down, sample.q, sample.body_rates
        )

    def _rates(self, sample: AttitudeSample, command: Command, dt: float) -> BodyRates:
        """The planner's answer, or the rates that guidance asks for within the same limits."""
        if command.body_rates is None:
            return self._plan(sample, self.resets.target(command.target, command.turn), dt)
        limits = self._limits
        return BodyRates(*within_limits(*command.body_rates, limits.tilt_rate, limits.yaw_rate))

    def _plan(self, sample: AttitudeSample, target: Target, dt: float) -> BodyRates:
        """Ask the planner; after a gap, or at the first sample, it is to begin anew."""
        q = self.resets.attitude(sample.q)
        since = sample.vehicle_time - self._planned_at
        if since > _LONGEST_STEP:
            self._planner.reset(q, sample.body_rates)
            since = self._period or dt  # a gap says nothing of when the next sample comes
        self._period = since
        self._planned_at = sample.vehicle_time
        return self._planner.rates(q, target, since, sample.body_rates)

    def _note_arrival(self, sample: AttitudeSample, *, newer: bool, fresh: bool) -> float:
        """Keep what the watch asks for; returns the sample period in s."""
        dt = min(sample.vehicle_time - self._last_time, _LONGEST_STEP)
        self.last_sample = sample.received
        if newer:
            self._last_time, self.last_newer = sample.vehicle_time, sample.received
        if fresh:
            self.last_fresh = sample.received
        return dt

    def _after_gap(self, now: float) -> bool:
        if not (self.guarded or self.taking_over):
            return False
        if now - self._gap_from > self._deadlines.telemetry_stale and not self.held_back:
            self.held_back = True
            self.ask_mode()
        return self.held_back

    def _account(
        self,
        sample: AttitudeSample,
        command: Command,
        rates: BodyRates,
        thrust: float,
    ) -> None:
        self.setpoints += 1
        self.thrust = thrust
        self.last_answer = self._gap_from = sample.received
        latency = perf_counter_ns() - sample.received_ns
        self.missed_deadlines += latency > self._deadlines.deadline * 1e9
        self._trace.add_latency(latency)
        if self.guarded:
            self._hover_thrust.sent(thrust, sample.q)
            self._trace.add_rates(
                sample.vehicle_time, sample.received, rates, thrust, sample.body_rates
            )
        if command.is_step:
            self._trace.add_response(sample.vehicle_time, sample.q, command.target)
