"""A planner in a separate package: `planner: {name: thrust-axis}` flies it.

The planner rotates the thrust axis the shortest way to the target; it does not control the heading.
"""

from math import sqrt

from companion.attitude import Constants, Quaternion, Target, limit_rates


def thrust_axis(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates (rad/s, FRD) in proportion to the error of the thrust axis, seen from the body."""
    (w, x, y, z), (n, e, _, _) = q, target
    d = -sqrt(1.0 - n * n - e * e)  # (n, e, d) is the wanted axis in NED, a unit vector
    forward = (1 - 2 * (y * y + z * z)) * n + 2 * (x * y + w * z) * e + 2 * (x * z - w * y) * d
    right = 2 * (x * y - w * z) * n + (1 - 2 * (x * x + z * z)) * e + 2 * (y * z + w * x) * d
    roll, pitch = constants.gain * right, -constants.gain * forward
    return limit_rates(roll, pitch, 0.0, constants.max_tilt_rate, constants.max_yaw_rate)
