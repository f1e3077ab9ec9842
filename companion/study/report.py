"""Writes the files of a study, and an HTML page with all figures embedded."""

import base64
import io
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import jinja2
import matplotlib as mpl
from matplotlib.figure import Figure

from companion.files.write_whole import write_whole
from companion.study.outcome import Outcome

_DPI = 130


def write_outcome(outcome: Outcome, folder: Path) -> None:
    """Write the figure (SVG and PNG) and the tables (CSV and Markdown; series as CSV only).

    Raises:
        OSError: a file cannot be written.
    """
    _lay_out(outcome.figure)
    for extension in ("svg", "png"):
        write_whole(folder / f"{outcome.name}.{extension}", _image(outcome.figure, extension))
    for table in (*outcome.tables, *outcome.series):
        write_whole(folder / f"{table.name}.csv", table.as_csv())
    for table in outcome.tables:
        write_whole(folder / f"{table.name}.md", table.as_markdown())


def write_page(outcomes: Sequence[Outcome], path: Path) -> None:
    """Write the page; the figures of `write_outcome` must be in the page's folder.

    Raises:
        OSError: the page cannot be written, or a figure is missing.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("companion.study", "."),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    page = environment.get_template("page.html.j2").render(
        outcomes=outcomes,
        images={
            outcome.name: base64.b64encode(
                path.with_name(f"{outcome.name}.svg").read_bytes()
            ).decode("ascii")
            for outcome in outcomes
        },
        version=version("mavlink-companion"),
    )
    write_whole(path, page)


def _lay_out(figure: Figure) -> None:
    """Lay out the figure once and for all; otherwise each `savefig` lays it out and draws it twice.

    The layout engine "none" still lets `savefig` draw twice; without an engine it draws once.
    """
    figure.set_dpi(_DPI)
    layout_engine = figure.get_layout_engine()
    if layout_engine is not None:
        layout_engine.execute(figure)
    with mpl.rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False}):
        figure.set_layout_engine(None)


def _image(figure: Figure, extension: str) -> bytes:
    """The content of a figure's file; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    metadata = {"Date": None} if extension == "svg" else {"Software": None}
    figure.savefig(buffer, format=extension, dpi=_DPI, metadata=metadata)
    return buffer.getvalue()
