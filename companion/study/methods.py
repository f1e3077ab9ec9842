"""The methods (planners) that the studies compare, each with its label and line style."""

from typing import Any, NamedTuple, cast

from companion.attitude import Limits, make_planner
from companion.attitude.planner import LawPlanner

LineStyle = dict[str, Any]
"""Keyword arguments of a line in matplotlib."""


class Method(NamedTuple):
    """A planner with its label and line style.

    The colours are those of Okabe and Ito, for colour-blind readers. Dashes distinguish the methods
    in black and white. A wider line stays visible below a narrower one.
    """

    planner: str
    """Name of the planner."""
    label: str
    """Name in figures and tables."""
    colour: str
    """Colour of the line."""
    dashes: tuple[float, ...] = ()
    """Lengths of dashes and gaps in line widths; empty: solid."""
    width: float = 1.6
    """Line width, points."""

    @property
    def line_style(self) -> LineStyle:
        """Keyword arguments for a line of this method."""
        style = (0, self.dashes) if self.dashes else "-"
        return {"color": self.colour, "linestyle": style, "linewidth": self.width}


LIMIT_STYLE: LineStyle = {"color": "#666666", "linestyle": "-", "linewidth": 0.8}
"""Line style of a limit."""
REFERENCE_STYLE: LineStyle = {"color": "black", "linestyle": (0, (1, 1.5)), "linewidth": 1.4}
"""Line style of a reference model."""

QUATERNION = Method("quaternion", "quaternion", "#E69F00", width=3.4)
SO3 = Method("so3", "so3", "#009E73", (5, 2), 2.4)
EULER = Method("euler", "euler", "#D55E00", (7, 2, 1.5, 2), 1.8)
PROPOSED = Method("first-order", "first-order", "#0072B2", width=1.3)
PAPER_LIMIT = Method("first-order", "first-order, paper's limit", "#56B4E9", (3, 1.2), 2.0)
MODEL_FOLLOWING_METHOD = Method("model-following", "model-following", "#332288", width=2.2)
EXACT = Method("exact", "exact", "#CC79A7", (2, 1))

PAPER_METHODS = (QUATERNION, SO3, EULER, PROPOSED)
"""The methods of the paper's comparison, in drawing order: wide lines first."""
LAW_METHODS = (*PAPER_METHODS, EXACT)
"""The methods of all planners that keep no state, in drawing order."""


def planner_of(
    method: Method,
    gain: float,
    limits: Limits = Limits(),  # noqa: B008  (frozen)
    yaw_gain: float = 2.0,
) -> LawPlanner:
    """The planner of any method except model-following, with the code that flies a vehicle."""
    return cast(LawPlanner, make_planner(method.planner, gain, yaw_gain, limits))
