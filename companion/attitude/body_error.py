"""`quaternion` and `so3`: the paper's section 4.2, a rate along the error the body sees.

The paper writes the error q_d ⊗ q⁻¹; only q⁻¹ ⊗ q_d, in the body frame, makes its claim true that
the response is the same at every heading. One gain serves all three axes, as there.
"""

from math import sqrt

from companion.attitude.limits import Constants
from companion.attitude.rotation import angle_per_sine, attitude_of, body_error, limit_rates
from companion.attitude.types import Quaternion, Target


def quaternion(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates ω = 2p·vec(q⁻¹ ⊗ q_d), the short way round."""
    north, east, heading, heading_rate = target
    error = body_error(q, attitude_of(north, east, heading))
    return _along(error, 2.0 * constants.gain, heading_rate, constants)


def so3(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates ω = p·Log(q⁻¹ ⊗ q_d)."""
    north, east, heading, heading_rate = target
    error = body_error(q, attitude_of(north, east, heading))
    w, x, y, z = error
    scale = constants.gain * angle_per_sine(w, sqrt(x * x + y * y + z * z))
    return _along(error, scale, heading_rate, constants)


def _along(
    error: Quaternion, scale: float, heading_rate: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates of `scale` times the vector part of the error, within the limits."""
    _, x, y, z = error
    return limit_rates(
        scale * x,
        scale * y,
        scale * z + heading_rate,
        constants.max_tilt_rate,
        constants.max_yaw_rate,
    )
