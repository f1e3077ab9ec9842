"""The way of one sample: attitude in, body rates out, or a stated reason why not."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, nan
from time import perf_counter_ns

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
from companion.control.command import Command
from companion.control.estimator_resets import EstimatorResets
from companion.control.unanswered import Unanswered
from companion.guidance import HoverThrust
from companion.mavlink.errors import InvalidSetpoint
from companion.recording.trace import FlightTrace
from companion.vehicle.clock_jumps import Misfit
from companion.vehicle.held_rates import HeldRates
from companion.vehicle.records import AttitudeSample, AttitudeTarget

SendSetpoint = Callable[[int, BodyRates, float], bool]

_LONGEST_STEP = 0.1
"""A planner never integrates over more than this, s."""

_GAPS = 32
"""So many of the latest gaps are kept; far fewer end a flight."""

_MISFITS = {Misfit.NOT_NEWER: Unanswered.NOT_NEWER, Misfit.AHEAD: Unanswered.AHEAD}


@dataclass(frozen=True, slots=True)
class Deadlines:
    """When data is too old, and when an answer is too late; all in s."""

    telemetry_stale: float
    target_stale: float
    deadline: float


class ControlLoop:
    """Answers each fresh attitude sample with one setpoint; there is no other way to send one.

    While `taking_over` or `offboard_active` (the autopilot may obey us, or does), a gap in the
    answers is not silently closed: the autopilot may have left offboard meanwhile, and PX4 would
    enter it again on our next setpoint. So the loop asks for the mode and waits for `resume`.

    Attributes:
        command: the newest command; guidance writes it, None means none yet.
        on: whether samples are answered at all.
        taking_over: whether offboard was asked for, so that the autopilot may obey us any moment.
        offboard_active: whether a gap needs the autopilot's mode confirmed.
        awaiting_mode: a gap happened and `resume` has not come yet.
        resets: jumps of the estimate, which the planner does not see.
        ask_mode: called once a gap, when telemetry is back.
        is_same_vehicle: asked at each sample: whether it is of the vehicle that was checked.
        attitude_target: asked at each sample: what the autopilot last told of the axes along which
            it takes our rates, where these are not the body's.
        thrust: as it was last sent, 0..1.
        last_answer, last_sample: when a setpoint last left, and when a sample last came, s on our
            clock.
        samples, setpoints, missed_deadlines: counts since the loop was made.
        held: for how long each setpoint stood until the next one, gaps left out.
        gaps: when the latest gaps ended, s on our clock: nothing was answered for longer than
            `Deadlines.telemetry_stale` while `offboard_active`.
        unanswered: how many samples were not answered, by reason.
        reason: why the newest sample was not answered, or None.
    """

    def __init__(
        self,
        planner: Planner,
        hover_thrust: HoverThrust,
        send: SendSetpoint,
        deadlines: Deadlines,
        trace: FlightTrace,
        limits: Limits,
        clock: Callable[[], float],
    ) -> None:
        self.command: Command | None = None
        self.on = False
        self.taking_over = False
        self.offboard_active = False
        self.awaiting_mode = False
        self.resets = EstimatorResets()
        self.thrust = 0.0
        self.ask_mode: Callable[[], None] = lambda: None
        self.is_same_vehicle: Callable[[], bool] = lambda: True
        self.attitude_target: Callable[[], AttitudeTarget | None] = lambda: None
        self.last_answer = self.last_sample = -inf
        self.samples = self.setpoints = self.missed_deadlines = 0
        self.held = HeldRates()
        self.gaps: deque[float] = deque(maxlen=_GAPS)
        self.unanswered = dict.fromkeys(Unanswered, 0)
        self.reason: Unanswered | None = None
        self._planner = planner
        self._hover_thrust = hover_thrust
        self._send = send
        self._clock = clock
        self._deadlines = deadlines
        self._trace = trace
        self._limits = limits
        self._last_time = -inf
        self._planned_at = -inf
        self._noted: AttitudeTarget | None = None
        self._turn, self._turned_ms = 0.0, -1
        self._period = 0.0
        self._gap_from = inf

    def resume(self) -> None:
        """The autopilot still is in offboard: go on after a gap."""
        self.awaiting_mode = False
        self._gap_from = inf

    def plan_anew(self) -> None:
        """Let the planner begin anew at the next sample: what it planned from does not hold."""
        self._planned_at = -inf

    def on_sample(self, sample: AttitudeSample) -> None:
        """Answer `sample`, or count why not. Called by the link as the datagram arrives."""
        if sample.misfit is None and self.resets.on_attitude(sample):
            self.plan_anew()
        dt = self._note_arrival(sample)
        if not self.on:
            return
        self.samples += 1
        command = self.command
        reason: Unanswered | None
        if not self.is_same_vehicle():
            reason = Unanswered.ANOTHER_VEHICLE
        elif sample.misfit is not None:
            reason = _MISFITS[sample.misfit]
        elif not sample.age <= self._deadlines.telemetry_stale:
            reason = Unanswered.LATE
        elif command is None:
            reason = Unanswered.NO_TARGET
        elif sample.received - command.made_at > self._deadlines.target_stale:
            reason = Unanswered.OLD_TARGET
        elif self._after_gap(sample.received):
            reason = Unanswered.AWAITING_MODE
        else:
            reason = self._send_answer(sample, command, dt)
        self.reason = reason
        if reason is not None:
            self.unanswered[reason] += 1

    @property
    def stale(self) -> int:
        """Samples not answered because they or the target were too old or out of order."""
        return sum(n for reason, n in self.unanswered.items() if not reason.is_refusal)

    @property
    def refused(self) -> int:
        """Samples not answered because there was no answer, or because it could not leave."""
        return sum(n for reason, n in self.unanswered.items() if reason.is_refusal)

    def _send_answer(
        self, sample: AttitudeSample, command: Command, dt: float
    ) -> Unanswered | None:
        """Send the answer to a sample; returns why it did not leave, or None."""
        try:
            rates, thrust = self._answer(sample, command, dt)
            # This process may have been stopped since the sample came.
            if sample.age + self._clock() - sample.received > self._deadlines.telemetry_stale:
                return Unanswered.LATE
            if not self._send(sample.time_boot_ms, rates, thrust):
                return Unanswered.NOT_SENT
        except AttitudeError:
            return Unanswered.INVALID_ATTITUDE
        except InvalidSetpoint:
            return Unanswered.INVALID_SETPOINT
        self._account(sample, command, rates, thrust)
        return None

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
            target = command.target_at(sample.received - sample.age)
            return self._plan(sample, self.resets.target(target, command.turn), dt)
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
        self._note_attitude_target(sample)
        return self._planner.rates(q, target, since, sample.body_rates)

    def _note_attitude_target(self, sample: AttitudeSample) -> None:
        """Pass a new ATTITUDE_TARGET on to the planner, once a sample is as new as it is.

        One from before a jump of the heading is in a frame that we cannot tell, and passed over.
        """
        if self.resets.turn != self._turn:
            self._turn, self._turned_ms = self.resets.turn, sample.time_boot_ms
        told = self.attitude_target()
        if told is None or told is self._noted:
            return
        if self._turned_ms < told.time_boot_ms <= sample.time_boot_ms:
            self._noted = told
            age = 1e-3 * (sample.time_boot_ms - told.time_boot_ms)
            self._planner.note_attitude_target(self.resets.attitude(told.q), age)

    def _note_arrival(self, sample: AttitudeSample) -> float:
        """Keep what the watch asks for; returns the sample period in s."""
        self.last_sample = sample.received
        dt = min(sample.vehicle_time - self._last_time, _LONGEST_STEP)
        if sample.misfit is None:
            self._last_time = sample.vehicle_time
        return dt

    def _after_gap(self, now: float) -> bool:
        if not (self.offboard_active or self.taking_over):
            return False
        if now - self._gap_from > self._deadlines.telemetry_stale and not self.awaiting_mode:
            self.awaiting_mode = True
            self.gaps.append(now)
            self.ask_mode()
        return self.awaiting_mode

    def _account(
        self,
        sample: AttitudeSample,
        command: Command,
        rates: BodyRates,
        thrust: float,
    ) -> None:
        self.setpoints += 1
        self.thrust = thrust
        interval = sample.received - self.last_answer
        if interval <= self._deadlines.telemetry_stale:
            self.held.add(interval)
        self.last_answer = self._gap_from = sample.received
        latency = perf_counter_ns() - sample.received_ns
        self.missed_deadlines += latency > self._deadlines.deadline * 1e9
        self._trace.add_latency(latency)
        if self.offboard_active:
            self._hover_thrust.sent(thrust, sample.q)
            self._trace.add_rates(
                sample.vehicle_time,
                sample.received,
                rates,
                thrust,
                sample.body_rates,
                sample.age if sample.age_known else nan,
            )
        if command.is_step:
            self._trace.add_response(sample.vehicle_time, sample.q, command.target)
