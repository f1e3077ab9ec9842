"""The quaternion method read to the letter, to show what the printed error would do."""

from companion.attitude import Quaternion, Target, body_error
from companion.attitude.constants import Constants


def quaternion(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """ω = 2p·vec(q_d ⊗ q⁻¹): the body-frame error turned into the world frame, used as body rates.

    For vec(q_d ⊗ q⁻¹) = q ⊗ vec(q⁻¹ ⊗ q_d) ⊗ q⁻¹.
    """
    w, x, y, z = q
    i, j, k = body_error.quaternion(q, target, dt, constants)
    t_x, t_y, t_z = 2.0 * (y * k - z * j), 2.0 * (z * i - x * k), 2.0 * (x * j - y * i)
    return (
        i + w * t_x + y * t_z - z * t_y,
        j + w * t_y + z * t_x - x * t_z,
        k + w * t_z + x * t_y - y * t_x,
    )
