"""The prediction model used in flight: the linear response of the acceleration coefficients."""

from collections.abc import Callable
from math import cos, hypot, pi, sin
from typing import Any

import casadi as ca

from companion.nmpc.model import (
    Conditions,
    Model,
    Motion,
    Numbers,
    constants_symbols,
    own_constant,
    translation,
)
from companion.nmpc.settings import Settings

_SMALLEST_COS_SQUARED = 0.01
"""Lower bound of cos²(tilt) in the prediction: an iteration of the solver may tilt beyond 90°."""
_SIDE_PAIRS = 6
"""Number of pairs of opposite sides of the polygon inside a round limit: a corner every 30°."""


def coefficient_model(settings: Settings) -> Model:
    """Equation 34 of Xu & Pei with a second-order inner response and the limits of the planner.

    State: position, velocity v, coefficients c, heading, ċ. Control: c_d north, c_d east, heading,
    specific thrust T. With drag d(v) and wind w, v̇ = [T·c_N, T·c_E, g − T·√(1 − c_N² − c_E²)] −
    d(v) + w and τ·c̈ + ċ = p·(c_d − c). The heading responds in first order.

    p is the gain of the planner (`Settings.gain`, 1/s), and τ the lag of its response
    (`Settings.lag`, s).

    Limits: |c_d| ≤ sin(max_tilt), or ≤ |c| at the start if that is larger; the tilt rate of
    p·(c_d − c) is at most `max_tilt_rate`; the heading rate is at most `max_yaw_rate`.

    Inscribed polygons replace the round limits of c_d and of the tilt rate. The polygons make the
    constraints linear in the control, so one iteration from any guess gives a first control
    within the limits, and only the first control is applied. The dead time is not part of the
    model: `Predictor` integrates the motion to the end of the dead time.
    """
    symbols = Symbols(size=11, own_constants=1)
    speeds, commanded_rates = symbols.state[9:11], symbols.commanded_rates(settings)
    longest_target = own_constant(symbols.constants)

    def constants_of(conditions: Conditions, start: Motion) -> Numbers:
        return *conditions, max(sin(settings.max_tilt), hypot(start.north, start.east))

    return symbols.model(
        settings,
        derivative=ca.vertcat(
            symbols.translation(settings),
            speeds,
            commanded_rates[2],
            (commanded_rates[0:2] - speeds) / settings.lag,
        ),
        bounded_terms=ca.vertcat(
            _polygon_terms(symbols.control[0:2], longest_target),
            _polygon_terms(_tilt_rate(symbols.c, commanded_rates[0:2]), settings.max_tilt_rate),
            commanded_rates[2] / settings.max_yaw_rate,
        ),
        constants_of=constants_of,
    )


class Symbols:
    """Symbols of a model whose control contains target coefficients.

    Args:
        size: size of the state, which begins with position, velocity, coefficients and heading.
        own_constants: number of constants of the model in addition to `Conditions`.
    """

    def __init__(self, size: int, own_constants: int = 0) -> None:
        self.state = ca.SX.sym("x", size)
        self.control = ca.SX.sym("u", 4)
        self.constants = constants_symbols(own_constants)
        self.c = self.state[6:8]
        self.heading = self.state[8]

    def commanded_rates(self, settings: Settings) -> ca.SX:
        """Commanded rates of change, (3,): coefficients, p·(c_d − c), 1/s, and heading, rad/s."""
        return ca.vertcat(
            settings.gain * (self.control[0:2] - self.c),
            settings.yaw_gain * (self.control[2] - self.heading),
        )

    def translation(self, settings: Settings) -> ca.SX:
        """(6,), velocity and acceleration of these symbols; see `model.translation`."""
        axis = ca.vertcat(self.c, _cos_tilt(self.c))
        velocity, thrust = self.state[3:6], self.control[3]
        return translation(velocity, thrust, axis, self.heading, self.constants, settings)

    def model(
        self,
        settings: Settings,
        *,
        derivative: ca.SX,
        bounded_terms: ca.SX,
        constants_of: Callable[[Conditions, Motion], Numbers],
    ) -> Model:
        """Make the `Model` from these symbols and the terms given as arguments."""
        attitude_reference, size = ca.SX.sym("attitude_reference", 4), self.state.numel()
        return Model(
            state=self.state,
            control=self.control,
            constants=self.constants,
            derivative=derivative,
            attitude_reference=attitude_reference,
            heading_error=self.heading - attitude_reference[0],
            attitude_rate_error=self.commanded_rates(settings) - attitude_reference[1:4],
            target=self.control,
            bounded_terms=bounded_terms,
            state_of=lambda motion: motion[:size],
            constants_of=constants_of,
            attitude_reference_of=lambda node: (
                node.heading,
                node.speed_north,
                node.speed_east,
                node.heading_rate,
            ),
            control_of=lambda node: (
                node.north + node.speed_north / settings.gain,
                node.east + node.speed_east / settings.gain,
                node.heading + node.heading_rate / settings.yaw_gain,
                node.thrust,
            ),
        )


def _tilt_rate(c: ca.SX, speed: ca.SX) -> ca.SX:
    """(2,), a vector whose length is the tilt rate, rad/s, at a speed (2,) of the coefficients.

    The thrust axis moves on a sphere: its squared speed is |ċ|² + (c·ċ)²/cos²(tilt).
    """
    cosine = _cos_tilt(c)
    rate: ca.SX = speed + c * ca.dot(c, speed) / (cosine * (1.0 + cosine))
    return rate


def _cos_tilt(c: ca.SX) -> ca.SX:
    return ca.sqrt(ca.fmax(1.0 - ca.sumsqr(c), _SMALLEST_COS_SQUARED))


def _polygon_terms(vector: ca.SX, radius: Any) -> ca.SX:
    """Six terms, each within ±1, that keep a vector (2,) inside a regular polygon.

    A term is the component of the vector normal to a pair of sides, divided by the distance of the
    sides from the centre.

    Args:
        vector: (2,), in any unit.
        radius: radius of the circle through the corners, in the unit of the vector.
    """
    angles = [pi * k / _SIDE_PAIRS for k in range(_SIDE_PAIRS)]
    components = (cos(angle) * vector[0] + sin(angle) * vector[1] for angle in angles)
    terms: ca.SX = ca.vertcat(*components) / (cos(0.5 * pi / _SIDE_PAIRS) * radius)
    return terms
