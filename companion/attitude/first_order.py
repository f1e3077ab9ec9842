"""`first-order`: Algorithm 1 of the paper, made safe over the whole sphere of attitudes."""

from math import sqrt

from companion.attitude.kinematics import (
    SMALLEST_A,
    heading_of,
    levelling_rates,
    share_of_law,
    speed_to_rates,
    tilt_products,
)
from companion.attitude.limits import Constants
from companion.attitude.rotation import clamp, wrap_difference
from companion.attitude.types import Quaternion, Target


def first_order(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """Body rates, rad/s, under which the acceleration coefficients follow ċ = p·(c_d − c).

    The coefficients move on a straight line to the target, at the same speed at every heading. The
    limits on the tilt rate and on the speed of the coefficients (equation 33) scale roll and pitch
    together, so the line stays straight. Beyond the recovery angle the law fades into a rotation
    towards level without control of the heading, which is undefined upside down.
    """
    gain, yaw_gain, _, max_yaw_rate, _, rate_weight, speed_weight, _, cos_low, slope = constants
    w, x, y, z = q
    north, east, heading, heading_rate = target
    square, ax, ay = tilt_products(w, x, y, z)
    cosine = 2.0 * square - 1.0
    share = 1.0
    if cosine < cos_low:
        share = share_of_law(cosine, cos_low, slope)
        cosine = cos_low
        square = max(square, SMALLEST_A * SMALLEST_A)
    a = sqrt(square)
    both = 1.0 / (square * cosine)  # one division instead of two: divisions cost a batch the most
    inverse = both * cosine
    faded = share * gain
    e_x = faded * (east - 2.0 * ax)
    e_y = -faded * (north + 2.0 * ay)
    roll, pitch, still = speed_to_rates(w, z, ax, ay, inverse, both * square, e_x, e_y)
    if share < 1.0:
        up_roll, up_pitch = levelling_rates(gain, a, inverse, w, x, y, z)
        roll += (1.0 - share) * up_roll
        pitch += (1.0 - share) * up_pitch
    excess = rate_weight * (roll * roll + pitch * pitch)
    if speed_weight > 0.0:
        too_fast = speed_weight * (e_x * e_x + e_y * e_y)
        excess = max(excess, too_fast)
    if excess > 1.0:
        scale = 1.0 / sqrt(excess)
        roll *= scale
        pitch *= scale
        still *= scale
    error = wrap_difference(heading - heading_of(a, w, z))
    yaw = share * (yaw_gain * error + heading_rate) + still
    return roll, pitch, clamp(yaw, max_yaw_rate)
