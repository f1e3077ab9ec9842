"""ArduPilot's shaping of body-rate setpoints.

The shaping limits the angular acceleration and integrates the rates to an attitude target. An
attitude controller follows the target; its output is the setpoint of the rate loop.
"""

from math import atan2, copysign, inf, isnan, sqrt
from typing import NamedTuple

from sitl_mock.config.rate_loop import AxisShaping
from sitl_mock.physics.quaternion import Quaternion, Vector, multiply, normalise, to_body
from sitl_mock.physics.rate_loop import Delays, delay_steps

SqrtGains = tuple[float, float]
"""Arguments of `sqrt_controller` for one axis: gain, 1/s; limit of the deceleration, rad/s^2."""


class ShapingState(NamedTuple):
    """State of the shaping of rate setpoints."""

    active: bool
    """Whether rates are shaped now. False on the ground, disarmed, and in a loop that does not
    shape."""
    rates: Vector
    """Shaped rates along the axes of the attitude target, rad/s."""
    target: Quaternion
    """Attitude target, body to world."""


INACTIVE_SHAPING = ShapingState(False, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


def slew(goal: float, rate: float, limit: float) -> float:
    """Return the rate after it has changed towards its goal by at most `limit`, all in rad/s.

    A NaN goal holds the rate. With an infinite goal the rate grows without limit, as measured on
    ArduPilot.
    """
    if isnan(goal):
        return rate
    change = goal - rate
    return rate + (limit if change > limit else -limit if change < -limit else change)


def rotated(q: Quaternion, rates: Vector, dt: float) -> Quaternion:
    """Return the attitude after `dt` s of body rates (rad/s), to within (rate dt)^3 / 12 rad."""
    half_dt = 0.5 * dt
    return normalise(multiply(q, (1.0, half_dt * rates[0], half_dt * rates[1], half_dt * rates[2])))


def rotation_vector(q: Quaternion) -> Vector:
    """Return the rotation vector of a unit quaternion, rad, along the shorter rotation."""
    w, x, y, z = q if q[0] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
    sine = sqrt(x * x + y * y + z * z)
    scale = 2.0 * atan2(sine, w) / sine if sine > 0.0 else 2.0
    return scale * x, scale * y, scale * z


def sqrt_controller(angle: float, gain: float, acceleration: float) -> float:
    """Return the rate that corrects an angle error, rad/s, as ArduPilot's sqrt_controller does.

    The rate has the sign of the error. For small errors it is proportional to the error. For larger
    errors it is the rate from which the deceleration `acceleration` reaches zero rate and zero
    error at the same time.

    Args:
        angle: angle error, rad.
        gain: rate per error, if the error is small, 1/s.
        acceleration: limit of the deceleration, rad/s^2.
    """
    linear_range = acceleration / (gain * gain) if gain > 0.0 else inf
    if abs(angle) <= linear_range:
        return gain * angle
    return copysign(sqrt(2.0 * acceleration * (abs(angle) - 0.5 * linear_range)), angle)


class ShapingConstants(NamedTuple):
    """Constants of the shaping of rate setpoints."""

    max_change: Vector
    """Largest change of each rate in one step, rad/s."""
    sqrt_gains: tuple[SqrtGains, SqrtGains, SqrtGains]
    """Gains of roll, pitch and yaw from attitude error to body rate."""
    delays: Delays
    dt: float  # step, s


def shaping_constants(
    axes: tuple[AxisShaping, AxisShaping, AxisShaping] | None, dt: float
) -> ShapingConstants:
    """Return the constants of the shaping of roll, pitch and yaw for steps of `dt` seconds.

    If `axes` is None, no rate is shaped and the constants are unused: they are zeros, because the
    compiler needs a value of this type.
    """
    if axes is None:
        return ShapingConstants(
            (0.0, 0.0, 0.0), ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0)), (0, 0, 0), dt
        )
    roll, pitch, yaw = axes
    limits = (
        roll.acceleration_limit_rad_s2,
        pitch.acceleration_limit_rad_s2,
        yaw.acceleration_limit_rad_s2,
    )
    return ShapingConstants(
        (limits[0] * dt, limits[1] * dt, limits[2] * dt),
        (
            (roll.attitude_gain_1_s, 0.5 * limits[0]),
            (pitch.attitude_gain_1_s, 0.5 * limits[1]),
            (yaw.attitude_gain_1_s, 0.5 * limits[2]),
        ),
        delay_steps((roll.delay_ms, pitch.delay_ms, yaw.delay_ms), dt),
        dt,
    )


def shape(
    constants: ShapingConstants, state: ShapingState, goals: Vector, q: Quaternion
) -> tuple[Vector, ShapingState]:
    """Shape the rates of the three axes, which share one attitude target, for one step (pure).

    Args:
        constants: constants of the shaping.
        state: state before the step; if it is not active, the attitude target starts at `q`.
        goals: body rates, rad/s, already delayed. NaN holds the shaped rate; with infinity it grows
            without limit.
        q: present attitude.

    Returns:
        The setpoint of the rate loop, rad/s, FRD, and the state after the step.
    """
    max_change = constants.max_change
    old_rates = state.rates
    rates = (
        slew(goals[0], old_rates[0], max_change[0]),
        slew(goals[1], old_rates[1], max_change[1]),
        slew(goals[2], old_rates[2], max_change[2]),
    )
    target = rotated(state.target if state.active else q, rates, constants.dt)
    w, x, y, z = target
    body_in_target = multiply((w, -x, -y, -z), q)  # attitude of the body in the frame of the target
    angle_x, angle_y, angle_z = rotation_vector(body_in_target)
    roll, pitch, yaw = to_body(body_in_target, rates)
    roll_gains, pitch_gains, yaw_gains = constants.sqrt_gains
    setpoint = (
        roll - sqrt_controller(angle_x, roll_gains[0], roll_gains[1]),
        pitch - sqrt_controller(angle_y, pitch_gains[0], pitch_gains[1]),
        yaw - sqrt_controller(angle_z, yaw_gains[0], yaw_gains[1]),
    )
    return setpoint, ShapingState(True, rates, target)
