"""Assembles a flight over an open link: loops, monitors, watch and phases."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from math import nan
from pathlib import Path

from companion.config import Config
from companion.control.ground_contact import GroundContact
from companion.control.loops import make_loops
from companion.control.outer_loop import make_predictive_control
from companion.control.telemetry import GuidedVehicle
from companion.flight.changes import Changes
from companion.flight.context import FlightContext
from companion.flight.dead_time_watch import DeadTimeWatch
from companion.flight.environment import Environment
from companion.flight.flight import AskLanding, Flight
from companion.flight.flown_config import description, flattened
from companion.flight.maneuvers import fresh_copy
from companion.flight.observer import EventRecorder
from companion.flight.phase import Phase
from companion.flight.plan import Plan
from companion.flight.preflight_checks import PreflightChecks
from companion.flight.rate_requester import RateRequester
from companion.flight.status import StatusReporter
from companion.flight.vehicle_identity import DragMemory, ReplacementDetector
from companion.flight.watch import Watch
from companion.guidance.follow import Follow
from companion.recording.trace import FlightTrace
from companion.safety import SafetyLadder, monitors
from companion.safety.snapshot_builder import SnapshotBuilder
from companion.vehicle.link import Link


@dataclass(frozen=True, slots=True)
class AssembledFlight:
    """The parts of a flight that is ready to run; `assemble` makes and joins them."""

    flight: Flight
    context: FlightContext
    trace: FlightTrace
    dead_time_watch: DeadTimeWatch
    drag_memory: DragMemory
    ladder: SafetyLadder
    reporter: StatusReporter
    recorder: EventRecorder
    changes: Changes

    def close(self) -> None:
        """End the solver's process, if the flight uses predictive control."""
        predictive_control = self.context.guidance_loop.command_maker.predictive_control
        if predictive_control is not None:
            predictive_control.close()


def assemble(
    config: Config,
    link: Link,
    recorder: EventRecorder,
    ask_landing: AskLanding,
    folder: Path | None,
    plan: Plan,
    environment: Environment,
    changes: Changes,
) -> AssembledFlight:
    """Assemble a flight with the phases of `plan` over an open link.

    The records of the flight are written to `folder`; None: nothing is written, and nothing is kept
    for later flights.
    """
    clock: Callable[[], float] = asyncio.get_running_loop().time
    flight_recorder, real_time = recorder.file, environment.realtime and not config.link.lockstep
    trace = FlightTrace(folder, flight_recorder)
    context = _context(config, link, plan, trace, environment)
    ladder = SafetyLadder(monitors(config), config.safety.hold_s)
    rate_requester = RateRequester(link, config.link)
    watch = Watch(context, ladder, rate_requester, clock)
    context.loop.request_mode = watch.request_mode
    flight = Flight(context, plan, watch, recorder, ask_landing)
    ladder.note = context.note = context.preflight.note = flight.note
    context.guidance_loop.recorder.note = rate_requester.note = recorder.note = flight.note
    memory = _drag_memory(context, folder, flight.note, changes)
    _prepare_trajectories(context, flight.note, real_time=real_time)
    if flight_recorder is not None:
        flight_recorder.metadata(
            "configuration", flattened(changes.config_at_flight_start.model_dump(mode="json"))
        )
        flight_recorder.begin(
            flight.began, description(changes.config_at_flight_start, plan, real_time=real_time)
        )
        ladder.on_change = flight_recorder.alarm
        memory.on_estimate_begin = lambda known_drag: flight_recorder.action(
            clock(), "drag_prior", drag=known_drag.drag or (nan, nan)
        )
    dead_time_watch = DeadTimeWatch(trace, config.vehicle.axes, flight.note)
    reporter = _reporter(flight, context, ladder, trace, recorder, real_time=real_time)
    return AssembledFlight(
        flight, context, trace, dead_time_watch, memory, ladder, reporter, recorder, changes
    )


def _context(
    config: Config, link: Link, plan: Plan, trace: FlightTrace, environment: Environment
) -> FlightContext:
    """Make the context of a flight: its loops, and the other parts that its phases share."""
    clock: Callable[[], float] = asyncio.get_running_loop().time
    ground = GroundContact(link.state, clock)
    loop, guidance_loop = make_loops(
        config,
        link.send_setpoint,
        GuidedVehicle(link.state, ground, link.clock),
        trace,
        clock,
        environment.clock_ns,
    )
    loop.planner.attitude_target = lambda: link.state.attitude_target
    snapshot_builder = SnapshotBuilder(
        link, loop, guidance_loop, real_time=not config.link.lockstep
    )
    replacement_detector = ReplacementDetector(link, clock)
    loop.is_same_vehicle = lambda: replacement_detector.is_same_vehicle
    preflight = PreflightChecks(config, link, replacement_detector, fresh_copy(plan.maneuvers))
    return FlightContext(
        config,
        link,
        loop,
        guidance_loop,
        snapshot_builder,
        plan.maneuvers,
        ground,
        preflight,
        replacement_detector,
    )


def _drag_memory(
    context: FlightContext, folder: Path | None, note: Callable[[str], None], changes: Changes
) -> DragMemory:
    """Make the `DragMemory`, which gives checks and guidance the drag from earlier flights."""
    memory_folder = None if folder is None else folder.parent
    memory = DragMemory(context.config, memory_folder, context.guidance_loop.estimate.drag, note)
    memory.on_known_drag = changes.on_known_drag
    context.preflight.load_drag = memory.load
    return memory


def _prepare_trajectories(
    context: FlightContext, note: Callable[[str], None], *, real_time: bool
) -> None:
    """Note the messages about trajectory files; with `guidance.kind: nmpc`, start the solver."""
    for maneuver in context.maneuvers.parts:
        if isinstance(maneuver, Follow):
            for text in maneuver.notes:
                note(text)
            if context.config.guidance.kind == "nmpc":
                context.guidance_loop.command_maker.predictive_control = make_predictive_control(
                    context.config, maneuver, note, vehicle_waits=not real_time
                )


def _reporter(
    flight: Flight,
    context: FlightContext,
    ladder: SafetyLadder,
    trace: FlightTrace,
    recorder: EventRecorder,
    *,
    real_time: bool,
) -> StatusReporter:
    """Make the reporter of the flight's state; it shows the state only if the observer wants it."""

    def current_phase() -> tuple[Phase, float]:
        return flight.phase, recorder.phases[-1][0] if recorder.phases else flight.began

    return StatusReporter(
        context,
        ladder,
        trace,
        flight.began,
        current_phase,
        recorder.status if recorder.wants_status else None,
        asyncio.get_running_loop().time,
        real_time=real_time,
    )
