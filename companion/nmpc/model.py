"""What a prediction model is, and what all of them share: thrust, gravity, drag, integration."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca

from companion.drag import Drag
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings

Floats = Sequence[float]


class Motion(NamedTuple):
    """How the vehicle moves: the state of the `limited` model, in its order.

    Attributes:
        p_n, p_e, p_d: position, m, NED.
        v_n, v_e, v_d: velocity, m/s, NED.
        north, east: acceleration coefficients.
        heading: tilt-yaw heading, rad.
        speed_north, speed_east: speed of the coefficients, 1/s.
    """

    p_n: float
    p_e: float
    p_d: float
    v_n: float
    v_e: float
    v_d: float
    north: float
    east: float
    heading: float
    speed_north: float
    speed_east: float


class Given(NamedTuple):
    """What is the same over the whole horizon.

    Attributes:
        w_n, w_e, w_d: acceleration by wind and what else is not modelled, m/s², NED.
        yaw: Euler yaw at the start, rad.
        longest: length of the longest coefficients that may be asked for.
        linear_drag, quadratic_drag: `Drag`, 1/s and 1/m.
    """

    w_n: float
    w_e: float
    w_d: float
    yaw: float
    longest: float
    linear_drag: float
    quadratic_drag: float


YAW, LONGEST = Given._fields.index("yaw"), Given._fields.index("longest")
_DRAG = slice(Given._fields.index("linear_drag"), len(Given._fields))
"""Where they stand in the symbols of what is given."""


def given_symbols() -> ca.SX:
    """(7,), a symbol for each of `Given`."""
    return ca.SX.sym("given", len(Given._fields))


@dataclass(frozen=True, eq=False)
class Model:
    """ẋ = f(x, u), the terms of the cost, and the way from numbers to numbers; CasADi symbols.

    Attributes:
        state: (n,), begins with position and velocity.
        control: (m,), ends with the specific thrust.
        given: (7,), the symbols of `Given`.
        derivative: (n,), ẋ.
        aim: (k,), the reference of a node in the model's own terms.
        heading_error: rad, of `state` against `aim`.
        turning_error: how fast the attitude is told to turn, less what `aim` says.
        bounded: what lies between −1 and 1 at every control.
        target: (4,), coefficients, tilt-yaw heading and specific thrust that make the planner do
            what the control says.
        state_of: a motion → `state`.
        aim_of: a node of the reference → `aim`.
        control_of: a node of the reference → the `control` that stays on it.
    """

    state: ca.SX
    control: ca.SX
    given: ca.SX
    derivative: ca.SX
    aim: ca.SX
    heading_error: ca.SX
    turning_error: ca.SX
    target: ca.SX
    state_of: Callable[[Motion], Floats]
    aim_of: Callable[[Node], Floats]
    control_of: Callable[[Node], Floats]
    bounded: ca.SX


def translation(
    velocity: ca.SX, thrust: ca.SX, axis: ca.SX, given: ca.SX, settings: Settings
) -> ca.SX:
    """Velocity and acceleration, (6,), of a point mass with drag (equation 10 with drag).

    Args:
        velocity: (3,), NED, m/s.
        thrust: specific, m/s².
        axis: (3,), coefficients north and east, and cos(tilt).
        given: (7,), the symbols of `Given`.
        settings: gravity.
    """
    lift = thrust * ca.vertcat(axis[0], axis[1], -axis[2])
    weight = ca.vertcat(0.0, 0.0, settings.gravity)
    told: list[Any] = ca.vertsplit(given[_DRAG])  # symbols for its numbers
    moving: list[Any] = ca.vertsplit(velocity)
    slowed = ca.vertcat(*Drag(*told).deceleration((moving[0], moving[1], moving[2])))
    return ca.vertcat(velocity, lift + weight - slowed + given[0:3])


def led_target(
    model_state: ca.SX,
    derivative: ca.SX,
    coefficients: ca.SX,
    heading: ca.SX,
    thrust: ca.SX,
    settings: Settings,
) -> ca.SX:
    """The target that makes a first-order planner move the attitude as `derivative` does.

    c_d = c + ċ/p, and likewise for the heading.
    """
    speed = ca.jtimes(coefficients, model_state, derivative)
    heading_rate = ca.jtimes(heading, model_state, derivative)
    return ca.vertcat(
        coefficients + speed / settings.gain,
        heading + heading_rate / settings.yaw_gain,
        thrust,
    )


def integrator(model: Model) -> ca.Function:
    """(state, control, given, dt) → the state dt seconds later: one step of Runge–Kutta 4."""
    given = model.given
    slope = ca.Function("slope", [model.state, model.control, given], [model.derivative])
    dt = ca.SX.sym("dt")
    x, u = model.state, model.control
    k1 = model.derivative
    k2 = slope(x + 0.5 * dt * k1, u, given)
    k3 = slope(x + 0.5 * dt * k2, u, given)
    k4 = slope(x + dt * k3, u, given)
    after = x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return ca.Function("advance", [x, u, given, dt], [after])
