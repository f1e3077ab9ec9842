"""`quaternion` and `so3`: the paper's section 4.2, a rate along the error the body sees.

The paper writes the error q_d ⊗ q⁻¹; only q⁻¹ ⊗ q_d, in the body frame, makes its claim true that
the response is the same at every heading. One gain serves all three axes, as there.
"""

from math import sqrt

from companion.attitude.constants import Constants
from companion.attitude.rotation import angle_per_sine, attitude_of, body_error, within_limits
from companion.attitude.types import Quaternion, Target


def quaternion(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates ω = 2p·vec(q⁻¹ ⊗ q_d), the short way round."""
    gain = constants.gain
    north, east, heading, heading_rate = target
    _, e_x, e_y, e_z = body_error(q, attitude_of(north, east, heading))
    scale = 2.0 * gain
    return within_limits(
        scale * e_x,
        scale * e_y,
        scale * e_z + heading_rate,
        constants.max_tilt_rate,
        constants.max_yaw_rate,
    )


def so3(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates ω = p·Log(q⁻¹ ⊗ q_d)."""
    gain = constants.gain
    north, east, heading, heading_rate = target
    e_w, e_x, e_y, e_z = body_error(q, attitude_of(north, east, heading))
    scale = gain * angle_per_sine(e_w, sqrt(e_x * e_x + e_y * e_y + e_z * e_z))
    return within_limits(
        scale * e_x,
        scale * e_y,
        scale * e_z + heading_rate,
        constants.max_tilt_rate,
        constants.max_yaw_rate,
    )
