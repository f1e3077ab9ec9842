"""Records the samples that reach the control loop, and the setpoints that answer them.

`FlightTrace` gets the rows that measurements need. If the flight is recorded, `flight.mcap` gets
all values.
"""

from collections.abc import Callable
from math import nan

from companion.attitude import BodyRates, Limits
from companion.control.guidance_command import GuidanceCommand
from companion.control.loop_record import UnansweredReason
from companion.control.planner_runner import PlannerRunner
from companion.control.sample_rows import Answer, LoopFlags, SampleEntry, SampleWriter
from companion.recording.trace import FlightTrace
from companion.vehicle.records import AttitudeSample, AttitudeTarget


class SampleRecorder:
    """Records each sample and the loop's answer to it.

    The loop calls `begin`, sets `checked_at`, calls `answer` if it sends a setpoint, then `end`. If
    the flight is not recorded in a file, `answer` suffices.

    Args:
        planner: provides the planner's input, and reports each new ATTITUDE_TARGET.
        thrust_limits: smallest and largest thrust that is sent, 0..1.
        clock: returns event-loop time, s.

    Attributes:
        on: whether the flight is recorded in a file.
        checked_at: when the sample's age was checked before sending, s of event-loop time; NaN: it
            was not checked.
    """

    def __init__(
        self,
        trace: FlightTrace,
        planner: PlannerRunner,
        limits: Limits,
        thrust_limits: tuple[float, float],
        clock: Callable[[], float],
    ) -> None:
        self.on = trace.recorder is not None
        self.checked_at = nan
        self._trace, self._recorder, self._planner = trace, trace.recorder, planner
        self._thrust_limits, self._clock = thrust_limits, clock
        self._answer: Answer | None = None
        self.retune(limits)
        if self.on:
            planner.on_attitude_target = self._record_attitude_target

    def retune(self, limits: Limits) -> None:
        """Use other limits of the body rates from the next sample on."""
        self._writer = SampleWriter(limits, self._thrust_limits)

    def begin(self) -> None:
        """Begin a new sample, which is not yet checked or answered."""
        self.checked_at, self._answer = nan, None

    def answer(
        self,
        sample: AttitudeSample,
        command: GuidanceCommand,
        rates: BodyRates,
        thrust: float,
        latency_ns: int,
        *,
        offboard_active: bool,
    ) -> None:
        """Record the setpoint that was sent for this sample; `end` writes it to the file.

        Args:
            sample: the sample.
            command: command of guidance.
            rates: body rates, rad/s.
            thrust: thrust, 0..1.
            latency_ns: time since the sample's arrival, ns.
            offboard_active: whether the autopilot obeys the setpoints.
        """
        trace, time = self._trace, sample.vehicle_time
        trace.latencies_ns.add([latency_ns])
        if offboard_active:
            age = sample.age if sample.age_known else nan
            trace.rates.add([time, sample.received, *rates, thrust, *sample.body_rates, age])
        if command.is_step:
            target = command.target
            q = self._planner.attitude(sample.q)
            trace.response.add([time, *q, target.north, target.east])
        if not self.on:
            return
        planner_was_asked = not command.idle and command.body_rates is None
        planner_input = self._planner.planner_input if planner_was_asked else None
        planned_tilt = self._planner.planned_tilt if planner_was_asked else None
        self._answer = Answer(
            rates, thrust, latency_ns, planner_input, planned_tilt, command.is_step, command.idle
        )

    def end(
        self, sample: AttitudeSample, flags: LoopFlags, reason: UnansweredReason | None
    ) -> None:
        """Record the sample and its answer.

        Args:
            sample: the sample.
            flags: the state of the loop when the sample arrived.
            reason: see `SampleEntry`.
        """
        if self._recorder is None:
            return
        entry = SampleEntry(sample, reason, flags, self.checked_at, self._answer)
        self._recorder.add(sample.received, self._writer.sample, entry)

    def action(self, name: str) -> None:
        """Record that a phase of the flight called the method `name` of the control loop."""
        if self._recorder is not None:
            self._recorder.action(self._clock(), name)

    def _record_attitude_target(self, target: AttitudeTarget) -> None:
        if self._recorder is not None:
            self._recorder.add(self._clock(), self._writer.attitude_target, target)
