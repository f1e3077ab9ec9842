"""The data of one flight for a page, read from its folder."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.config import Config
from companion.config.files import load
from companion.config.reference import ConfigKey, changed_keys
from companion.files.yaml_file import ConfigError
from companion.recording.flight_record import FlightRecord, RecordError, read_flight
from companion.recording.mcap_file.fields import Rows, matrix
from companion.recording.mcap_file.flight_events import Event
from companion.recording.mcap_file.loop_channels import rate_names, vector_names
from companion.recording.measurements.recorded_summary import (
    reference_positions,
    summary_of,
    trace_of,
)
from companion.recording.measurements.second_order import StepRun, step_runs
from companion.report.early_end import EarlyEndMark, early_end

Floats = NDArray[np.float64]

_NORTH_EAST_UP = (1, 1, -1)
"""Factors by which a position in NED becomes north, east and height."""


class Span(NamedTuple):
    """A maneuver, a phase or a mode; times in s since the flight began."""

    begin: float
    end: float
    name: str
    """Name shown to the user."""


class Curve(NamedTuple):
    """Values over time."""

    time: Floats
    """(N,), time since the flight began, s."""
    values: Floats
    """(N, columns), the values at each time; `FlightData.curves` lists the columns."""


@dataclass(frozen=True)
class FlightData:
    """One flight, from its own record or from a `.tlog`."""

    name: str
    """Name of the folder or of the log."""
    curves: Mapping[str, Curve]
    """Curves by name, without those that were not recorded. Columns: "position", "reference":
    north, east, height, m. "error": tracking error, m. "motion": height in m, speed in m/s, tilt in
    °. "coefficients", "target": north, east. "commanded", "measured": roll, pitch, yaw rate, °/s.
    "thrust": sent, 0..1. "hover_thrust": as learned, 0..1. "latency": from a sample's arrival to
    its setpoint, ms."""
    figures: Mapping[str, Any] | None = None
    """The content of `summary.json`, or the same figures derived from the record; None: `.tlog`."""
    provisional: bool = False
    """Whether the flight wrote no summary, so that the figures come from its record."""
    fault: str | None = None
    """Why not all of the record could be read, as a sentence; None: all was read."""
    phases: tuple[Span, ...] = ()
    """The phases, in order; empty for a `.tlog`."""
    modes: tuple[Span, ...] = ()
    """The autopilot's modes, in order, for a `.tlog`."""
    maneuvers: tuple[Span, ...] = ()
    events: tuple[Event, ...] = ()
    differences: tuple[ConfigKey, ...] | None = None
    """Keys of the configuration that are not the default; None: unknown."""
    step_runs: list[StepRun] = field(default_factory=list)
    """The doublets in open loop, in vehicle time."""
    gain: float = float("nan")
    """Gain p of the planner, 1/s; NaN: unknown."""
    early_end: EarlyEndMark | None = None
    """The early end of the flight; None: none, or unknown."""

    @property
    def end_time(self) -> float | None:
        """End of the last phase or mode, s since the flight began; None: there are none."""
        sections = self.phases or self.modes
        return sections[-1].end if sections else None


@contextmanager
def explain_other_version(*paths: Path) -> Iterator[None]:
    """Turn errors caused by a summary of another version into a `RecordError` for the user."""
    try:
        yield
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise RecordError(
            f"{' or '.join(map(str, paths))}: recorded by another version, or damaged ({error!r}); "
            "rename its summary.json, so that the figures are computed from flight.mcap instead"
        ) from error


def recorded_flight(folder: Path) -> FlightData:
    """The flight in a folder.

    Raises:
        RecordError: the folder holds no record of a flight, or one that is not valid.
    """
    record = read_flight(folder)
    figures, provisional = summary_of(record)
    config = _configuration(folder)
    phases = spans([(each.time, each.name) for each in record.phases], record.duration)
    return FlightData(
        name=folder.resolve().name,
        curves={name: curve for name, curve in _curves(record).items() if len(curve.time)},
        figures=figures,
        provisional=provisional,
        fault=record.fault,
        phases=phases,
        maneuvers=_maneuvers(record, phases),
        events=tuple(each for each in record.events if each.source != "phase"),
        differences=None if config is None else tuple(changed_keys(config)),
        step_runs=step_runs(trace_of(record).response.rows()),
        gain=float(record.metadata["flight"].get("gain_per_s", "nan")),
        early_end=early_end(figures, record, config),
    )


def spans(starts: list[tuple[float, str]], end: float) -> tuple[Span, ...]:
    """Consecutive spans; the last one ends at `end`."""
    bounds = [*starts, (end, "")]
    return tuple(Span(time, span_end, name) for (time, name), (span_end, _) in pairwise(bounds))


def _maneuvers(record: FlightRecord, phases: tuple[Span, ...]) -> tuple[Span, ...]:
    """The maneuvers; each ends at the latest with the phase in which it began."""
    maneuver_starts = [
        (change.time - record.start_time, change.name or "") for change in record.maneuvers
    ]
    maneuvers = [span for span in spans(maneuver_starts, record.duration) if span.name]
    phase_ends = [phase.end for phase in phases]
    return tuple(
        span._replace(end=min([span.end, *(end for end in phase_ends if end > span.begin)]))
        for span in maneuvers
    )


def _configuration(folder: Path) -> Config | None:
    """The configuration of the flight; None if it is missing, incomplete, or of another version."""
    try:
        return load(folder / "config.yaml")
    except ConfigError:
        return None


def _curves(record: FlightRecord) -> dict[str, Curve]:
    guidance, sent, sample = map(record.rows, ("guidance", "setpoint", "sample"))
    setpoint = sent[sent["idle"] == 0]  # on the ground there is no target
    motion, thrust = record.rows("motion"), record.rows("thrust")
    estimated = matrix(guidance, vector_names("estimated", "m"))
    step_times = record.since_start(guidance["time_s"])
    setpoint_times = record.since_start(setpoint["received_s"])
    return {
        "position": Curve(step_times, estimated * _NORTH_EAST_UP),
        "reference": Curve(step_times, reference_positions(guidance) * _NORTH_EAST_UP),
        "error": Curve(step_times, matrix(guidance, ["error_m"])),
        "motion": Curve(motion["time_s"], matrix(motion, ["height_m", "speed_m_s", "tilt_deg"])),
        "coefficients": Curve(
            setpoint_times, matrix(setpoint, ["measured_north", "measured_east"])
        ),
        "target": Curve(setpoint_times, matrix(setpoint, ["target_north", "target_east"])),
        "commanded": Curve(setpoint_times, _rates(setpoint, "commanded")),
        "measured": Curve(record.since_start(sample["received_s"]), _rates(sample, "measured")),
        "thrust": Curve(record.since_start(sent["received_s"]), matrix(sent, ["thrust"])),
        "hover_thrust": Curve(
            record.since_start(thrust["time_s"]), matrix(thrust, ["hover_thrust"])
        ),
        "latency": Curve(setpoint_times, 1e-3 * matrix(setpoint, ["latency_us"])),
    }


def _rates(rows: Rows, which: str) -> Floats:
    """Body rates (N, 3): roll, pitch and yaw rate, °/s; `which` is "commanded" or "measured"."""
    return np.degrees(matrix(rows, rate_names(which)))
