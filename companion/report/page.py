"""Makes the page of one flight or of several: one HTML file that needs no network."""

from collections.abc import Callable, Sequence
from pathlib import Path

from companion.files.write_whole import write_whole
from companion.recording.closing_words import closing_words
from companion.recording.flight_record import RECORD_FILE
from companion.report import PAGE
from companion.report.control_plots import compared_steps, control_plots
from companion.report.flight_data import FlightData, explain_other_version, recorded_flight
from companion.report.html_page import rendered_page, require_extra
from companion.report.motion_plots import motion_plots
from companion.report.plots import Plot
from companion.report.tables import (
    Table,
    comparison_tables,
    configuration_table,
    events_at_end,
    extremes_text,
    flight_tables,
)
from companion.report.timeline import timeline
from companion.report.tlog_data import logged_flight


def read(path: Path) -> FlightData:
    """The flight in a folder, or in a `.tlog` of any program.

    Raises:
        RecordError: the folder holds no record of a flight, or `path` is the record itself; the
            message then says to name its folder.
        LogError: the log cannot be used.
    """
    is_log = path.is_file() and path.name != RECORD_FILE
    return logged_flight(path) if is_log else recorded_flight(path)


def write_report(
    path: Path, out: Path | None = None, on_fault: Callable[[str], object] | None = None
) -> Path:
    """Write the page about one flight; return its path.

    Args:
        path: folder of the flight, or a `.tlog`.
        out: the page; None: `report.html` in the folder, or beside the log, with its name and the
            suffix `.html`.
        on_fault: called with a sentence if the flight's record is empty or damaged.

    Raises:
        MissingExtraError: the extra `report` is missing.
        RecordError, LogError: the flight cannot be read.
        OSError: the page cannot be written.
    """
    require_extra()
    if out is None:
        out = path.with_suffix(".html") if path.is_file() else path / PAGE
    with explain_other_version(path):
        flight = _read_all([path], on_fault)[0]
        plots = [*timeline(flight), *motion_plots([flight]), *control_plots(flight)]
        tables = [*events_at_end(flight), *flight_tables(flight)]
        page = _page(flight.name, [flight], tables, plots, configuration_table(flight))
    write_whole(out, page)
    return out


def write_comparison(
    paths: Sequence[Path], out: Path, on_fault: Callable[[str], object] | None = None
) -> Path:
    """Write a page that compares several flights; return its path. `on_fault`: see `write_report`.

    Raises:
        MissingExtraError, RecordError, LogError, OSError: see `write_report`.
    """
    require_extra()
    with explain_other_version(*paths):
        flights = _read_all(paths, on_fault)
        title = " and ".join(flight.name for flight in flights)
        plots = [*compared_steps(flights), *motion_plots(flights)]
        page = _page(title, flights, comparison_tables(flights), plots)
    write_whole(out, page)
    return out


def _read_all(paths: Sequence[Path], on_fault: Callable[[str], object] | None) -> list[FlightData]:
    """The flights; `on_fault` is called for each whose record is empty or damaged."""
    flights = [read(path) for path in paths]
    for flight in flights:
        if flight.fault is not None and on_fault is not None:
            on_fault(flight.fault)
    return flights


def _page(
    title: str,
    flights: Sequence[FlightData],
    tables: Sequence[Table],
    plots: Sequence[Plot],
    settings: Table | None = None,
) -> str:
    closing_words_by_flight = [
        (flight.name, closing_words(flight.figures, None))
        for flight in flights
        if flight.figures is not None  # else it is a .tlog
    ]
    return rendered_page(
        "companion.report",
        "page.html.j2",
        title,
        plots,
        words=closing_words_by_flight[0][1]
        if len(flights) == len(closing_words_by_flight) == 1
        else None,
        closing_words_by_flight=closing_words_by_flight,
        flights=flights,
        tables=tables,
        settings=settings,
        telemetry_extremes=extremes_text(flights[0]),
    )
