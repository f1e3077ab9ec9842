"""The tables of the page: maneuvers, figures, configuration, and comparisons."""

import json
import re
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from companion.config.reference import ConfigKey
from companion.report.flight_data import FlightData

_EMPTY = "–"
_END_WINDOW = 5.0
"""Longest time between an early end and an event listed at the top of the page, s."""
_MAX_EVENTS = 20
_PORT_AT_END = re.compile(r":\d+$")


class Table(NamedTuple):
    """A table of texts."""

    title: str
    header: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    """Rows, each with one text for each column."""


def flight_tables(flight: FlightData) -> list[Table]:
    """The tables about one flight, without empty ones."""
    if flight.figures is None:
        return []
    tables = (
        _maneuver_table(flight.figures),
        Table("Figures", ("figure", "measured"), list(_figure_rows(flight.figures))),
    )
    return [table for table in tables if table.rows]


def events_at_end(flight: FlightData) -> list[Table]:
    """The events around the early end of a flight; no table if there was none, or no event."""
    if flight.early_end is None:
        return []
    nearby_events = [
        each for each in flight.events if abs(each.time - flight.early_end.time) <= _END_WINDOW
    ]
    rows = [
        (f"{each.time:.1f}", each.source, each.text.removeprefix(f"{each.source}: "))
        for each in nearby_events[:_MAX_EVENTS]
    ]
    title = f"Events within {_END_WINDOW:.0f} s of the end"
    return [Table(title, ("time, s", "from", "what happened"), rows)] if rows else []


def extremes_text(flight: FlightData) -> str:
    """Duration, largest height, speed and tilt of a flight, in words; empty without positions."""
    motion = flight.curves.get("motion")
    if motion is None or flight.end_time is None:
        return ""
    texts = "{:.1f} m high", "{:.1f} m/s fast", "{:.0f}° tilted"
    largest = [
        text.format(np.nanmax(values))
        for text, values in zip(texts, motion.values.T, strict=True)
        if not np.isnan(values).all()
    ]
    return f"{flight.end_time:.0f} s" + (f", up to {', '.join(largest)}" if largest else "")


def configuration_table(flight: FlightData) -> Table:
    """The configuration keys whose values are not the default."""
    rows = [
        (f"{key.section}.{key.name}", _value_text(key.value), _value_text(key.default), key.unit)
        for key in flight.differences or ()
    ]
    title = "Configuration keys that differ from the default"
    return Table(title, ("key", "flown", "default", "unit"), rows)


def comparison_tables(flights: Sequence[FlightData]) -> list[Table]:
    """The figures of several flights and the keys that differ, one column for each flight."""
    names = tuple(flight.name for flight in flights)
    figures_by_flight = [
        {**dict(_tracking_rows(flight.figures)), **dict(_figure_rows(flight.figures))}
        if flight.figures
        else {}
        for flight in flights
    ]
    labels = dict.fromkeys(label for figures in figures_by_flight for label in figures)
    figures = [
        (label, *(each.get(label, _EMPTY) for each in figures_by_flight)) for label in labels
    ]
    keys_by_flight = [
        None
        if flight.differences is None
        else {
            f"{key.section}.{key.name}": value
            for key in flight.differences
            for value, default in [_compared(key)]
            if value != default
        }
        for flight in flights
    ]
    changed_names = sorted({key for each in keys_by_flight for key in each or {}})
    settings = [
        (key, *(_EMPTY if each is None else each.get(key, "default") for each in keys_by_flight))
        for key in changed_names
    ]
    differing_settings = [row for row in settings if len(set(row[1:])) > 1]
    tables = [
        Table("Figures", ("figure", *names), figures),
        Table("Keys that differ", ("key", *names), differing_settings),
    ]
    return [table for table in tables if table.rows]


def _compared(key: ConfigKey) -> tuple[str, str]:
    """Value and default of a key as texts; endpoints without the port, because `demo` varies it."""
    value, default = _value_text(key.value), _value_text(key.default)
    if key.name != "endpoint":
        return value, default
    return _PORT_AT_END.sub("", value), _PORT_AT_END.sub("", default)


def _figure_rows(figures: Any) -> Iterator[tuple[str, str]]:
    """Label and text of each figure that was measured."""
    response = figures.get("response") or {}
    latency, link = figures.get("latency_us") or {}, figures.get("link") or {}
    constants = response.get("time_constant_s") or {}
    rows: list[tuple[str, Any, str]] = [
        ("result", figures.get("result"), "{}"),
        ("planner", figures.get("planner"), "{}"),
        ("time constant, north", constants.get("north"), "{:.3f} s"),
        ("time constant, east", constants.get("east"), "{:.3f} s"),
        ("largest distance from the line of a step", response.get("cross_axis_max"), "{:.4f}"),
        ("samples", figures.get("samples"), "{:,}"),
        ("setpoints", figures.get("setpoints"), "{:,}"),
        ("frames lost", link.get("lost"), "{:,}"),
    ]
    if not figures.get("lockstep"):  # In lockstep, all latencies are 0.
        rows += [
            ("missed deadlines", figures.get("missed_deadlines"), "{:,}"),
            ("latency, median", latency.get("p50"), "{:.0f} µs"),
            ("latency, 99th percentile", latency.get("p99"), "{:.0f} µs"),
        ]
    yield from (
        (label, text.format(value)) for label, value, text in rows if value not in (None, "")
    )


def _tracking_rows(figures: Any) -> Iterator[tuple[str, str]]:
    """Label and text of each maneuver's RMS errors."""
    for maneuver in figures.get("maneuvers", ()):
        for key, label in (("level_rms_m", "horizontal RMS"), ("height_rms_m", "height RMS")):
            if maneuver.get(key) is not None:
                yield f"{maneuver['name']}, {label}", f"{maneuver[key]:.3f} m"


def _maneuver_table(figures: Any) -> Table:
    columns = (
        ("name", "maneuver", "{}"),
        ("duration_s", "duration, s", "{:.1f}"),
        ("reference_speed_max_m_s", "speed of the reference, 95th percentile, m/s", "{:.1f}"),
        ("level_rms_m", "horizontal RMS, m", "{:.3f}"),
        ("level_max_m", "horizontal max, m", "{:.3f}"),
        ("height_rms_m", "height RMS, m", "{:.3f}"),
        ("height_max_m", "height max, m", "{:.3f}"),
        ("swing_rms_deg", "swing of roll and pitch, ° RMS", "{:.1f}"),
        ("drift_max_m", "drift in open loop, m", "{:.1f}"),
    )
    rows = [
        tuple(
            _EMPTY
            if maneuver.get(key) is None or (key == "drift_max_m" and not maneuver["open_loop"])
            else text.format(maneuver[key])
            for key, _, text in columns
        )
        for maneuver in figures.get("maneuvers", ())
    ]
    return Table("Tracking by maneuver", tuple(title for _, title, _ in columns), rows)


def _value_text(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False) if not isinstance(value, str) else value
