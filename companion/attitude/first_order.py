"""`first-order`: Algorithm 1 of the paper, made safe over the whole sphere of attitudes."""

from math import sqrt

from companion.attitude.kinematics import (
    SMALLEST_A,
    half_tilt_products,
    heading_of,
    law_weight,
    levelling_rates,
    speed_to_rates,
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
    gain, yaw_gain, _, max_yaw_rate, _, rate_weight, speed_weight, _, cos_recovery, law_slope = (
        constants
    )
    w, x, y, z = q
    north, east, heading, heading_rate = target
    a_squared, ax, ay = half_tilt_products(w, x, y, z)
    cosine = 2.0 * a_squared - 1.0
    weight = 1.0
    if cosine < cos_recovery:
        weight = law_weight(cosine, cos_recovery, law_slope)
        cosine = cos_recovery
        a_squared = max(a_squared, SMALLEST_A * SMALLEST_A)
    a = sqrt(a_squared)
    # One division instead of two: divisions take the most time in a batch.
    inverse_product = 1.0 / (a_squared * cosine)
    inverse_a_squared = inverse_product * cosine
    weighted_gain = weight * gain
    e_x = weighted_gain * (east - 2.0 * ax)
    e_y = -weighted_gain * (north + 2.0 * ay)
    roll, pitch, heading_hold_rate = speed_to_rates(
        w, z, ax, ay, inverse_a_squared, inverse_product * a_squared, e_x, e_y
    )
    if weight < 1.0:
        level_roll, level_pitch = levelling_rates(gain, a, inverse_a_squared, w, x, y, z)
        roll += (1.0 - weight) * level_roll
        pitch += (1.0 - weight) * level_pitch
    excess = rate_weight * (roll * roll + pitch * pitch)
    if speed_weight > 0.0:
        excess = max(excess, speed_weight * (e_x * e_x + e_y * e_y))
    if excess > 1.0:
        scale = 1.0 / sqrt(excess)
        roll *= scale
        pitch *= scale
        heading_hold_rate *= scale
    heading_error = wrap_difference(heading - heading_of(a, w, z))
    yaw = weight * (yaw_gain * heading_error + heading_rate) + heading_hold_rate
    return roll, pitch, clamp(yaw, max_yaw_rate)
