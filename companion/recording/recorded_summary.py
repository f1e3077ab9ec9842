"""The summary of a recorded flight: as the flight wrote it, else derived from its record.

A flight that was killed wrote no `summary.json`. Then the same figures are measured from the rows,
by the code that measures them after a flight.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.files.bounded_file import FileRefusedError, read_text
from companion.recording.course import Course, EarlyEnd
from companion.recording.flight_record import FlightRecord
from companion.recording.mcap_file.channels import REASONS
from companion.recording.summary import LoopCounts, Summary
from companion.recording.trace import FlightTrace

_LONGEST = 1 << 26
_REFUSALS = ("invalid_attitude", "invalid_setpoint", "not_sent")
_NO_REASONS = 2
"""The first of `REASONS` are no reasons of an unanswered sample."""


def summary_of(record: FlightRecord) -> tuple[dict[str, Any], bool]:
    """The summary of a flight, with the keys of `summary.json`, and whether it is provisional.

    A provisional one is derived from the record: `result` says that the record ends early, and the
    dead times, the realtime grants and the advice are missing.
    """
    written = _written(record.folder / "summary.json")
    return (derived_summary(record), True) if written is None else (written, False)


def derived_summary(record: FlightRecord) -> dict[str, Any]:
    """The summary of a flight, from its record alone."""
    flight = record.metadata["flight"]
    reason = f"the record ends {record.duration:.1f} s after the flight began, before it was over"
    phase = record.phases[-1].name if record.phases else "connect"
    resources, thrust = record.rows("resources"), record.rows("thrust")
    summary = Summary(
        result=reason,
        phase=phase,
        planner=flight.get("planner", ""),
        gain=float(flight.get("gain_per_s", "nan")),
        counts=_counts(record, float(flight.get("deadline_s", "inf"))),
        link={
            name: int(resources[column][-1]) if len(resources) else 0
            for name, column in (("frames", "frames"), ("lost", "frames_lost"), ("sent", "sent"))
        },
        trace=trace_of(record),
        events=[(event.time, event.text) for event in record.events if event.source != "phase"],
        log=record.folder,
        course=Course(
            began=record.began,
            phases=tuple((each.time, each.name) for each in record.phases),
            early_end=EarlyEnd(record.duration, None, phase),
            battery=(None, _last(thrust["battery_remaining"])),
            min_battery=float(flight.get("min_battery", "0")),
            deadline=float(flight.get("deadline_s", "inf")),
            lockstep=flight.get("lockstep") == "true",
        ),
    )
    return summary.as_dict()


def trace_of(record: FlightRecord) -> FlightTrace:
    """The rows that the measurements after a flight take, as the flight itself kept them."""
    trace = FlightTrace()
    sample, setpoint, guidance = map(record.rows, ("sample", "setpoint", "guidance"))
    answers = _answers(sample["received_s"], setpoint["received_s"])
    for row, number in zip(setpoint.tolist(), answers.tolist(), strict=True):
        (received, vehicle_time, roll, pitch, yaw, thrust, latency, north, east), flags = (
            row[:9],
            row[-6:],
        )
        trace.add_latency(round(1e3 * latency))
        if number < 0:
            continue
        of = sample[number]
        if flags[3]:
            measured = [float(of[f"measured_{axis}_rad_s"]) for axis in ("roll", "pitch", "yaw")]
            age = float(of["age_s"]) if of["age_known"] else float("nan")
            trace.rates.add(
                [vehicle_time, received, roll, pitch, yaw, thrust, *measured, age],
            )
        if flags[4]:
            trace.response.add([vehicle_time, *(float(of[f"q_{p}"]) for p in "wxyz"), north, east])
    for row in tracking_rows(guidance):
        trace.tracking.add(row.tolist())
    for row in record.rows("motion").tolist():
        trace.motion.add(list(row))
    trace.maneuvers += record.maneuvers
    return trace


def tracking_rows(guidance: NDArray[np.void]) -> NDArray[np.float64]:
    """(N, 7) of `FlightTrace.tracking`, from the rows of the channel "guidance"."""
    flown = guidance[guidance["offboard_active"] == 1]
    columns = [flown["vehicle_time_s"]]
    for axis, held in zip(
        ("north", "east", "down"), ("position", "position", "height"), strict=True
    ):
        reference = flown[f"reference_{axis}_m"]
        columns.append(np.where(flown[f"holds_{held}"] == 1, reference, np.nan))
    columns += [flown[f"estimated_{axis}_m"] for axis in ("north", "east", "down")]
    return np.column_stack(columns)


def _answers(samples: NDArray[np.float64], setpoints: NDArray[np.float64]) -> NDArray[np.int64]:
    """The number of each setpoint's sample; −1: it was not recorded."""
    if len(samples) == 0:
        return np.full(len(setpoints), -1)
    at = np.minimum(np.searchsorted(samples, setpoints), len(samples) - 1)
    return np.where(samples[at] == setpoints, at, -1)


def _counts(record: FlightRecord, deadline: float) -> LoopCounts:
    sample, setpoint = record.rows("sample"), record.rows("setpoint")
    taken = sample[sample["unanswered"] != REASONS.index("control_off")]
    found = np.bincount(taken["unanswered"], minlength=len(REASONS)).tolist()
    unanswered = dict(zip(REASONS[_NO_REASONS:], found[_NO_REASONS:], strict=True))
    refused = sum(unanswered[name] for name in _REFUSALS)
    return LoopCounts(
        samples=len(taken),
        setpoints=len(setpoint),
        missed_deadlines=int((setpoint["latency_us"] > 1e6 * deadline).sum()),
        stale=sum(unanswered.values()) - refused,
        refused=refused,
        rate_hz=_rate(record),
        unanswered=unanswered,
    )


def _rate(record: FlightRecord) -> float:
    """Setpoints a second of vehicle time, from the first maneuver on."""
    begun = [mark.vehicle_time for mark in record.maneuvers if mark.name is not None]
    times = record.rows("setpoint")["vehicle_time_s"]
    times = times[times >= begun[0]] if begun else times[:0]
    span = float(times[-1] - times[0]) if len(times) > 1 else 0.0
    return (len(times) - 1) / span if span > 0.0 else 0.0


def _last(values: NDArray[np.float64]) -> float | None:
    known = values[~np.isnan(values)]
    return float(known[-1]) if len(known) else None


def _written(path: Path) -> dict[str, Any] | None:
    """`summary.json`; None where the flight wrote none, or not all of it."""
    try:
        found = json.loads(read_text(path, _LONGEST))
    except (FileRefusedError, ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None
