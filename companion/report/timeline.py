"""The timeline of a flight: phases or modes, maneuvers and events."""

from collections.abc import Iterator
from typing import Any

from companion.report.flight_data import FlightData, Span
from companion.report.plots import (
    IDEAL_COLOUR,
    MEASURED_COLOUR,
    REFERENCE_COLOUR,
    Plot,
    axes,
    early_end_shapes,
)

_EVENT_COLOURS = {2: MEASURED_COLOUR, 3: "#e69f00", 4: REFERENCE_COLOUR}
"""Colour of an event, by its level."""
_LANES = ("events", "maneuvers", "phases", "modes")
"""Lanes of events, maneuvers and phases or modes, from the bottom up."""


def timeline(flight: FlightData) -> Iterator[Plot]:
    """The timeline of a flight; empty without phases and modes."""
    if flight.end_time is None:
        return
    lanes = {"modes": flight.modes, "phases": flight.phases, "maneuvers": flight.maneuvers}
    traces = [_bars(lane, spans) for lane, spans in lanes.items() if spans]
    if flight.events:
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "events",
                "x": [round(event.time, 3) for event in flight.events],
                "y": ["events"] * len(flight.events),
                "text": [event.text for event in flight.events],
                "hovertemplate": "%{x:.1f} s: %{text}<extra></extra>",
                "marker": {
                    "color": [
                        _EVENT_COLOURS.get(event.level, IDEAL_COLOUR) for event in flight.events
                    ]
                },
            }
        )
    layout = axes(x="time, s")
    layout["yaxis"] = {"categoryorder": "array", "categoryarray": list(_LANES)}
    layout |= {"barmode": "overlay", "showlegend": False}
    note = "Point at a mark to read the event."
    if flight.early_end is not None:
        layout |= early_end_shapes(flight.early_end, above=True)
        note = f"{flight.early_end.sentence()} {note}"
    yield Plot("Timeline", note, traces, layout, 240)


def _bars(lane: str, spans: tuple[Span, ...]) -> dict[str, Any]:
    return {
        "type": "bar",
        "orientation": "h",
        "name": lane,
        "base": [round(span.begin, 3) for span in spans],
        "x": [round(span.end - span.begin, 3) for span in spans],
        "y": [lane] * len(spans),
        "text": [span.name for span in spans],
        "textposition": "inside",
        "insidetextanchor": "middle",
        "hovertemplate": "%{text}: from %{base:.1f} s, for %{x:.1f} s<extra></extra>",
        "marker": {
            "color": [("#56b4e9", "#a6d8f5")[number % 2] for number in range(len(spans))],
            "line": {"color": "#ffffff", "width": 1},
        },
    }
