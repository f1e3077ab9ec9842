"""Prediction on the linear model of the acceleration coefficients: the paper's, and ours."""

from math import cos, pi, sin
from typing import Any

import casadi as ca

from companion.nmpc.model import LONGEST, Model, given_symbols, translation
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings

_LEAST_SQUARE = 0.01
"""Least square of cos(tilt) that a prediction counts with: a Newton step may pass the horizon."""
_PAIRS = 6
"""Pairs of opposite sides of the polygon that stands for a disc: a corner every 30°."""


def proposed(settings: Settings) -> Model:
    """Equation 34: p, v, c and heading; control (c_d N, E, heading, specific thrust).

    V̇ = [T·c_N, T·c_E, g − T·√(1 − c_N² − c_E²)] − d·V + w, ċ = p·(c_d − c), heading likewise. The
    nonlinearity left is the product with the thrust, and the root.
    """
    return _model(settings, _Symbols(9))


def limited(settings: Settings) -> Model:
    """Ours: equation 34 with a second-order inner response, and with the limits of the planner.

    τ·c̈ + ċ = p·(c_d − c). |c_d| ≤ sin(max_tilt), or what |c| is at the start where that is more;
    |p·(c_d − c)| ≤ W_M·cos(max_tilt) (equation 33); the heading's rate within its own limit. The
    discs are polygons inside them: the constraints are linear then, so that a
    single iteration from anywhere keeps them, and no quadratic program is infeasible. The dead time
    is not in it: the motion is predicted past it before (`prediction`).
    """
    symbols = _Symbols(11)
    speed = symbols.state[9:11]
    asked = settings.gain * (symbols.control[0:2] - symbols.c)
    return _model(
        settings,
        symbols,
        inner=ca.vertcat(speed, (asked - speed) / settings.lag),
        bounded=ca.vertcat(
            _across_sides(symbols.control[0:2], symbols.given[LONGEST]),
            _across_sides(_tilt_rate(symbols.c, asked), settings.max_tilt_rate),
            symbols.heading_rate(settings) / settings.max_yaw_rate,
        ),
    )


def _tilt_rate(c: ca.SX, speed: ca.SX) -> ca.SX:
    """(2,) in rad/s, as long as the tilt rate that goes with a speed (2,) of the coefficients.

    The thrust axis moves on a sphere: its speed squared is |ċ|² + (c·ċ)²/cos²(tilt).
    """
    cosine = _cosine(c)
    rate: ca.SX = speed + c * ca.dot(c, speed) / (cosine * (1.0 + cosine))
    return rate


def _cosine(c: ca.SX) -> ca.SX:
    """Of the tilt."""
    return ca.sqrt(ca.fmax(1.0 - ca.sumsqr(c), _LEAST_SQUARE))


def _across_sides(vector: ca.SX, radius: Any) -> ca.SX:
    """How far a (2,) vector goes across each pair of sides; between −1 and 1 it is inside."""
    angles = [pi * k / _PAIRS for k in range(_PAIRS)]
    across = (cos(angle) * vector[0] + sin(angle) * vector[1] for angle in angles)
    sides: ca.SX = ca.vertcat(*across) / (cos(0.5 * pi / _PAIRS) * radius)
    return sides


class _Symbols:
    """State of `size`, beginning with p, v, c and heading; control; what is given."""

    def __init__(self, size: int) -> None:
        self.state = ca.SX.sym("x", size)
        self.control = ca.SX.sym("u", 4)
        self.given = given_symbols()
        self.c = self.state[6:8]
        self.heading = self.state[8]

    def heading_rate(self, settings: Settings) -> ca.SX:
        """What the planner makes of the heading asked for, rad/s."""
        return settings.yaw_gain * (self.control[2] - self.heading)


def _model(
    settings: Settings,
    symbols: _Symbols,
    inner: ca.SX | None = None,
    bounded: ca.SX | None = None,
) -> Model:
    """Put a model together; `inner` is (ċ, c̈) where the response is of second order."""
    state, control, c = symbols.state, symbols.control, symbols.c
    asked = settings.gain * (control[0:2] - c)
    heading_rate = symbols.heading_rate(settings)
    axis = ca.vertcat(c, _cosine(c))
    moving = translation(state[3:6], control[3], axis, symbols.given, settings)
    if inner is None:
        derivative = ca.vertcat(moving, asked, heading_rate)
    else:
        derivative = ca.vertcat(moving, inner[0:2], heading_rate, inner[2:4])
    aim = ca.SX.sym("aim", 4)
    size = state.numel()
    return Model(
        state=state,
        control=control,
        given=symbols.given,
        derivative=derivative,
        aim=aim,
        heading_error=symbols.heading - aim[0],
        turning_error=ca.vertcat(asked, heading_rate) - aim[1:4],
        target=control,
        state_of=lambda motion: motion[:size],
        aim_of=_aim_of,
        control_of=lambda node: (
            node.north + node.speed_north / settings.gain,
            node.east + node.speed_east / settings.gain,
            node.heading + node.heading_rate / settings.yaw_gain,
            node.thrust,
        ),
        bounded=ca.SX(0, 1) if bounded is None else bounded,
    )


def _aim_of(node: Node) -> tuple[float, ...]:
    return node.heading, node.speed_north, node.speed_east, node.heading_rate
