"""The summary of a recorded flight: its `summary.json`, or else derived from its record.

A flight that was killed wrote no `summary.json`. The same figures are then computed from the
recorded rows, by the code that computes them after a flight.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.files.bounded_file import FileRefusedError, read_text
from companion.recording.flight_record import FlightRecord, record_errors
from companion.recording.mcap_file.channels import MOTION
from companion.recording.mcap_file.fields import Rows, matrix
from companion.recording.mcap_file.loop_channels import UNANSWERED_CODES, vector_names
from companion.recording.measurements.flight_facts import EarlyEnd, FlightFacts
from companion.recording.measurements.summary import LoopCounts, Summary
from companion.recording.trace import ANSWERED_COLUMNS, RESPONSE_COLUMNS, SENT_COLUMNS, FlightTrace

_MAX_BYTES = 1 << 26
"""Largest `summary.json` that is read, bytes."""
_REFUSED_REASONS = ("invalid_attitude", "invalid_rates", "invalid_setpoint", "not_sent")
"""Reasons of unanswered samples that count as `LoopCounts.refused`."""
_REQUIRED_KEYS = frozenset(
    (
        *("result", "planner", "phases", "maneuvers", "early_end", "samples", "unanswered"),
        *("link", "latency_us", "response", "extent", "battery", "deadline_ms", "lockstep"),
        *("advice", "at_the_end", "settings", "log"),
    )
)
"""Keys that `summary.json` of this version must have; without them it is not used."""


def summary_of(record: FlightRecord) -> tuple[dict[str, Any], bool]:
    """The summary of a flight with the keys of `summary.json`, and whether it is provisional.

    A provisional summary is derived from the record, and `result` says that the record ends early.
    Values that are not recorded are null or empty: the dead times, `realtime`, the advice,
    and whether the vehicle is armed.

    Raises:
        RecordError: the record is not valid.
    """
    written_summary = _written_summary(record.folder / "summary.json")
    return (derived_summary(record), True) if written_summary is None else (written_summary, False)


def derived_summary(record: FlightRecord) -> dict[str, Any]:
    """The summary of a flight, derived only from its record.

    Raises:
        RecordError: the record is not valid.
    """
    with record_errors(record.folder):
        return _summary_from_record(record).as_dict()


def _summary_from_record(record: FlightRecord) -> Summary:
    flight_metadata = record.metadata["flight"]
    reason = f"the record ends {record.duration:.1f} s after the flight began, before it was over"
    deadline = float(flight_metadata.get("deadline_s", "0.004"))
    max_tilt = flight_metadata.get("max_tilt_rad")
    phase = record.phases[-1].name if record.phases else "connect"
    resources, thrust = record.rows("resources"), record.rows("thrust")
    takeoff_time = _takeoff_time(record)
    return Summary(
        result=reason,
        phase=phase,
        planner=flight_metadata.get("planner", ""),
        gain=float(flight_metadata.get("gain_per_s", "0")),
        counts=_loop_counts(record, deadline),
        link={
            name: int(resources[column][-1]) if len(resources) else 0
            for name, column in (("frames", "frames"), ("lost", "frames_lost"), ("sent", "sent"))
        },
        trace=trace_of(record),
        events=[(event.time, event.text) for event in record.events if event.source != "phase"],
        log=record.folder,
        facts=FlightFacts(
            start_time=record.start_time,
            phases=tuple((each.time, each.name) for each in record.phases),
            takeoff_time=takeoff_time,
            early_end=_early_end(record, phase, takeoff_time),
            battery=(None, _last_known(thrust["battery_remaining"])),
            min_battery=float(flight_metadata.get("min_battery", "0")),
            max_tilt=None if max_tilt is None else float(max_tilt),
            deadline=deadline,
            lockstep=flight_metadata.get("real_time") == "no",
        ),
    )


def trace_of(record: FlightRecord) -> FlightTrace:
    """The recorded rows in the form of the trace that the measurements use.

    Raises:
        RecordError: the record is not valid.
    """
    with record_errors(record.folder):
        sample, setpoint, guidance = map(record.rows, ("sample", "setpoint", "guidance"))
        trace = FlightTrace()
        for latency in setpoint["latency_us"].tolist():
            trace.latencies_ns.add([round(1e3 * latency)])
        trace.rates.extend(_rates(sample, setpoint))
        trace.response.extend(matrix(setpoint[setpoint["is_step"] == 1], RESPONSE_COLUMNS))
        trace.tracking.extend(_tracking(guidance[guidance["offboard_active"] == 1]))
        trace.motion.extend(matrix(record.rows("motion"), MOTION.columns))
        trace.maneuvers += record.maneuvers
        return trace


def _rates(sample: Rows, setpoint: Rows) -> NDArray[np.float64]:
    """(N, 10), rows of `FlightTrace.rates`, without those whose sample was not recorded."""
    sample, setpoint = sample[sample["unanswered"] == 0], setpoint[setpoint["offboard_active"] == 1]
    # Matched by the vehicle's stamps, because two samples may arrive at the same time.
    _, sample_indices, setpoint_indices = np.intersect1d(
        sample["vehicle_time_s"], setpoint["vehicle_time_s"], return_indices=True
    )
    sent = matrix(setpoint[setpoint_indices], SENT_COLUMNS)
    rows = np.hstack([sent, matrix(sample[sample_indices], ANSWERED_COLUMNS)])
    rows[sample["age_known"][sample_indices] == 0, -1] = np.nan
    return rows


def _tracking(guidance: Rows) -> NDArray[np.float64]:
    """(N, 7), rows of `FlightTrace.tracking`."""
    estimated = matrix(guidance, vector_names("estimated", "m"))
    return np.column_stack([guidance["vehicle_time_s"], reference_positions(guidance), estimated])


def reference_positions(guidance: Rows) -> NDArray[np.float64]:
    """(N, 3), positions of the reference, m, NED; NaN where no position is commanded.

    Also NaN while offboard control is inactive: the vehicle's own position was recorded then.
    """
    positions = matrix(guidance, vector_names("reference", "m"))
    positions[guidance["offboard_active"] == 0] = np.nan
    positions[guidance["holds_position"] == 0, :2] = np.nan
    positions[guidance["holds_height"] == 0, 2] = np.nan
    return positions


def _loop_counts(record: FlightRecord, deadline: float) -> LoopCounts:
    sample, setpoint = record.rows("sample"), record.rows("setpoint")
    code_counts = np.bincount(sample["unanswered"], minlength=len(UNANSWERED_CODES)).tolist()
    unanswered = dict(zip(UNANSWERED_CODES, code_counts, strict=True))
    del unanswered["answered"]
    control_off_count = unanswered.pop("control_off")
    refused_count = sum(unanswered[name] for name in _REFUSED_REASONS)
    return LoopCounts(
        samples=len(sample) - control_off_count,
        setpoints=len(setpoint),
        missed_deadlines=int((setpoint["latency_us"] > 1e6 * deadline).sum()),
        stale=sum(unanswered.values()) - refused_count,
        refused=refused_count,
        rate_hz=_setpoint_rate(record),
        unanswered=unanswered,
    )


def _early_end(record: FlightRecord, phase: str, takeoff_time: float | None) -> EarlyEnd:
    """The end of the record, reported as an early end of the flight in its last phase."""
    end = record.duration
    since_takeoff = None if takeoff_time is None else end - takeoff_time
    last_change = record.maneuvers[-1] if record.maneuvers else None
    if phase != "maneuvers" or last_change is None or last_change.name is None:
        return EarlyEnd(end, since_takeoff, phase)
    return EarlyEnd(
        end, since_takeoff, phase, last_change.name, end + record.start_time - last_change.time
    )


def _takeoff_time(record: FlightRecord) -> float | None:
    """Time of take-off or takeover, s since the flight began: see `FlightFacts.takeoff_time`."""
    guidance_inputs = record.rows("guidance_input")
    flying_phases = ("takeoff", "offboard")
    takeoff_begin = next((each.time for each in record.phases if each.name in flying_phases), None)
    if takeoff_begin is None:
        return None
    times = record.since_start(guidance_inputs["time_s"])
    airborne_times = times[(times >= takeoff_begin) & (guidance_inputs["standing"] == 0)]
    return float(airborne_times[0]) if len(airborne_times) else None


def _setpoint_rate(record: FlightRecord) -> float:
    """Rate of setpoints in vehicle time from the first maneuver on, Hz."""
    maneuver_starts = [
        change.vehicle_time for change in record.maneuvers if change.name is not None
    ]
    times = record.rows("setpoint")["vehicle_time_s"]
    times = times[times >= maneuver_starts[0]] if maneuver_starts else times[:0]
    duration = float(times[-1] - times[0]) if len(times) > 1 else 0.0
    return (len(times) - 1) / duration if duration > 0.0 else 0.0


def _last_known(values: NDArray[np.float64]) -> float | None:
    known_values = values[~np.isnan(values)]
    return float(known_values[-1]) if len(known_values) else None


def _written_summary(path: Path) -> dict[str, Any] | None:
    """`summary.json`; None if it is missing, incomplete, or of another version."""
    try:
        summary = json.loads(read_text(path, _MAX_BYTES))
    except (FileRefusedError, ValueError, RecursionError):
        return None
    return summary if isinstance(summary, dict) and summary.keys() >= _REQUIRED_KEYS else None
