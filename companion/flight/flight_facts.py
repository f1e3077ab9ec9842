"""What happened in a finished flight, for its report: counters, phases, early end, advice."""

import asyncio

from companion.control.expected_response import gain_warning
from companion.flight.assembly import AssembledFlight
from companion.flight.context import FlightContext
from companion.recording.measurements.dead_time import DeadTimes
from companion.recording.measurements.flight_facts import EarlyEnd, FlightFacts
from companion.recording.measurements.summary import LoopCounts, PredictiveFigures


def loop_counts(context: FlightContext) -> LoopCounts:
    """The counters of the control loop."""
    record = context.loop.record
    return LoopCounts(
        samples=record.samples,
        setpoints=record.setpoints,
        missed_deadlines=record.missed_deadlines,
        stale=record.stale_count,
        refused=record.refused_count,
        unanswered={reason.value: count for reason, count in record.unanswered.items()},
        rate_hz=context.setpoint_rate_hz,
    )


def predictive_figures(context: FlightContext) -> PredictiveFigures | None:
    """The figures of predictive control; None if the flight did not use it."""
    predictive_control = context.guidance_loop.command_maker.predictive_control
    if predictive_control is None:
        return None
    record = predictive_control.record
    troubles = {trouble.value: count for trouble, count in record.troubles.items()}
    return PredictiveFigures(record.flown_answers, troubles, tuple(record.computing_seconds))


def advice(
    assembled: AssembledFlight, dead_times: DeadTimes, *, is_drag_saved: bool
) -> tuple[str, ...]:
    """Advice: what differs from the configuration and which key to set, one sentence each.

    With `is_drag_saved`, the vehicle's next flight begins with the learned drag. So the advice
    names no drag key: a configured drag would take precedence over the learned drag.
    """
    guidance_loop = assembled.context.guidance_loop
    warnings = (
        guidance_loop.learning.mismatch_warning(),
        None if is_drag_saved else guidance_loop.estimate.mismatch_warning(),
        dead_times.warning(),
        assembled.trace.lost_rows_warning(),
    )
    return tuple(warning for warning in warnings if warning is not None)


def _learned_settings(context: FlightContext, *, is_drag_saved: bool) -> dict[str, str]:
    """The keys of thrust and drag that the advice names, with the values that were learned."""
    learning, estimate = context.guidance_loop.learning, context.guidance_loop.estimate
    settings: dict[str, str] = {}
    if learning.mismatch_warning() is not None:
        settings["thrust.hover_thrust"] = f"{learning.hover_thrust.measured_hover:.2f}"
    if not is_drag_saved and estimate.mismatch_warning() is not None:
        drag = estimate.drag.drag
        settings["guidance.drag_per_s"] = f"{drag.linear:.2f}"
        settings["guidance.quadratic_drag_per_m"] = f"{drag.quadratic:.3f}"
    return settings


def facts_of(
    assembled: AssembledFlight, result: str, advice_texts: tuple[str, ...], *, is_drag_saved: bool
) -> FlightFacts:
    """The facts of a finished flight.

    `advice_texts`: advice of the flight; see `advice`. `is_drag_saved`: see `advice`.
    """
    flight, context, reporter = assembled.flight, assembled.context, assembled.reporter
    state, began, config = context.link.state, flight.began, context.config
    now = asyncio.get_running_loop().time()
    battery_at_end = None if state.battery is None else state.battery.remaining
    takeoff = None if reporter.takeoff_time is None else reporter.takeoff_time - began
    return FlightFacts(
        start_time=began,
        phases=tuple(
            (phase_began - began, name) for phase_began, name in assembled.recorder.phases
        ),
        takeoff_time=takeoff,
        early_end=_early_end(assembled, takeoff, result, now),
        vehicle_uid=context.replacement_detector.uid,
        armed=state.armed,
        mode=state.mode,
        silence=_silence_duration(context, now),
        tilt=context.tilt(),
        battery=(reporter.battery_at_takeoff, battery_at_end),
        min_battery=config.limits.min_battery,
        max_tilt=config.limits.max_tilt,
        deadline=config.deadman.deadline,
        lockstep=not reporter.real_time,
        advice=advice_texts,
        gain_warning=gain_warning(config),
        settings=_learned_settings(context, is_drag_saved=is_drag_saved),
        drag_learned=context.guidance_loop.estimate.learned_note() if is_drag_saved else None,
        changes=tuple(change.as_dict(began) for change in assembled.changes.changes_in_flight),
    )


def _silence_duration(context: FlightContext, now: float) -> float | None:
    """Time since the last heartbeat if it is overdue, else since the last frame, s.

    None: frames arrive without a pause, or no heartbeat ever came.
    """
    heartbeat = context.link.state.heartbeat
    if heartbeat is None:
        return None
    silence = now - heartbeat.received
    return (
        silence if silence > context.heartbeat_limit else context.snapshot_builder.long_silence(now)
    )


def _early_end(
    assembled: AssembledFlight, takeoff_time: float | None, result: str, now: float
) -> EarlyEnd | None:
    """When and where a flight ended early; None if the flight did not end early.

    `takeoff_time` is in s since the flight began, `now` in s of event-loop time.
    """
    flight, began = assembled.flight, assembled.flight.began
    if flight.failed_phase is None or result == "ok":
        return None
    # No event has this text if the user left the flight.
    time = next((event_time for event_time, text in flight.events if text == result), now - began)
    phase, name, maneuver_elapsed = flight.failed_phase.name, None, None
    if phase == "maneuvers":
        for change in assembled.trace.maneuvers:  # a hold may have ended it before the flight ended
            if change.name is not None:
                name, maneuver_begin = change.name, change.time
                maneuver_elapsed = time + began - maneuver_begin
            elif name is not None and change.time <= time + began:
                maneuver_elapsed = change.time - maneuver_begin
    airborne_time = None if takeoff_time is None or takeoff_time > time else time - takeoff_time
    breach = assembled.ladder.breaches.get(result)
    return EarlyEnd(time, airborne_time, phase, name, maneuver_elapsed, breach)
