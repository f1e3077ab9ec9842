"""The path of one sample: attitude in, body rates out, or a named reason why it is unanswered.

Read `ControlLoop` from `on_sample` downwards: its functions are in the order in which they run.
"""

from collections.abc import Callable
from math import inf
from time import perf_counter_ns

from companion.attitude import (
    AttitudeError,
    BodyRates,
    Constants,
    InvalidQuaternionError,
    Limits,
    Planner,
    is_unit,
)
from companion.control.estimator_resets import EstimatorResets
from companion.control.guidance_command import GuidanceCommand
from companion.control.loop_record import Deadlines, LoopRecord, UnansweredReason
from companion.control.planner_runner import PlannerRunner
from companion.control.sample_recorder import SampleRecorder
from companion.control.sample_rows import LoopFlags
from companion.guidance import HoverThrust
from companion.mavlink.errors import InvalidSetpoint
from companion.recording.trace import FlightTrace
from companion.vehicle.clock_jumps import Misfit
from companion.vehicle.records import AttitudeSample

SendSetpoint = Callable[[int, BodyRates, float], bool]
"""Sends time_boot_ms of a sample, body rates and thrust as a setpoint; False: the link refused it.
In lockstep the link keeps setpoints until the step ends, and sends only the last one of a step."""

_MISFIT_REASONS = {
    Misfit.NOT_NEWER: UnansweredReason.NOT_NEWER,
    Misfit.AHEAD: UnansweredReason.STAMPED_AHEAD,
}
_FINAL_REASONS = {None, UnansweredReason.OLD_TARGET, UnansweredReason.AWAITING_MODE}
"""After `end_stream`, the loop releases control at one of these outcomes: None (the sample was
answered), or a reason for which no later sample can be answered either."""


class ControlLoop:
    """Answers each fresh attitude sample with one setpoint; nothing else sends setpoints.

    After a gap in the setpoints the autopilot may have left offboard, and PX4 would enter offboard
    again on the next setpoint. So after a gap while `taking_over` or `offboard_active`, the loop
    calls `request_mode` and sends nothing until `resume`.

    Attributes:
        command: the newest command, written by guidance; None before the first and after
            `drop_command`.
        on: whether the loop answers samples at all.
        taking_over: whether offboard was requested and may become active at any moment.
        offboard_active: whether the autopilot obeys the setpoints.
        awaiting_mode: whether the loop waits for `resume` after a gap.
        resets: the estimator's resets, which are removed from what the planner gets.
        planner: runs the planner.
        record: counters, latest times, and reasons of unanswered samples.
        request_mode: called once after each gap, to request the mode.
        is_same_vehicle: returns, at each sample, whether the vehicle is the one that was checked.
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
        clock_ns: Callable[[], int] = perf_counter_ns,
    ) -> None:
        self.command: GuidanceCommand | None = None
        self.on = self.taking_over = self.offboard_active = self.awaiting_mode = False
        self.resets = EstimatorResets()
        self.planner = PlannerRunner(planner, self.resets, limits)
        self.record = LoopRecord()
        self.request_mode: Callable[[], None] = lambda: None
        self.is_same_vehicle: Callable[[], bool] = lambda: True
        self._hover_thrust = hover_thrust
        self._send = send
        self._clock = clock
        self._clock_ns = clock_ns
        self._deadlines = deadlines
        self._final_command: GuidanceCommand | None = None
        self._recorder = SampleRecorder(trace, self.planner, limits, hover_thrust.limits, clock)

    def retune(self, constants: Constants, limits: Limits) -> None:
        """Use other gains and limits from the next sample on.

        Raises:
            TypeError: the planner is of another package and cannot change them.
        """
        self.planner.retune(constants, limits)
        self._recorder.retune(limits)

    def on_sample(self, sample: AttitudeSample) -> None:
        """Send a setpoint for a sample, or count why not.

        In lockstep this is called when the sample's step is complete.
        """
        if not self._recorder.on:
            self._handle_sample(sample)
            return
        flags = LoopFlags(
            self.on,
            self.taking_over,
            self.offboard_active,
            self.awaiting_mode,
            self.is_same_vehicle(),
        )
        self._recorder.begin()
        self._handle_sample(sample)
        self._recorder.end(sample, flags, self.record.reason)

    def _handle_sample(self, sample: AttitudeSample) -> None:
        if sample.misfit is None and self.resets.on_attitude(sample):
            self.planner.restart()
        record = self.record
        period = record.note_arrival(sample)
        if not self.on:
            return
        record.samples += 1
        command = self._final_command or self.command
        reason: UnansweredReason | None
        if not self.is_same_vehicle():
            reason = UnansweredReason.ANOTHER_VEHICLE
        elif sample.misfit is not None:
            reason = _MISFIT_REASONS[sample.misfit]
        elif not sample.age <= self._deadlines.telemetry_stale:
            reason = UnansweredReason.LATE
        elif command is None:
            reason = UnansweredReason.NO_TARGET
        elif sample.received - command.made_at > self._deadlines.target_stale:
            reason = UnansweredReason.OLD_TARGET
        elif self._after_gap(sample.received):
            reason = UnansweredReason.AWAITING_MODE
        else:
            reason = self._send_answer(sample, command, period)
        record.reason = reason
        if reason is not None:
            record.unanswered[reason] += 1
        if self._final_command is not None and reason in _FINAL_REASONS:
            self.release()

    def _after_gap(self, now: float) -> bool:
        """Whether nothing is sent until `resume`; at a new gap in telemetry, request the mode."""
        if not (self.offboard_active or self.taking_over):
            return False
        gap = now - self.record.gap_start
        if gap > self._deadlines.telemetry_stale and not self.awaiting_mode:
            self.awaiting_mode = True
            self.record.gaps.append(now)
            self.request_mode()
        return self.awaiting_mode

    def _send_answer(
        self, sample: AttitudeSample, command: GuidanceCommand, period: float
    ) -> UnansweredReason | None:
        """Send the setpoint for a sample; return why it could not be sent, or None."""
        try:
            rates, thrust = self._compute_setpoint(sample, command, period)
            # This process may have been stopped since the sample came.
            now = self._recorder.checked_at = self._clock()
            if sample.age + now - sample.received > self._deadlines.telemetry_stale:
                return UnansweredReason.LATE
            if not self._send(sample.time_boot_ms, rates, thrust):
                return UnansweredReason.NOT_SENT
        except AttitudeError as error:
            return UnansweredReason.of(error)
        except InvalidSetpoint:
            return UnansweredReason.INVALID_SETPOINT
        self._note_answer(sample, command, rates, thrust)
        return None

    def _compute_setpoint(
        self, sample: AttitudeSample, command: GuidanceCommand, period: float
    ) -> tuple[BodyRates, float]:
        """Body rates and thrust for a sample.

        Raises:
            AttitudeError: the attitude or the target cannot be used.
        """
        if command.idle:
            return BodyRates(0.0, 0.0, 0.0), 0.0
        # Checked here, because body rates from guidance bypass the planner's own check.
        if not is_unit(sample.q):
            raise InvalidQuaternionError(f"attitude {sample.q} is no unit quaternion")
        hover_thrust = self._hover_thrust
        thrust = (
            hover_thrust.normalised_thrust(command.acceleration_down, sample.q, sample.body_rates)
            if command.thrust is None
            else hover_thrust.within_limits(command.thrust)
        )
        return self.planner.rates(sample, command, period), thrust

    def _note_answer(
        self, sample: AttitudeSample, command: GuidanceCommand, rates: BodyRates, thrust: float
    ) -> None:
        record, deadlines = self.record, self._deadlines
        record.note_answer(sample.received, rates, thrust, deadlines.telemetry_stale)
        latency = record.latency_ns = self._clock_ns() - sample.received_ns
        record.missed_deadlines += latency > deadlines.deadline * 1e9
        active = self.offboard_active
        if active:
            self._hover_thrust.note_thrust(thrust, sample.q)
        self._recorder.answer(sample, command, rates, thrust, latency, offboard_active=active)

    def drop_command(self) -> None:
        """Drop the newest command, so that nothing is sent until guidance makes another one."""
        self.command = None
        self._recorder.action("drop_command")

    def release(self) -> None:
        """Send nothing from here on."""
        self._final_command = None
        self.on = self.offboard_active = self.taking_over = False

    def end_stream(self) -> None:
        """Answer one more fresh sample, with zero body rates; the autopilot holds them for a while.

        If offboard is not active, or there is no command, send nothing more.
        """
        if self.on and self.offboard_active and self.command is not None:
            self._final_command = self._final_command or self.command.without_turning()
        else:
            self.release()
        self._recorder.action("stop_turning")

    def restart_planner(self) -> None:
        """Reset the planner at the next sample, because its state is not valid any more."""
        self.planner.restart()
        self._recorder.action("restart_planner")

    def resume(self) -> None:
        """Send setpoints again after a gap, because the autopilot has confirmed offboard."""
        self.awaiting_mode = False
        self.record.gap_start = inf
