"""Records the steps of guidance, and how the vehicle tracks the reference."""

from collections.abc import Callable
from math import nan

from companion.control.flown_source import FlownSource
from companion.control.guidance_command import GuidanceCommand
from companion.control.step_rows import StepEntry, StepFlags, StepInput, StepOutput, StepRows
from companion.control.telemetry import GuidedVehicle
from companion.guidance.reference import Reference, VehicleMotion
from companion.recording.recorder import FlightRecorder
from companion.recording.trace import FlightTrace


class StepRecorder:
    """Records the inputs and outputs of each guidance step, if the flight is recorded.

    Args:
        recorder: recorder of the flight, or None.
        vehicle: what the steps read.
    """

    def __init__(self, recorder: FlightRecorder | None, vehicle: GuidedVehicle) -> None:
        self._recorder, self._vehicle = recorder, vehicle
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
        self._recorder.add(now, self._rows.step, StepEntry(inputs, output, command))

    def action(self, now: float, name: str) -> None:
        """Record a call at `now` by which a phase of the flight controls guidance; see `step`."""
        if self._recorder is not None:
            self._recorder.action(now, name, self._vehicle.clock.offset)


class TrackingRecord:
    """Writes reference, position, and the beginning of each maneuver to the trace.

    Args:
        trace: the trace of the flight.
        flown_source: the source that guidance flies.

    Attributes:
        note: called with a message for each maneuver that begins.
    """

    def __init__(self, trace: FlightTrace, flown_source: FlownSource) -> None:
        self.note: Callable[[str], None] = lambda _: None
        self._trace = trace
        self._flown_source = flown_source
        self._recorded_part: object = None

    def add(
        self, now: float, vehicle_time: float, reference: Reference, motion: VehicleMotion
    ) -> None:
        """Record one step of guidance.

        Args:
            now: event-loop time, s.
            vehicle_time: the same time on the vehicle's clock, s.
            reference: reference at this time.
            motion: motion of the vehicle at this time.
        """
        flown = self._flown_source.part(now)
        part = None if flown is None else flown.part
        if part is not self._recorded_part:
            self._recorded_part = part
            name = None if flown is None else flown.name
            self._trace.begin_maneuver(now, vehicle_time, name)
            if name is not None:
                self.note(f"maneuver: {name}")
        north, east, down = reference.position_ned
        if not reference.holds_position:
            north = east = nan  # only the height is a reference
        if not reference.holds_height:
            down = nan
        self._trace.add_tracking(vehicle_time, (north, east, down), motion.position_ned)
