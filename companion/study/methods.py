"""The methods that are compared: one name and one look each, in every figure and table."""

from typing import Any, NamedTuple, cast

from companion.attitude import Limits, make_planner
from companion.attitude.planner import LawPlanner

Line = dict[str, Any]
"""How matplotlib draws a line: its keywords."""


class Method(NamedTuple):
    """A planner under the name and the look that it has throughout.

    The colours are Okabe and Ito's, which the colour-blind tell apart; the dashes and widths keep
    the methods apart in black and white, and let a curve be seen below another that is narrower.
    """

    planner: str
    label: str
    colour: str
    dashes: tuple[float, ...] = ()
    width: float = 1.6

    @property
    def line(self) -> Line:
        """Keywords for a line of this method."""
        style = (0, self.dashes) if self.dashes else "-"
        return {"color": self.colour, "linestyle": style, "linewidth": self.width}


LIMIT: Line = {"color": "#666666", "linestyle": "-", "linewidth": 0.8}
"""The look of a limit."""
REFERENCE: Line = {"color": "black", "linestyle": (0, (1, 1.5)), "linewidth": 1.4}
"""The look of every reference model."""

QUATERNION = Method("quaternion", "quaternion", "#E69F00", width=3.4)
SO3 = Method("so3", "so3", "#009E73", (5, 2), 2.4)
EULER = Method("euler", "euler", "#D55E00", (7, 2, 1.5, 2), 1.8)
PROPOSED = Method("first-order", "first-order", "#0072B2", width=1.3)
PAPER_LIMIT = Method("first-order", "first-order, paper's limit", "#56B4E9", (3, 1.2), 2.0)
FOLLOWING = Method("model-following", "model-following", "#332288", width=2.2)
EXACT = Method("exact", "exact", "#CC79A7", (2, 1))

PAPERS = (QUATERNION, SO3, EULER, PROPOSED)
"""The methods of the paper's comparison, in drawing order: the broad lines come first."""
BY_PLANNER = {method.planner: method for method in (*PAPERS, EXACT)}
"""The look of every planner, in the same order."""


def planner_of(
    method: Method,
    gain: float,
    limits: Limits = Limits(),  # noqa: B008  (frozen)
    yaw_gain: float = 2.0,
) -> LawPlanner:
    """The planner of a method, the very one that flies."""
    return cast(LawPlanner, make_planner(method.planner, gain, yaw_gain, limits))
