"""The autopilot's body-rate controller: PI with feed-forward and damping on each axis.

The functions are pure, except for the ring of delayed setpoints.
"""

from math import exp, isfinite
from typing import NamedTuple

from sitl_mock.config.rate_loop import AxisGains, RateLoopConfig
from sitl_mock.physics.quaternion import Vector

AxisState = tuple[float, float]
"""State of one axis, N m: integral, and filtered torque, which is the output."""
AxisStates = tuple[AxisState, AxisState, AxisState]
"""States of roll, pitch and yaw."""
ZERO_STATE: AxisStates = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
"""State of a rate loop that does not run: no integral and no torque."""
Delays = tuple[int, int, int]
"""Delays of roll, pitch and yaw, steps."""
Ring = list[Vector]
"""The latest setpoints in a ring buffer; an array if the steps are compiled."""


class AxisConstants(NamedTuple):
    """Constants of the rate controller of one axis."""

    proportional: float  # N m per rad/s
    integral: float  # N m per rad
    feed_forward: float  # N m per rad/s
    damping: float  # N m per rad/s^2
    integral_limit: float  # N m
    filter_decay: float  # of the torque filter per step, 0 = no filter


def axis_constants(gains: AxisGains, dt: float) -> AxisConstants:
    """Return the constants of one axis's rate controller for steps of `dt` seconds."""
    filter_s = gains.torque_filter_ms * 1e-3
    return AxisConstants(
        gains.proportional_n_m_s,
        gains.integral_n_m,
        gains.feed_forward_n_m_s,
        gains.damping_n_m_s2,
        gains.integral_limit_n_m,
        exp(-dt / filter_s) if filter_s > 0.0 else 0.0,
    )


def axis_step(
    constants: AxisConstants,
    state: AxisState,
    setpoint: float,
    rate: float,
    acceleration: float,
    saturated: bool,
    dt: float,
) -> AxisState:
    """Return the state of one axis after a step (pure).

    Args:
        constants: constants of the axis.
        state: state before the step.
        setpoint: setpoint of the body rate, rad/s.
        rate: present body rate, rad/s.
        acceleration: present angular acceleration, rad/s^2.
        saturated: whether the rotors could not give the last torque; the integral must then not
            grow further in the direction of that torque.
        dt: step, s.
    """
    proportional, integral_gain, feed_forward, damping, limit, filter_decay = constants
    integral, torque = state
    error = setpoint - rate
    if not (saturated and error * torque > 0.0):
        integral += integral_gain * error * dt
        integral = limit if integral > limit else -limit if integral < -limit else integral
    unfiltered_torque = (
        proportional * error + integral + feed_forward * setpoint - damping * acceleration
    )
    return integral, unfiltered_torque + filter_decay * (torque - unfiltered_torque)


class RateConstants(NamedTuple):
    """Constants of the rate controller."""

    roll: AxisConstants
    pitch: AxisConstants
    yaw: AxisConstants
    delays: Delays
    dt: float  # step, s


def rate_constants(config: RateLoopConfig, dt: float) -> RateConstants:
    """Return the constants of the rate controller for steps of `dt` seconds."""
    roll, pitch, yaw = config.roll, config.pitch, config.yaw
    delays_ms = (roll.setpoint_delay_ms, pitch.setpoint_delay_ms, yaw.setpoint_delay_ms)
    return RateConstants(
        axis_constants(roll, dt),
        axis_constants(pitch, dt),
        axis_constants(yaw, dt),
        delay_steps(delays_ms, dt),
        dt,
    )


def rate_step(
    constants: RateConstants,
    axes: AxisStates,
    setpoint: Vector,
    rates: Vector,
    accelerations: Vector,
    tilt_saturated: bool,
    yaw_saturated: bool,
) -> AxisStates:
    """Return the state of the three axes after a step; the torques are their outputs (pure).

    A NaN or infinite setpoint holds the present rate, as measured on PX4: the error is zero, and a
    rolling vehicle continues to roll. Setpoints are not limited.

    Args:
        constants: constants of the three axes.
        axes: states of the axes before the step.
        setpoint: body rates, rad/s, FRD, already delayed.
        rates: present body rates, rad/s.
        accelerations: present angular accelerations, rad/s^2.
        tilt_saturated: whether the rotors could not give the last torque about x and y.
        yaw_saturated: whether the rotors could not give the last torque about z.
    """
    roll, pitch, yaw = setpoint
    p, q, r = rates
    p_dot, q_dot, r_dot = accelerations
    x, y, z = axes
    x_constants, y_constants, z_constants, _, dt = constants
    return (
        axis_step(x_constants, x, roll if isfinite(roll) else p, p, p_dot, tilt_saturated, dt),
        axis_step(y_constants, y, pitch if isfinite(pitch) else q, q, q_dot, tilt_saturated, dt),
        axis_step(z_constants, z, yaw if isfinite(yaw) else r, r, r_dot, yaw_saturated, dt),
    )


def delay_steps(delays_ms: Vector, dt: float) -> Delays:
    """Return the delays of roll, pitch and yaw setpoints, rounded to whole steps of `dt` s."""
    roll, pitch, yaw = (round(delay_ms * 1e-3 / dt) for delay_ms in delays_ms)
    return roll, pitch, yaw


def delay_setpoint(ring: Ring, delays: Delays, step: int, setpoint: Vector) -> Vector:
    """Store the setpoint of a step in the ring; return the delayed setpoint.

    Args:
        ring: the latest setpoints, longer than any delay; changed in place.
        delays: delays of roll, pitch and yaw, steps.
        step: number of the step, one more with each call.
        setpoint: body rates, rad/s.
    """
    length = len(ring)
    ring[step % length] = setpoint
    roll, pitch, yaw = delays
    return (
        ring[(step - roll) % length][0],
        ring[(step - pitch) % length][1],
        ring[(step - yaw) % length][2],
    )
