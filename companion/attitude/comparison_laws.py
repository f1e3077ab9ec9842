"""The laws with which the paper compares its own, section 4.2: `quaternion`, `so3` and `euler`.

The paper claims that `quaternion` and `so3` respond in the same way at every heading. This is true
for the attitude error in the body frame, q⁻¹ ⊗ q_d, used here, and not for the paper's q_d ⊗ q⁻¹.
As in the paper, one gain serves all three axes.
"""

from math import cos, sin, sqrt

from companion.attitude.limits import Constants
from companion.attitude.rotation import (
    angle_per_sine,
    attitude_of,
    body_error,
    euler_angles,
    limit_rates,
    wrap_difference,
)
from companion.attitude.types import Quaternion, Target


def quaternion(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates ω = 2p·vec(q⁻¹ ⊗ q_d), rad/s, along the shorter rotation to the target."""
    north, east, heading, heading_rate = target
    error = body_error(q, attitude_of(north, east, heading))
    return _scaled_rates(error, 2.0 * constants.gain, heading_rate, constants)


def so3(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates ω = p·Log(q⁻¹ ⊗ q_d), rad/s, along the shorter rotation to the target."""
    north, east, heading, heading_rate = target
    error = body_error(q, attitude_of(north, east, heading))
    w, x, y, z = error
    scale = constants.gain * angle_per_sine(w, sqrt(x * x + y * y + z * z))
    return _scaled_rates(error, scale, heading_rate, constants)


def _scaled_rates(
    error: Quaternion, scale: float, heading_rate: float, constants: Constants
) -> tuple[float, float, float]:
    """Limited body rates, rad/s: `scale` times the vector part of `error`, and the heading rate."""
    _, x, y, z = error
    return limit_rates(
        scale * x,
        scale * y,
        scale * z + heading_rate,
        constants.max_tilt_rate,
        constants.max_yaw_rate,
    )


def euler(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates p·M(φ, θ)·(wrapped errors of the Z-Y-X Euler angles), rad/s.

    The matrix M converts derivatives of the Euler angles to body rates. The response depends on the
    heading.
    """
    gain = constants.gain
    north, east, heading, heading_rate = target
    roll, pitch, yaw = euler_angles(q)
    roll_d, pitch_d, yaw_d = euler_angles(attitude_of(north, east, heading))
    e_roll = gain * wrap_difference(roll_d - roll)
    e_pitch = gain * wrap_difference(pitch_d - pitch)
    e_yaw = gain * wrap_difference(yaw_d - yaw)
    yz_rate = e_yaw * cos(pitch)
    return limit_rates(
        e_roll - e_yaw * sin(pitch),
        e_pitch * cos(roll) + yz_rate * sin(roll),
        yz_rate * cos(roll) - e_pitch * sin(roll) + heading_rate,
        constants.max_tilt_rate,
        constants.max_yaw_rate,
    )
