"""One page with everything: opens offline, in any browser, from one file."""

import base64
import io
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import jinja2
from matplotlib.figure import Figure

from companion.study.outcome import Outcome


def write_outcome(outcome: Outcome, folder: Path) -> list[Path]:
    """Write the figure (SVG and PNG) and the tables (CSV and Markdown); returns the files.

    Raises:
        OSError: a file cannot be written.
    """
    files = []
    for ending in ("svg", "png"):
        files.append(folder / f"{outcome.name}.{ending}")
        files[-1].write_bytes(_image(outcome.figure, ending))
    for table in outcome.tables:
        for ending, text in (("csv", table.as_csv()), ("md", table.as_markdown())):
            files.append(folder / f"{table.name}.{ending}")
            files[-1].write_text(text, encoding="utf-8")
    return files


def write_page(outcomes: Sequence[Outcome], path: Path) -> None:
    """Write the page.

    Raises:
        OSError: it cannot be written.
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
            outcome.name: base64.b64encode(_image(outcome.figure, "svg")).decode("ascii")
            for outcome in outcomes
        },
        version=version("mavlink-companion"),
    )
    path.write_text(page, encoding="utf-8")


def _image(figure: Figure, ending: str) -> bytes:
    """The file of a figure; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    metadata = {"Date": None} if ending == "svg" else {"Software": None}
    figure.savefig(buffer, format=ending, dpi=130, metadata=metadata)
    return buffer.getvalue()
