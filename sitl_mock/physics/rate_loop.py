"""The autopilot's body-rate controller: PI with feed-forward and damping on each axis."""

from collections import deque
from math import exp, isfinite
from typing import NamedTuple

from sitl_mock.config.rate_loop import AxisGains, RateLoopConfig
from sitl_mock.physics.quaternion import Vector

AxisState = tuple[float, float]
"""State of one axis, N m: its integral, and its filtered torque, which is the output."""
AT_REST: AxisState = (0.0, 0.0)


class AxisLaw(NamedTuple):
    """Constants of the control law of one axis."""

    proportional: float  # N m per rad/s
    integral: float  # N m per rad
    feed_forward: float  # N m per rad/s
    damping: float  # N m per rad/s^2
    integral_limit: float  # N m
    filter_decay: float  # of the torque filter per step, 0 = no filter


def axis_law(gains: AxisGains, dt: float) -> AxisLaw:
    """Return the control law of one axis for steps of `dt` seconds."""
    filter_s = gains.torque_filter_ms * 1e-3
    return AxisLaw(
        gains.proportional_n_m_s,
        gains.integral_n_m,
        gains.feed_forward_n_m_s,
        gains.damping_n_m_s2,
        gains.integral_limit_n_m,
        exp(-dt / filter_s) if filter_s > 0.0 else 0.0,
    )


def axis_step(
    law: AxisLaw,
    state: AxisState,
    setpoint: float,
    rate: float,
    acceleration: float,
    saturated: bool,
    dt: float,
) -> AxisState:
    """Return the state of one axis after a step (pure).

    Args:
        law: the axis's constants.
        state: before the step.
        setpoint: of the body rate, rad/s.
        rate: present body rate, rad/s.
        acceleration: present angular acceleration, rad/s^2.
        saturated: the rotors could not give the last torque; the integral must not grow then.
        dt: step, s.
    """
    proportional, integral_gain, feed_forward, damping, limit, memory = law
    integral, filtered = state
    error = setpoint - rate
    if not (saturated and error * filtered > 0.0):
        integral += integral_gain * error * dt
        integral = limit if integral > limit else -limit if integral < -limit else integral
    wanted = proportional * error + integral + feed_forward * setpoint - damping * acceleration
    return integral, wanted + memory * (filtered - wanted)


class RateLoop:
    """The rate controller of the three axes, with the transport delay of their setpoints.

    A NaN or infinite setpoint holds the present rate, as measured on PX4: the error is zero, and a
    rolling vehicle continues to roll. Setpoints are not limited.
    """

    __slots__ = ("_axes", "_delay", "_dt", "_laws")

    def __init__(self, config: RateLoopConfig, dt: float) -> None:
        self._dt = dt
        gains = (config.roll, config.pitch, config.yaw)
        self._laws = tuple(axis_law(axis, dt) for axis in gains)
        roll, pitch, yaw = (axis.setpoint_delay_ms for axis in gains)
        self._delay = SetpointDelay((roll, pitch, yaw), dt)
        self._axes = (AT_REST, AT_REST, AT_REST)

    def step(
        self,
        setpoint: Vector,
        rates: Vector,
        accelerations: Vector,
        *,
        tilt_saturated: bool,
        yaw_saturated: bool,
    ) -> Vector:
        """Return the torques about body x, y, z in N m for this step."""
        roll, pitch, yaw = self._delay.step(setpoint)
        p, q, r = rates
        p_dot, q_dot, r_dot = accelerations
        x_law, y_law, z_law = self._laws
        x, y, z = self._axes
        dt = self._dt
        x = axis_step(x_law, x, roll if isfinite(roll) else p, p, p_dot, tilt_saturated, dt)
        y = axis_step(y_law, y, pitch if isfinite(pitch) else q, q, q_dot, tilt_saturated, dt)
        z = axis_step(z_law, z, yaw if isfinite(yaw) else r, r, r_dot, yaw_saturated, dt)
        self._axes = (x, y, z)
        return x[1], y[1], z[1]

    def idle(self, setpoint: Vector) -> None:
        """Run a step without control (disarmed, or on the ground): reset, but delay setpoints."""
        self._delay.step(setpoint)
        self._axes = (AT_REST, AT_REST, AT_REST)


class SetpointDelay:
    """Delays setpoints by a whole number of steps; before the first one it returns zero.

    Args:
        delays_ms: of roll, pitch and yaw; rounded to whole steps.
        dt: step, s.
    """

    __slots__ = ("_given", "_pitch", "_roll", "_yaw")

    def __init__(self, delays_ms: Vector, dt: float) -> None:
        # Counted from the newest setpoint, which is at -1.
        self._roll, self._pitch, self._yaw = (
            -1 - round(delay_ms * 1e-3 / dt) for delay_ms in delays_ms
        )
        length = -min(self._roll, self._pitch, self._yaw)
        self._given: deque[Vector] = deque([(0.0, 0.0, 0.0)] * length, maxlen=length)

    def step(self, setpoint: Vector) -> Vector:
        """Accept the setpoint of this step; return the delayed one."""
        given = self._given
        given.append(setpoint)
        return given[self._roll][0], given[self._pitch][1], given[self._yaw][2]
