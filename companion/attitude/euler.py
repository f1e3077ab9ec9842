"""`euler`: the Euler-angle controller of the paper's section 4.2 (sequence Z-Y-X)."""

from math import cos, sin

from companion.attitude.limits import Constants
from companion.attitude.rotation import attitude_of, euler_angles, limit_rates, wrap_difference
from companion.attitude.types import Quaternion, Target


def euler(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates p·M(φ, θ)·(wrapped angle errors), rad/s; the response depends on the heading."""
    gain = constants.gain
    north, east, heading, heading_rate = target
    roll, pitch, yaw = euler_angles(q)
    roll_d, pitch_d, yaw_d = euler_angles(attitude_of(north, east, heading))
    e_roll = gain * wrap_difference(roll_d - roll)
    e_pitch = gain * wrap_difference(pitch_d - pitch)
    e_yaw = gain * wrap_difference(yaw_d - yaw)
    turning = e_yaw * cos(pitch)
    return limit_rates(
        e_roll - e_yaw * sin(pitch),
        e_pitch * cos(roll) + turning * sin(roll),
        turning * cos(roll) - e_pitch * sin(roll) + heading_rate,
        constants.max_tilt_rate,
        constants.max_yaw_rate,
    )
