"""Prediction on the attitude itself, by Euler angles or by the quaternion: the paper's others.

Their controls are body rates, which this program's planner does not take. Their answers are
therefore turned into the target that makes it ask for these very rates (`model.led_target`), so
that all models are flown by the same inner loop.
"""

from math import cos, sin
from typing import Any

import casadi as ca

from companion.attitude.kinematics import into_body
from companion.attitude.reference_model import rates_along
from companion.attitude.representation import wrap_angle
from companion.attitude.rotation import attitude_of, euler_angles
from companion.nmpc.model import YAW, Model, given_symbols, led_target, translation
from companion.nmpc.reference import Node
from companion.nmpc.settings import Settings


def euler(settings: Settings) -> Model:
    """Equation 37: p, v, and the Euler angles Z-Y-X; control (body rates, specific thrust).

    The angles turn with M(φ, θ)⁻¹·ω, the inverse of the matrix in section 4.2.
    """
    state, control, given = ca.SX.sym("x", 9), ca.SX.sym("u", 4), given_symbols()
    roll, pitch, yaw = state[6], state[7], state[8]
    turning = ca.vertcat(*_euler_rates(roll, pitch, control[0], control[1], control[2]))
    axis = _thrust_axis(roll, pitch, yaw)
    moving = translation(state[3:6], control[3], axis, given, settings)
    derivative = ca.vertcat(moving, turning)
    aim = ca.SX.sym("aim", 4)
    heading = _heading(roll, pitch, yaw)
    return Model(
        state=state,
        control=control,
        given=given,
        derivative=derivative,
        aim=aim,
        heading_error=yaw - aim[0],
        turning_error=control[0:3] - aim[1:4],
        target=led_target(state, derivative, axis[0:2], heading, control[3], settings),
        state_of=lambda motion: (
            *motion[:6],
            *euler_near(motion.north, motion.east, motion.heading),
        ),
        aim_of=lambda node: (
            euler_near(node.north, node.east, node.heading)[2],
            *_body_rates(node),
        ),
        control_of=lambda node: (*_body_rates(node), node.thrust),
        bounded=ca.SX(0, 1),
    )


def euler_reduced(settings: Settings) -> Model:
    """Equation 37 with its matrix cancelled and the yaw held: the baseline a fair reader asks for.

    Since ω = M·(φ̇, θ̇, ψ̇) can be computed afterwards, the controls may as well be φ̇ and θ̇
    themselves: then nothing is left of the matrix, and the yaw is a number of the horizon.
    """
    state, control, given = ca.SX.sym("x", 8), ca.SX.sym("u", 3), given_symbols()
    roll, pitch = state[6], state[7]
    axis = _thrust_axis(roll, pitch, given[YAW])
    moving = translation(state[3:6], control[2], axis, given, settings)
    derivative = ca.vertcat(moving, control[0:2])
    aim = ca.SX.sym("aim", 2)
    heading = _heading(roll, pitch, given[YAW])
    return Model(
        state=state,
        control=control,
        given=given,
        derivative=derivative,
        aim=aim,
        heading_error=ca.SX(0, 1),
        turning_error=control[0:2] - aim,
        target=led_target(state, derivative, axis[0:2], heading, control[2], settings),
        state_of=lambda motion: (
            *motion[:6],
            *euler_near(motion.north, motion.east, motion.heading)[:2],
        ),
        aim_of=_angle_rates,
        control_of=lambda node: (*_angle_rates(node), node.thrust),
        bounded=ca.SX(0, 1),
    )


def quaternion(settings: Settings) -> Model:
    """Equation 39: p, v, and the attitude as a unit quaternion; control (body rates, thrust).

    q̇ = ½·q ⊗ (0, ω).
    """
    state, control, given = ca.SX.sym("x", 10), ca.SX.sym("u", 4), given_symbols()
    w, x, y, z = (state[6 + i] for i in range(4))
    roll, pitch, yaw = (control[i] for i in range(3))
    axis = ca.vertcat(-2.0 * (x * z + w * y), 2.0 * (w * x - y * z), 1.0 - 2.0 * (x * x + y * y))
    turning = 0.5 * ca.vertcat(
        -x * roll - y * pitch - z * yaw,
        w * roll + y * yaw - z * pitch,
        w * pitch + z * roll - x * yaw,
        w * yaw + x * pitch - y * roll,
    )
    derivative = ca.vertcat(translation(state[3:6], control[3], axis, given, settings), turning)
    aim = ca.SX.sym("aim", 5)
    return Model(
        state=state,
        control=control,
        given=given,
        derivative=derivative,
        aim=aim,
        # Twice the sine of half the error of the tilt-yaw heading: smooth, where an angle jumps.
        heading_error=2.0 * (z * aim[0] - w * aim[1]) / ca.sqrt(w * w + z * z),
        turning_error=control[0:3] - aim[2:5],
        target=led_target(state, derivative, axis[0:2], 2.0 * ca.atan2(z, w), control[3], settings),
        state_of=lambda motion: (
            *motion[:6],
            *attitude_of(motion.north, motion.east, motion.heading),
        ),
        aim_of=lambda node: (
            cos(0.5 * node.heading),
            sin(0.5 * node.heading),
            *_body_rates(node),
        ),
        control_of=lambda node: (*_body_rates(node), node.thrust),
        bounded=ca.SX(0, 1),
    )


def _euler_rates(roll: Any, pitch: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
    """M(φ, θ)⁻¹·ω of body rates (x, y, z); symbols or numbers."""
    turning = ca.sin(roll) * y + ca.cos(roll) * z
    return (
        x + ca.tan(pitch) * turning,
        ca.cos(roll) * y - ca.sin(roll) * z,
        turning / ca.cos(pitch),
    )


def _thrust_axis(roll: ca.SX, pitch: ca.SX, yaw: ca.SX) -> ca.SX:
    """Coefficients and cos(tilt), (3,): the third column of the rotation matrix."""
    lean = ca.sin(pitch) * ca.cos(roll)
    return ca.vertcat(
        -(ca.cos(yaw) * lean + ca.sin(yaw) * ca.sin(roll)),
        ca.cos(yaw) * ca.sin(roll) - ca.sin(yaw) * lean,
        ca.cos(pitch) * ca.cos(roll),
    )


def _heading(roll: ca.SX, pitch: ca.SX, yaw: ca.SX) -> ca.SX:
    """Tilt-yaw heading 2·atan2(z, w) of Euler angles."""
    level, tilted = (f(0.5 * roll) * f(0.5 * pitch) for f in (ca.cos, ca.sin))
    half = 0.5 * yaw
    return 2.0 * ca.atan2(
        level * ca.sin(half) - tilted * ca.cos(half), level * ca.cos(half) + tilted * ca.sin(half)
    )


def euler_near(north: float, east: float, heading: float) -> tuple[float, float, float]:
    """Roll, pitch, and the yaw within π of the heading, which need not be wrapped; all rad."""
    roll, pitch, yaw = euler_angles(attitude_of(north, east, heading))
    return roll, pitch, heading + wrap_angle(yaw - heading)


def _body_rates(node: Node) -> tuple[float, float, float]:
    """Body rates that keep a vehicle on the reference, rad/s."""
    x, y, still = rates_along(node.north, node.east, node.speed_north, node.speed_east)
    return (*into_body(cos(node.heading), sin(node.heading), x, y), still + node.heading_rate)


def _angle_rates(node: Node) -> tuple[float, float]:
    """φ̇ and θ̇ that do."""
    roll, pitch, _ = euler_near(node.north, node.east, node.heading)
    roll_rate, pitch_rate, _ = _euler_rates(roll, pitch, *_body_rates(node))
    return roll_rate, pitch_rate
