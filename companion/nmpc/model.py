"""The type of a prediction model in CasADi; translation and integrator, which all models share."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca

from companion.drag import Drag, axis_drag_deceleration
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings

Numbers = Sequence[float]


class Motion(NamedTuple):
    """The motion of the vehicle; the fields are the state of `coefficient_model`, in its order."""

    p_n: float
    p_e: float
    p_d: float
    """`p_n`, `p_e` and `p_d`: position, m, NED."""
    v_n: float
    v_e: float
    v_d: float
    """`v_n`, `v_e` and `v_d`: velocity, m/s, NED."""
    north: float
    east: float
    """`north` and `east`: acceleration coefficients."""
    heading: float
    """Tilt-yaw heading, rad."""
    speed_north: float
    speed_east: float
    """`speed_north` and `speed_east`: time derivative of the coefficients, 1/s."""


class Conditions(NamedTuple):
    """Wind and drag on the vehicle, constant over the horizon."""

    w_n: float
    w_e: float
    w_d: float
    """`w_n`, `w_e` and `w_d`: acceleration by wind and other unmodelled forces, m/s², NED."""
    linear_drag: float
    quadratic_drag: float
    """`linear_drag` and `quadratic_drag`: coefficients of `Drag`, 1/s and 1/m."""
    axis_drag: float
    """Coefficient of `AxisDrag`, 1/m."""


@dataclass(frozen=True, eq=False)
class Model:
    """A model ẋ = f(x, u) in CasADi symbols, with the terms of the cost.

    The functions `state_of`, `constants_of`, `attitude_reference_of` and `control_of` compute the
    numbers for the symbols.
    """

    state: ca.SX
    """State x, (n,); begins with position and velocity."""
    control: ca.SX
    """Control u, (m,); ends with the specific thrust."""
    constants: ca.SX
    """Values that are constant over the horizon, (c,); begins with `Conditions`."""
    derivative: ca.SX
    """Time derivative ẋ of the state, (n,)."""
    attitude_reference: ca.SX
    """Heading and attitude rate of the reference at a node, (k,), in the form that the model needs
    for `heading_error` and `attitude_rate_error`."""
    heading_error: ca.SX
    """Heading of `state` minus that of `attitude_reference`, rad. Models of the studies may use the
    Euler yaw or a smooth approximation instead; it is empty in a model of constant yaw."""
    attitude_rate_error: ca.SX
    """Commanded attitude rate minus that of `attitude_reference`: rates of the coefficients (1/s)
    and of the heading (rad/s). Models of the studies may use body rates or rates of Euler angles
    instead, both in rad/s."""
    target: ca.SX
    """Target for the planner when `control` is applied, (4,): coefficients, tilt-yaw heading and
    specific thrust."""
    bounded_terms: ca.SX
    """Terms that must stay between −1 and 1 in every step of the horizon."""
    state_of: Callable[[Motion], Numbers]
    """Function: motion → numbers for `state`."""
    constants_of: Callable[[Conditions, Motion], Numbers]
    """Function: conditions, and motion at the start of the horizon → numbers for `constants`."""
    attitude_reference_of: Callable[[Node], Numbers]
    """Function: node of the reference → numbers for `attitude_reference`."""
    control_of: Callable[[Node], Numbers]
    """Function: node of the reference → the `control` that keeps the vehicle on the reference."""


def constants_symbols(own_count: int = 0) -> ca.SX:
    """Symbols (6 + own_count,): the 6 constants of `Conditions`, then those of the model itself."""
    return ca.SX.sym("constants", len(Conditions._fields) + own_count)


def own_constant(constants: ca.SX) -> ca.SX:
    """Symbol of a model's first own constant, which follows the constants of `Conditions`."""
    return constants[len(Conditions._fields)]


def translation(
    velocity: ca.SX,
    thrust: ca.SX,
    axis: ca.SX,
    heading: ca.SX,
    constants: ca.SX,
    settings: Settings,
) -> ca.SX:
    """Velocity and acceleration, (6,), of a point mass with drag (equation 10 with drag).

    Args:
        velocity: (3,), NED, m/s.
        thrust: specific thrust, m/s².
        axis: (3,), coefficients north and east, and cos(tilt).
        heading: tilt-yaw heading, rad; the body's forward axis is assumed to point there.
        constants: symbols that begin with `Conditions`.
        settings: settings that contain gravity.
    """
    lift = thrust * ca.vertcat(axis[0], axis[1], -axis[2])
    weight = ca.vertcat(0.0, 0.0, settings.gravity)
    symbols: list[Any] = ca.vertsplit(constants)  # typed so that mypy takes symbols as numbers
    conditions = Conditions(*symbols[: len(Conditions._fields)])
    drag = Drag(conditions.linear_drag, conditions.quadratic_drag)
    v: list[Any] = ca.vertsplit(velocity)
    deceleration = ca.vertcat(*drag.deceleration((v[0], v[1], v[2])))
    forward: list[Any] = [ca.cos(heading), ca.sin(heading)]
    along_body = axis_drag_deceleration(conditions.axis_drag, forward[0], forward[1], v[0], v[1])
    deceleration += ca.vertcat(*along_body, 0.0)
    disturbance = ca.vertcat(conditions.w_n, conditions.w_e, conditions.w_d)
    return ca.vertcat(velocity, lift + weight - deceleration + disturbance)


def integrator(model: Model) -> ca.Function:
    """(state, control, constants, dt) → the state dt seconds later, by one Runge–Kutta 4 step."""
    constants = model.constants
    slope = ca.Function("slope", [model.state, model.control, constants], [model.derivative])
    dt = ca.SX.sym("dt")
    x, u = model.state, model.control
    k1 = model.derivative
    k2 = slope(x + 0.5 * dt * k1, u, constants)
    k3 = slope(x + 0.5 * dt * k2, u, constants)
    k4 = slope(x + dt * k3, u, constants)
    next_state = x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return ca.Function("advance", [x, u, constants, dt], [next_state])
