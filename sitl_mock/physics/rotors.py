"""Four rotors in an X: allocation of thrust and torque, thrust curve, lag (pure).

Rotor order and spin are PX4's: front right and rear left counter-clockwise, front left and rear
right clockwise.
"""

from math import exp
from typing import NamedTuple

from sitl_mock.config.airframe import AirframeConfig

FourFloats = tuple[float, float, float, float]
"""One number for each rotor, or thrust and torques about body x, y, z."""


class Allocation(NamedTuple):
    """Result of the allocation: throttles 0..1, and which torques saturated."""

    throttles: FourFloats
    tilt_saturated: bool
    yaw_saturated: bool


STOPPED_ALLOCATION = Allocation((0.0, 0.0, 0.0, 0.0), tilt_saturated=True, yaw_saturated=True)
"""Result of the allocation while the rotors are off and give no torque."""


def allocate(throttle: float, roll: float, pitch: float, yaw: float) -> Allocation:
    """Allocate rotor throttles with PX4's priorities: roll and pitch, thrust, yaw.

    Saturation reduces thrust but never increases it (no airmode): at throttle 0 no rotor turns.

    Args:
        throttle: collective throttle, not negative; values above 1 mean 1.
        roll: part of each rotor's throttle that gives the torque about body x.
        pitch: the same for body y.
        yaw: the same for body z.
    """
    demand = abs(roll) + abs(pitch)
    headroom = throttle if throttle < 0.5 else 0.5
    tilt_saturated = demand > headroom
    if tilt_saturated:
        scale = headroom / demand
        roll *= scale
        pitch *= scale
        demand = headroom
    remaining = 1.0 - demand
    throttle = remaining if remaining < throttle else throttle
    # One diagonal has pitch - roll and +yaw, the other pitch + roll and -yaw.
    largest_rise, largest_fall = abs(pitch - roll), abs(pitch + roll)
    if yaw < 0.0:
        largest_rise, largest_fall = largest_fall, largest_rise
    headroom_above, headroom_below = 1.0 - throttle - largest_rise, throttle - largest_fall
    headroom = headroom_below if headroom_below < headroom_above else headroom_above
    yaw_saturated = abs(yaw) > headroom
    if yaw_saturated:
        headroom = max(headroom, 0.0)
        yaw = headroom if yaw > 0.0 else -headroom
    return Allocation(
        (
            throttle - roll + pitch + yaw,
            throttle + roll - pitch + yaw,
            throttle + roll + pitch - yaw,
            throttle - roll - pitch - yaw,
        ),
        tilt_saturated,
        yaw_saturated,
    )


class RotorConstants(NamedTuple):
    """Constants of the rotors. A rotor's thrust follows its throttle with a first-order lag."""

    slope: float  # N of one rotor per throttle, from `linear_from` on
    offset: float  # N, thrust of this line at throttle 0
    low_slope: float  # N per throttle, below `linear_from`
    linear_from: float  # throttle
    decay: float  # factor of the lag in one step
    arm: float  # lever of a rotor about body x and y, m
    drag_ratio: float  # torque about body z per thrust, m


def rotor_constants(airframe: AirframeConfig, dt: float) -> RotorConstants:
    """Return the constants of an airframe's rotors for steps of `dt` seconds."""
    mass_per_rotor = airframe.mass_kg / 4.0
    slope = airframe.thrust_slope_m_s2 * mass_per_rotor
    offset = airframe.thrust_offset_m_s2 * mass_per_rotor
    return RotorConstants(
        slope,
        offset,
        slope + offset / airframe.thrust_linear_from,
        airframe.thrust_linear_from,
        exp(-dt / (airframe.rotor_lag_ms * 1e-3)),
        airframe.rotor_arm_m,
        airframe.rotor_drag_ratio_m,
    )


def steady_thrust(constants: RotorConstants, throttle: float) -> float:
    """Return the steady thrust of one rotor in N, with a full battery."""
    if throttle >= constants.linear_from:
        return constants.slope * throttle + constants.offset
    return constants.low_slope * throttle


def throttle_of(constants: RotorConstants, thrust: float) -> float:
    """Return the throttle for a steady thrust (N) of one rotor, at most 1."""
    if thrust >= steady_thrust(constants, constants.linear_from):
        return min((thrust - constants.offset) / constants.slope, 1.0)
    return thrust / constants.low_slope


def rotor_step(
    constants: RotorConstants, thrusts: FourFloats, throttles: FourFloats, thrust_factor: float
) -> tuple[FourFloats, FourFloats]:
    """Advance the rotors by one step towards the throttles.

    The discretisation is exact for a throttle that is constant over the step. The mean of the
    thrusts before and after the step is accurate to second order.

    Args:
        constants: constants of the rotors.
        thrusts: thrust of each rotor before the step, N.
        throttles: throttle of each rotor, 0..1.
        thrust_factor: factor of the battery voltage on the thrust of every rotor.

    Returns:
        The thrusts after the step; and the means over the step of total thrust (N) and of the
        torques about body x, y, z (N m).
    """
    t0, t1, t2, t3 = throttles
    old0, old1, old2, old3 = thrusts
    decay = constants.decay
    steady = thrust_factor * steady_thrust(constants, t0)
    new0 = steady + decay * (old0 - steady)
    steady = thrust_factor * steady_thrust(constants, t1)
    new1 = steady + decay * (old1 - steady)
    steady = thrust_factor * steady_thrust(constants, t2)
    new2 = steady + decay * (old2 - steady)
    steady = thrust_factor * steady_thrust(constants, t3)
    new3 = steady + decay * (old3 - steady)
    f0 = 0.5 * (old0 + new0)
    f1 = 0.5 * (old1 + new1)
    f2 = 0.5 * (old2 + new2)
    f3 = 0.5 * (old3 + new3)
    wrench = (
        f0 + f1 + f2 + f3,
        constants.arm * (f1 + f2 - f0 - f3),
        constants.arm * (f0 + f2 - f1 - f3),
        constants.drag_ratio * (f0 + f1 - f2 - f3),
    )
    return (new0, new1, new2, new3), wrench
