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
from companion.recording.mcap_file.loop_channels import UNANSWERED_CODES
from companion.recording.measurements.flight_facts import EarlyEnd, FlightFacts
from companion.recording.measurements.summary import LoopCounts, Summary
from companion.recording.trace import FlightTrace

_MOST_BYTES = 1 << 26
"""Largest `summary.json` that is read, bytes."""
_AXES = "roll", "pitch", "yaw"
_SETPOINT_COLUMNS = ["received_s", *(f"commanded_{axis}_rad_s" for axis in _AXES), "thrust"]
"""Columns of the channel "setpoint" that become columns of `FlightTrace.rates`."""
_STEP_COLUMNS = ["q_w", "q_x", "q_y", "q_z", "target_north", "target_east"]
"""Columns of the channel "setpoint" that become columns of `FlightTrace.response`."""
_REFUSALS = ("invalid_attitude", "invalid_setpoint", "not_sent", "invalid_rates")
"""Reasons of unanswered samples that count as `LoopCounts.refused`."""
_REQUIRED_KEYS = frozenset(
    (
        *("result", "planner", "phases", "maneuvers", "early_end", "samples", "unanswered"),
        *("link", "latency_us", "response", "extent", "battery", "deadline_ms", "lockstep"),
        *("advice", "at_the_end", "settings", "log"),
    )
)
"""Keys that `summary.json` of this version must have; without them it is not used."""
_FIRST_UNANSWERED_CODE = 2
"""First index in `UNANSWERED_CODES` of a reason: "answered" and "control_off" come before."""


def summary_of(record: FlightRecord) -> tuple[dict[str, Any], bool]:
    """The summary of a flight with the keys of `summary.json`, and whether it is provisional.

    A provisional summary is derived from the record: `result` says that the record ends early, and
    what is not recorded is null or empty, such as the dead times, the realtime grants, the advice
    and whether the vehicle is armed.

    Raises:
        RecordError: the record is not valid.
    """
    written = _written_summary(record.folder / "summary.json")
    return (derived_summary(record), True) if written is None else (written, False)


def derived_summary(record: FlightRecord) -> dict[str, Any]:
    """The summary of a flight, derived only from its record.

    Raises:
        RecordError: the record is not valid.
    """
    with record_errors(record.folder):
        return _summary_from_record(record).as_dict()


def _summary_from_record(record: FlightRecord) -> Summary:
    flight = record.metadata["flight"]
    reason = f"the record ends {record.duration:.1f} s after the flight began, before it was over"
    phase = record.phases[-1].name if record.phases else "connect"
    resources, thrust = record.rows("resources"), record.rows("thrust")
    takeoff = _takeoff_time(record)
    return Summary(
        result=reason,
        phase=phase,
        planner=flight.get("planner", ""),
        gain=float(flight.get("gain_per_s", "0")),
        counts=_loop_counts(record, float(flight.get("deadline_s", "0.004"))),
        link={
            name: int(resources[column][-1]) if len(resources) else 0
            for name, column in (("frames", "frames"), ("lost", "frames_lost"), ("sent", "sent"))
        },
        trace=trace_of(record),
        events=[(event.time, event.text) for event in record.events if event.source != "phase"],
        log=record.folder,
        facts=FlightFacts(
            began=record.began,
            phases=tuple((each.time, each.name) for each in record.phases),
            takeoff=takeoff,
            early_end=_early_end(record, phase, takeoff),
            battery=(None, _last_known(thrust["battery_remaining"])),
            min_battery=float(flight.get("min_battery", "0")),
            max_tilt=float(flight["max_tilt_rad"]) if "max_tilt_rad" in flight else None,
            deadline=float(flight.get("deadline_s", "0.004")),
            lockstep=flight.get("real_time") == "no",
        ),
    )


def trace_of(record: FlightRecord) -> FlightTrace:
    """The recorded rows in the form of the trace that the measurements use.

    Raises:
        RecordError: the record is not valid.
    """
    with record_errors(record.folder):
        trace = FlightTrace()
        sample, setpoint, guidance = map(record.rows, ("sample", "setpoint", "guidance"))
        sample = sample[sample["unanswered"] == 0]
        # Matched by the vehicle's stamps, because two samples may arrive at the same time.
        numbers = _sample_indices(sample["vehicle_time_s"], setpoint["vehicle_time_s"])
        measured = np.column_stack([sample[f"measured_{axis}_rad_s"] for axis in _AXES])
        ages = np.where(sample["age_known"] == 1, sample["age_s"], np.nan)
        for row, number in zip(setpoint, numbers.tolist(), strict=True):
            trace.add_latency(round(1e3 * float(row["latency_us"])))
            time = float(row["vehicle_time_s"])
            if row["offboard_active"] and number >= 0:  # else its sample was not recorded
                sent = row[_SETPOINT_COLUMNS].tolist()
                trace.rates.add([time, *sent, *measured[number].tolist(), float(ages[number])])
            if row["is_step"]:
                trace.response.add([time, *row[_STEP_COLUMNS].tolist()])
        for row in tracking_rows(guidance):
            trace.tracking.add(row.tolist())
        for row in record.rows("motion").tolist():
            trace.motion.add(list(row))
        trace.maneuvers += record.maneuvers
        return trace


def tracking_rows(guidance: NDArray[np.void]) -> NDArray[np.float64]:
    """(N, 7), rows of `FlightTrace.tracking` from those of the channel "guidance"."""
    controlled = guidance[guidance["offboard_active"] == 1]
    columns = [controlled["vehicle_time_s"]]
    for axis, held_quantity in zip(
        ("north", "east", "down"), ("position", "position", "height"), strict=True
    ):
        reference = controlled[f"reference_{axis}_m"]
        columns.append(np.where(controlled[f"holds_{held_quantity}"] == 1, reference, np.nan))
    columns += [controlled[f"estimated_{axis}_m"] for axis in ("north", "east", "down")]
    return np.column_stack(columns)


def _sample_indices(
    samples: NDArray[np.float64], setpoints: NDArray[np.float64]
) -> NDArray[np.int64]:
    """The index of each setpoint's sample; −1: the sample was not recorded."""
    if len(samples) == 0:
        return np.full(len(setpoints), -1)
    at = np.minimum(np.searchsorted(samples, setpoints), len(samples) - 1)
    return np.where(samples[at] == setpoints, at, -1)


def _loop_counts(record: FlightRecord, deadline: float) -> LoopCounts:
    sample, setpoint = record.rows("sample"), record.rows("setpoint")
    controlled = sample[sample["unanswered"] != UNANSWERED_CODES.index("control_off")]
    code_counts = np.bincount(controlled["unanswered"], minlength=len(UNANSWERED_CODES)).tolist()
    counts = zip(UNANSWERED_CODES, code_counts, strict=True)
    unanswered = dict(list(counts)[_FIRST_UNANSWERED_CODE:])
    refused = sum(unanswered[name] for name in _REFUSALS)
    return LoopCounts(
        samples=len(controlled),
        setpoints=len(setpoint),
        missed_deadlines=int((setpoint["latency_us"] > 1e6 * deadline).sum()),
        stale=sum(unanswered.values()) - refused,
        refused=refused,
        rate_hz=_setpoint_rate(record),
        unanswered=unanswered,
    )


def _early_end(record: FlightRecord, phase: str, takeoff: float | None) -> EarlyEnd:
    """The end of the record as an early end of the flight, in the phase that ran."""
    end = record.duration
    since = None if takeoff is None else end - takeoff
    latest = record.maneuvers[-1] if record.maneuvers else None
    if phase != "maneuvers" or latest is None or latest.name is None:
        return EarlyEnd(end, since, phase)
    return EarlyEnd(end, since, phase, latest.name, end + record.began - latest.time)


def _takeoff_time(record: FlightRecord) -> float | None:
    """Time of take-off or takeover, s since the flight began: see `FlightFacts.takeoff`."""
    steps = record.rows("guidance_input")
    flying = ("takeoff", "offboard")
    takeoff_begin = next((each.time for each in record.phases if each.name in flying), None)
    if takeoff_begin is None:
        return None
    times = record.since_start(steps["time_s"])
    airborne = times[(times >= takeoff_begin) & (steps["standing"] == 0)]
    return float(airborne[0]) if len(airborne) else None


def _setpoint_rate(record: FlightRecord) -> float:
    """Rate of setpoints in vehicle time from the first maneuver on, Hz."""
    begins = [mark.vehicle_time for mark in record.maneuvers if mark.name is not None]
    times = record.rows("setpoint")["vehicle_time_s"]
    times = times[times >= begins[0]] if begins else times[:0]
    span = float(times[-1] - times[0]) if len(times) > 1 else 0.0
    return (len(times) - 1) / span if span > 0.0 else 0.0


def _last_known(values: NDArray[np.float64]) -> float | None:
    known = values[~np.isnan(values)]
    return float(known[-1]) if len(known) else None


def _written_summary(path: Path) -> dict[str, Any] | None:
    """`summary.json`; None if it is missing, incomplete, or of another version."""
    try:
        found = json.loads(read_text(path, _MOST_BYTES))
    except (FileRefusedError, ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) and found.keys() >= _REQUIRED_KEYS else None
