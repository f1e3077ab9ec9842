"""The parts of one flight, joined to run over an open link, and its figures afterwards."""

from dataclasses import dataclass

from companion.flight.changes import Changes
from companion.flight.context import FlightContext
from companion.flight.dead_time_watch import DeadTimeWatch
from companion.flight.flight import Flight
from companion.flight.status import StatusReporter
from companion.flight.vehicle_identity import DragMemory
from companion.recording.measurements.summary import LoopCounts, PredictiveFigures
from companion.recording.trace import FlightTrace
from companion.safety import SafetyLadder


@dataclass(frozen=True, slots=True)
class AssembledFlight:
    """The parts of a flight that is ready to run; `assembly.assemble` makes and joins them."""

    flight: Flight
    context: FlightContext
    trace: FlightTrace
    dead_time_watch: DeadTimeWatch
    drag_memory: DragMemory
    ladder: SafetyLadder
    reporter: StatusReporter
    changes: Changes

    def close(self) -> None:
        """End the process of predictive control, if there is one."""
        if self.context.guidance_loop.maker.predictive_control is not None:
            self.context.guidance_loop.maker.predictive_control.close()

    def predictive_figures(self) -> PredictiveFigures | None:
        """The figures of predictive control; None if the flight did not use it."""
        predictive = self.context.guidance_loop.maker.predictive_control
        if predictive is None:
            return None
        record = predictive.record
        troubles = {trouble.value: count for trouble, count in record.troubles.items()}
        return PredictiveFigures(record.flown_answers, troubles, tuple(record.computing_seconds))

    def counts(self) -> LoopCounts:
        """The counters of the control loop."""
        record = self.context.loop.record
        return LoopCounts(
            samples=record.samples,
            setpoints=record.setpoints,
            missed_deadlines=record.missed_deadlines,
            stale=record.stale_count,
            refused=record.refused_count,
            unanswered={reason.value: count for reason, count in record.unanswered.items()},
            rate_hz=self.context.setpoint_rate_hz,
        )
