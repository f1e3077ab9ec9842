"""`quaternion` and `so3`: the paper's section 4.2 with the attitude error in the body frame.

The paper claims the same response at every heading. This holds for the error q⁻¹ ⊗ q_d, used here,
and not for the paper's q_d ⊗ q⁻¹. As in the paper, one gain serves all three axes.
"""

from math import sqrt

from companion.attitude.limits import Constants
from companion.attitude.rotation import angle_per_sine, attitude_of, body_error, limit_rates
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
    """`scale` times the vector part of the error as body rates, rad/s, within the limits."""
    _, x, y, z = error
    return limit_rates(
        scale * x,
        scale * y,
        scale * z + heading_rate,
        constants.max_tilt_rate,
        constants.max_yaw_rate,
    )
