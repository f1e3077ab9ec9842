"""Records the steps of guidance, and how the vehicle tracks the reference.

`FlightTrace` gets the rows that measurements need. If the flight is recorded, `flight.mcap` gets
all values.
"""

from collections.abc import Callable
from math import nan

from companion.control.flown_source import FlownSource
from companion.control.guidance_command import GuidanceCommand
from companion.control.step_rows import StepEntry, StepFlags, StepInput, StepOutput, StepWriter
from companion.control.telemetry import GuidedVehicle
from companion.recording.trace import FlightTrace


class StepRecorder:
    """Records each guidance step, and the beginning of each maneuver.

    Attributes:
        note: called with a message for each maneuver that begins.
    """

    def __init__(
        self, trace: FlightTrace, flown_source: FlownSource, vehicle: GuidedVehicle
    ) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self._trace, self._recorder = trace, trace.recorder
        self._flown_source = flown_source
        self._recorded_maneuver: object = None
        self._vehicle = vehicle
        self._writer = StepWriter()

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
        if output is not None and flags.offboard_active:
            self._record_tracking(now, output)
        if self._recorder is None:
            return
        state = self._vehicle.state
        inputs = StepInput(
            now,
            state.position,
            self._vehicle.clock.offset,
            state.battery,
            state.attitude_target_thrust,
            state.height,
            state.armed,
            flags,
        )
        self._recorder.add(now, self._writer.step, StepEntry(inputs, output, command))

    def action(self, now: float, name: str) -> None:
        """Record that a flight phase called `name` of the guidance loop at `now`, s (loop time)."""
        if self._recorder is not None:
            self._recorder.action(now, name, self._vehicle.clock.offset)

    def _record_tracking(self, now: float, output: StepOutput) -> None:
        """Write reference and position of a step under control, and note a maneuver that begins."""
        flown_part = self._flown_source.part(now)
        maneuver = None if flown_part is None else flown_part.part
        if maneuver is not self._recorded_maneuver:
            self._recorded_maneuver = maneuver
            name = None if flown_part is None else flown_part.name
            self._trace.begin_maneuver(now, output.vehicle_time, name)
            if name is not None:
                self.note(f"maneuver: {name}")
        reference = output.reference
        north, east, down = reference.position_ned
        if not reference.holds_position:
            north = east = nan  # only the height is a reference
        if not reference.holds_height:
            down = nan
        estimated_position = output.inputs.present.position_ned
        self._trace.tracking.add([output.vehicle_time, north, east, down, *estimated_position])
