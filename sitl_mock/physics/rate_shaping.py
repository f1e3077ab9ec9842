"""ArduPilot's shaping of body-rate setpoints.

It limits the angular acceleration and integrates the rates to an attitude target. An attitude
controller follows the target; its output is the setpoint of the rate loop.
"""

from math import atan2, copysign, inf, isnan, sqrt
from typing import NamedTuple

from sitl_mock.config.rate_loop import AxisShaping
from sitl_mock.physics.quaternion import Quaternion, Vector, multiply, normalise, to_body
from sitl_mock.physics.rate_loop import SetpointDelay

AT_REST: Vector = (0.0, 0.0, 0.0)


class Shaped(NamedTuple):
    """State of the shaping."""

    rates: Vector
    """Shaped rates along the axes of the attitude target, rad/s."""
    target: Quaternion
    """Attitude target, body to world."""


def slew(goal: float, rate: float, most: float) -> float:
    """Return the rate changed towards its goal by at most `most`.

    A NaN goal holds the rate. With an infinite goal the rate grows without limit, as measured on
    ArduPilot.
    """
    if isnan(goal):
        return rate
    change = goal - rate
    return rate + (most if change > most else -most if change < -most else change)


def rotated(q: Quaternion, rates: Vector, dt: float) -> Quaternion:
    """Return the attitude after `dt` s of body rates (rad/s); its error is (rate dt)^3 / 12."""
    half = 0.5 * dt
    return normalise(multiply(q, (1.0, half * rates[0], half * rates[1], half * rates[2])))


def rotation_vector(q: Quaternion) -> Vector:
    """Return the rotation vector of a unit quaternion, rad, along the shorter rotation."""
    w, x, y, z = q if q[0] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
    sine = sqrt(x * x + y * y + z * z)
    scale = 2.0 * atan2(sine, w) / sine if sine > 0.0 else 2.0
    return scale * x, scale * y, scale * z


def sqrt_controller(angle: float, gain: float, acceleration: float) -> float:
    """Return the rate that closes an angle, as ArduPilot's sqrt_controller does.

    Small angles: proportional. Larger ones: the rate from which `acceleration` stops in time.

    Args:
        angle: to close, rad.
        gain: rate per angle, 1/s.
        acceleration: limit, rad/s^2.
    """
    linear = acceleration / (gain * gain) if gain > 0.0 else inf
    if abs(angle) <= linear:
        return gain * angle
    return copysign(sqrt(2.0 * acceleration * (abs(angle) - 0.5 * linear)), angle)


class RateShaping:
    """Shapes the rates of the three axes, which share one attitude target.

    Args:
        axes: settings of roll, pitch and yaw.
        dt: step, s.
    """

    __slots__ = ("_closing", "_delay", "_dt", "_most", "_shaped")

    def __init__(self, axes: tuple[AxisShaping, AxisShaping, AxisShaping], dt: float) -> None:
        self._dt = dt
        self._most = tuple(axis.acceleration_limit_rad_s2 * dt for axis in axes)
        self._closing = tuple(
            (axis.attitude_gain_1_s, 0.5 * axis.acceleration_limit_rad_s2) for axis in axes
        )
        roll, pitch, yaw = axes
        self._delay = SetpointDelay((roll.delay_ms, pitch.delay_ms, yaw.delay_ms), dt)
        self._shaped: Shaped | None = None

    @property
    def shaped(self) -> Shaped | None:
        """The attitude target after the latest step; None while the rate loop idles."""
        return self._shaped

    def step(self, setpoint: Vector, q: Quaternion) -> Vector:
        """Return the setpoint of the rate loop, rad/s, FRD.

        Args:
            setpoint: body rates, rad/s; NaN holds the shaped rate, infinity grows without limit.
            q: present attitude; the attitude target starts there.
        """
        goals = self._delay.step(setpoint)
        rates, target = self._shaped or Shaped(AT_REST, q)
        most = self._most
        rates = (
            slew(goals[0], rates[0], most[0]),
            slew(goals[1], rates[1], most[1]),
            slew(goals[2], rates[2], most[2]),
        )
        target = rotated(target, rates, self._dt)
        self._shaped = Shaped(rates, target)
        w, x, y, z = target
        ahead = multiply((w, -x, -y, -z), q)  # the body in the frame of the attitude target
        turn_x, turn_y, turn_z = rotation_vector(ahead)
        roll, pitch, yaw = to_body(ahead, rates)
        for_roll, for_pitch, for_yaw = self._closing
        return (
            roll - sqrt_controller(turn_x, *for_roll),
            pitch - sqrt_controller(turn_y, *for_pitch),
            yaw - sqrt_controller(turn_z, *for_yaw),
        )

    def idle(self, setpoint: Vector) -> None:
        """Run a step without control: clear the attitude target, but delay setpoints."""
        self._delay.step(setpoint)
        self._shaped = None
