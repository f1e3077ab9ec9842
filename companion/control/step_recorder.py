"""Records the steps of guidance."""

from companion.control.guidance_command import GuidanceCommand
from companion.control.step_rows import StepEntry, StepFlags, StepInput, StepOutput, StepRows
from companion.control.telemetry import Clock, Telemetry
from companion.recording.recorder import FlightRecorder


class StepRecorder:
    """Records the inputs and outputs of each guidance step, if the flight is recorded.

    Args:
        recorder: recorder of the flight, or None.
        state: telemetry that the steps read.
        vehicle_clock: the vehicle's clock.
    """

    def __init__(
        self, recorder: FlightRecorder | None, state: Telemetry, vehicle_clock: Clock
    ) -> None:
        self._recorder, self._state, self._vehicle_clock = recorder, state, vehicle_clock
        self._rows = StepRows()

    def step(
        self,
        flags: StepFlags,
        now: float,
        output: StepOutput | None,
        command: GuidanceCommand | None,
    ) -> None:
        """Record a step that began at `now`, s of event-loop time.

        Args:
            flags: state of the vehicle at the step.
            now: event-loop time, s.
            output: result of the step, or None.
            command: the command for the control loop; None: no new command.
        """
        if self._recorder is None:
            return
        state = self._state
        inputs = StepInput(
            now,
            state.position,
            self._vehicle_clock.offset,
            state.battery,
            state.attitude_target_thrust,
            state.height,
            state.armed,
            flags,
        )
        self._recorder.add(now, self._rows.step, StepEntry(inputs, output, command))

    def action(self, now: float, name: str) -> None:
        """Record a call at `now` by which a phase of the flight controls guidance; see `step`."""
        if self._recorder is not None:
            self._recorder.action(now, name, self._vehicle_clock.offset)
