"""The prediction models of the study; the equations are those of Xu & Pei, Sensors 2026, 26(9).

The paper has `proposed` (34), `euler` (37) and `quaternion` (39), none with a limit of tilt or
rate. `limited` is the model used in flight, and `euler-reduced` a simplified `euler` for a fair
comparison. The paper has neither drag nor disturbance; here they are the same in all models.

The controls of the attitude models are body rates. `_first_order_target` converts them to the
target for which the planner commands these rates, so that the same inner loop flies all models.
"""

from collections.abc import Callable
from math import cos, sin
from typing import Any, Literal

import casadi as ca

from companion.attitude.kinematics import rotate_to_heading
from companion.attitude.reference_model import rates_along
from companion.attitude.representation import wrap_angle
from companion.attitude.rotation import attitude_of, euler_angles
from companion.nmpc.coefficient_model import Symbols, coefficient_model
from companion.nmpc.model import (
    Conditions,
    Model,
    Motion,
    Numbers,
    constants_symbols,
    own_constant,
    translation,
)
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings

ModelName = Literal["proposed", "limited", "euler", "euler-reduced", "quaternion"]


def proposed(settings: Settings) -> Model:
    """Equation 34, with the acceleration coefficients c = (c_N, c_E) as the attitude.

    State: position, velocity V, c, heading. Control: c_d, commanded heading, specific thrust T.
    V̇ = [T·c_N, T·c_E, g − T·√(1 − c_N² − c_E²)] − d(V) + w, with drag d and disturbance w.
    ċ = p·(c_d − c), as for the heading. Only the products with T and the root are nonlinear.
    """
    symbols = Symbols(size=9)
    return symbols.model(
        settings,
        derivative=ca.vertcat(symbols.translation(settings), symbols.commanded_rates(settings)),
        bounded_terms=ca.SX(0, 1),
        constants_of=_conditions_only,
    )


def euler(settings: Settings) -> Model:
    """The paper's equation 37: position, velocity, Euler angles; control: body rates and thrust.

    The rates of the angles are M(φ, θ)⁻¹·ω, with the matrix M of section 4.2.
    """
    state, control, constants = ca.SX.sym("x", 9), ca.SX.sym("u", 4), constants_symbols()
    roll, pitch, yaw = state[6], state[7], state[8]
    rotation_rates = ca.vertcat(*_euler_rates(roll, pitch, control[0], control[1], control[2]))
    axis = _thrust_axis(roll, pitch, yaw)
    heading = _heading(roll, pitch, yaw)
    translation_rates = translation(state[3:6], control[3], axis, heading, constants, settings)
    derivative = ca.vertcat(translation_rates, rotation_rates)
    reference = ca.SX.sym("reference", 4)
    return Model(
        state=state,
        control=control,
        constants=constants,
        derivative=derivative,
        attitude_reference=reference,
        heading_error=yaw - reference[0],
        attitude_rate_error=control[0:3] - reference[1:4],
        target=_first_order_target(state, derivative, axis[0:2], heading, control[3], settings),
        state_of=lambda motion: (
            *motion[:6],
            *_euler_near_heading(motion.north, motion.east, motion.heading),
        ),
        attitude_reference_of=lambda node: (
            _euler_near_heading(node.north, node.east, node.heading)[2],
            *_body_rates(node),
        ),
        control_of=lambda node: (*_body_rates(node), node.thrust),
        bounded_terms=ca.SX(0, 1),
        constants_of=_conditions_only,
    )


def euler_reduced(settings: Settings) -> Model:
    """The paper's equation 37 without its matrix and with constant yaw, for a fair comparison.

    The controls are φ̇, θ̇ and the specific thrust; ω = M·(φ̇, θ̇, ψ̇) can be computed afterwards.
    """
    state, control, constants = ca.SX.sym("x", 8), ca.SX.sym("u", 3), constants_symbols(own_count=1)
    yaw = own_constant(constants)
    roll, pitch = state[6], state[7]
    axis = _thrust_axis(roll, pitch, yaw)
    heading = _heading(roll, pitch, yaw)
    translation_rates = translation(state[3:6], control[2], axis, heading, constants, settings)
    derivative = ca.vertcat(translation_rates, control[0:2])
    reference = ca.SX.sym("reference", 2)
    return Model(
        state=state,
        control=control,
        constants=constants,
        derivative=derivative,
        attitude_reference=reference,
        heading_error=ca.SX(0, 1),
        attitude_rate_error=control[0:2] - reference,
        target=_first_order_target(state, derivative, axis[0:2], heading, control[2], settings),
        state_of=lambda motion: (
            *motion[:6],
            *_euler_near_heading(motion.north, motion.east, motion.heading)[:2],
        ),
        attitude_reference_of=_angle_rates,
        control_of=lambda node: (*_angle_rates(node), node.thrust),
        bounded_terms=ca.SX(0, 1),
        constants_of=lambda conditions, start: (
            *conditions,
            _euler_near_heading(start.north, start.east, start.heading)[2],
        ),
    )


def quaternion(settings: Settings) -> Model:
    """Equation 39: state (position, velocity, unit quaternion); control (body rates, thrust).

    q̇ = ½·q ⊗ (0, ω).
    """
    state, control, constants = ca.SX.sym("x", 10), ca.SX.sym("u", 4), constants_symbols()
    w, x, y, z = (state[6 + i] for i in range(4))
    roll, pitch, yaw = (control[i] for i in range(3))
    axis = ca.vertcat(-2.0 * (x * z + w * y), 2.0 * (w * x - y * z), 1.0 - 2.0 * (x * x + y * y))
    rotation_rates = 0.5 * ca.vertcat(
        -x * roll - y * pitch - z * yaw,
        w * roll + y * yaw - z * pitch,
        w * pitch + z * roll - x * yaw,
        w * yaw + x * pitch - y * roll,
    )
    heading = 2.0 * ca.atan2(z, w)
    translation_rates = translation(state[3:6], control[3], axis, heading, constants, settings)
    derivative = ca.vertcat(translation_rates, rotation_rates)
    reference = ca.SX.sym("reference", 5)
    return Model(
        state=state,
        control=control,
        constants=constants,
        derivative=derivative,
        attitude_reference=reference,
        # Twice the sine of half the heading error, which is smooth where an angle would jump.
        heading_error=2.0 * (z * reference[0] - w * reference[1]) / ca.sqrt(w * w + z * z),
        attitude_rate_error=control[0:3] - reference[2:5],
        target=_first_order_target(state, derivative, axis[0:2], heading, control[3], settings),
        state_of=lambda motion: (
            *motion[:6],
            *attitude_of(motion.north, motion.east, motion.heading),
        ),
        attitude_reference_of=lambda node: (
            cos(0.5 * node.heading),
            sin(0.5 * node.heading),
            *_body_rates(node),
        ),
        control_of=lambda node: (*_body_rates(node), node.thrust),
        bounded_terms=ca.SX(0, 1),
        constants_of=_conditions_only,
    )


MODEL_MAKERS: dict[ModelName, Callable[[Settings], Model]] = {
    "proposed": proposed,
    "limited": coefficient_model,
    "euler": euler,
    "euler-reduced": euler_reduced,
    "quaternion": quaternion,
}
"""The function that makes each model."""


def _conditions_only(conditions: Conditions, _start: Motion) -> Numbers:
    """The constants of a model that has no other constants than `Conditions`."""
    return conditions


def _first_order_target(
    state: ca.SX,
    derivative: ca.SX,
    coefficients: ca.SX,
    heading: ca.SX,
    thrust: ca.SX,
    settings: Settings,
) -> ca.SX:
    """The target for which a first-order planner commands the rates in `derivative`.

    c_d = c + ċ/p, and likewise for the heading.
    """
    speed = ca.jtimes(coefficients, state, derivative)
    heading_rate = ca.jtimes(heading, state, derivative)
    return ca.vertcat(
        coefficients + speed / settings.gain,
        heading + heading_rate / settings.yaw_gain,
        thrust,
    )


def _euler_rates(roll: Any, pitch: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
    """Rates of the Euler angles, M(φ, θ)⁻¹·ω, for body rates ω = (x, y, z); symbols or numbers."""
    yaw_term = ca.sin(roll) * y + ca.cos(roll) * z
    return (
        x + ca.tan(pitch) * yaw_term,
        ca.cos(roll) * y - ca.sin(roll) * z,
        yaw_term / ca.cos(pitch),
    )


def _thrust_axis(roll: ca.SX, pitch: ca.SX, yaw: ca.SX) -> ca.SX:
    """Unit vector of the thrust (3,): north, east, up; the first two are the coefficients."""
    sin_pitch_cos_roll = ca.sin(pitch) * ca.cos(roll)
    return ca.vertcat(
        -(ca.cos(yaw) * sin_pitch_cos_roll + ca.sin(yaw) * ca.sin(roll)),
        ca.cos(yaw) * ca.sin(roll) - ca.sin(yaw) * sin_pitch_cos_roll,
        ca.cos(pitch) * ca.cos(roll),
    )


def _heading(roll: ca.SX, pitch: ca.SX, yaw: ca.SX) -> ca.SX:
    """Heading of the tilt-yaw decomposition, 2·atan2(z, w), from Euler angles, rad."""
    cos_product, sin_product = (f(0.5 * roll) * f(0.5 * pitch) for f in (ca.cos, ca.sin))
    c, s = ca.cos(0.5 * yaw), ca.sin(0.5 * yaw)
    return 2.0 * ca.atan2(cos_product * s - sin_product * c, cos_product * c + sin_product * s)


def _euler_near_heading(north: float, east: float, heading: float) -> tuple[float, float, float]:
    """Roll, pitch and yaw, rad; the yaw is within π of the heading, which may exceed ±π."""
    roll, pitch, yaw = euler_angles(attitude_of(north, east, heading))
    return roll, pitch, heading + wrap_angle(yaw - heading)


def _body_rates(node: Node) -> tuple[float, float, float]:
    """Body rates of a vehicle that follows the reference exactly, rad/s."""
    x, y, z = rates_along(node.north, node.east, node.speed_north, node.speed_east)
    return (*rotate_to_heading(cos(node.heading), sin(node.heading), x, y), z + node.heading_rate)


def _angle_rates(node: Node) -> tuple[float, float]:
    """φ̇ and θ̇ of a vehicle that follows the reference exactly, rad/s."""
    roll, pitch, _ = _euler_near_heading(node.north, node.east, node.heading)
    roll_rate, pitch_rate, _ = _euler_rates(roll, pitch, *_body_rates(node))
    return roll_rate, pitch_rate
