"""Renders a page with plots as one HTML file that needs no network."""

import re
from base64 import b64encode
from collections.abc import Sequence
from gzip import compress
from importlib.metadata import version
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from companion.extras import require
from companion.report.plots import Plot

if TYPE_CHECKING:
    from markupsafe import Markup


def require_extra() -> None:
    """Check that the extra `report` is installed.

    Raises:
        MissingExtraError: a package is missing; the message says how to install it.
    """
    for module in ("plotly", "jinja2"):
        require(module, "report", "a report")


def rendered_page(
    package: str, template: str, title: str, plots: Sequence[Plot], **variables: Any
) -> str:
    """The text of a page.

    Args:
        package: package with the template, which may extend `base.html.j2` of this package, and
            import from `parts.html.j2`.
        template: name of the template's file.
        title: title of the page.
        plots: plots that the template shows.
        variables: further values for the template.
    """
    import jinja2  # noqa: PLC0415  an extra

    folders = [
        jinja2.PackageLoader(each, ".") for each in dict.fromkeys([package, "companion.report"])
    ]
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(folders), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False}
    environment.filters["with_code"] = _with_code
    plotly = files("plotly") / "package_data" / "plotly.min.js"
    return environment.get_template(template).render(
        title=title,
        plots=plots,
        plots_data=[
            {"traces": plot.traces, "layout": {**plot.layout, "height": plot.height}}
            for plot in plots
        ],
        # Browsers since 2023 can unpack gzip.
        plotly=b64encode(compress(plotly.read_bytes(), mtime=0)).decode("ascii"),
        version=version("mavlink-companion"),
        **variables,
    )


def _with_code(text: str) -> "Markup":
    """A text as HTML; text between backticks becomes code."""
    from markupsafe import Markup, escape  # noqa: PLC0415  comes with jinja2

    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", str(escape(text))))
