"""Four rotors in an X: allocation of thrust and torque, thrust curve, lag.

Rotor order and spin are PX4's: front right and rear left counter-clockwise, front left and rear
right clockwise.
"""

from math import exp
from typing import NamedTuple

from sitl_mock.config.airframe import AirframeConfig

Four = tuple[float, float, float, float]


class Mix(NamedTuple):
    """Result of the allocation: throttles 0..1, and which torques saturated."""

    throttles: Four
    tilt_saturated: bool
    yaw_saturated: bool


STOPPED = Mix((0.0, 0.0, 0.0, 0.0), tilt_saturated=True, yaw_saturated=True)
"""Rotors off: they give no torque."""


def mix(throttle: float, roll: float, pitch: float, yaw: float) -> Mix:
    """Allocate rotor throttles with PX4's priorities: roll and pitch, thrust, yaw.

    Saturation reduces thrust but never increases it (no airmode): at throttle 0 no rotor turns.

    Args:
        throttle: collective, not negative; values above 1 mean 1.
        roll: throttle difference about body x.
        pitch: throttle difference about body y.
        yaw: throttle difference about body z.
    """
    demand = abs(roll) + abs(pitch)
    room = throttle if throttle < 0.5 else 0.5
    tilt_saturated = demand > room
    if tilt_saturated:
        scale = room / demand
        roll *= scale
        pitch *= scale
        demand = room
    rest = 1.0 - demand
    throttle = rest if rest < throttle else throttle
    # One diagonal has pitch - roll and +yaw, the other pitch + roll and -yaw.
    counter, clockwise = abs(pitch - roll), abs(pitch + roll)
    if yaw < 0.0:
        counter, clockwise = clockwise, counter
    above, below = 1.0 - throttle - counter, throttle - clockwise
    room = below if below < above else above
    yaw_saturated = abs(yaw) > room
    if yaw_saturated:
        room = max(room, 0.0)
        yaw = room if yaw > 0.0 else -room
    return Mix(
        (
            throttle - roll + pitch + yaw,
            throttle + roll - pitch + yaw,
            throttle + roll + pitch - yaw,
            throttle - roll - pitch - yaw,
        ),
        tilt_saturated,
        yaw_saturated,
    )


class Rotors:
    """Thrust of the four rotors, each a first-order lag behind its throttle.

    The discretisation is exact for a throttle that is constant over the step. `step` returns the
    mean of the thrusts before and after it, which is accurate to second order.
    """

    __slots__ = ("_arm", "_decay", "_drag_ratio", "_linear", "_low", "_offset", "_slope", "thrusts")

    def __init__(self, airframe: AirframeConfig, dt: float) -> None:
        per_rotor = airframe.mass_kg / 4.0
        self._slope = airframe.thrust_slope_m_s2 * per_rotor
        self._offset = airframe.thrust_offset_m_s2 * per_rotor
        self._linear = airframe.thrust_linear_from
        self._low = self._slope + self._offset / self._linear
        self._decay = exp(-dt / (airframe.rotor_lag_ms * 1e-3))
        self._arm = airframe.rotor_arm_m
        self._drag_ratio = airframe.rotor_drag_ratio_m
        self.thrusts: Four = (0.0, 0.0, 0.0, 0.0)
        """Present thrust of each rotor, N."""

    def steady(self, throttle: float) -> float:
        """Return the steady thrust of one rotor in N, with a full battery."""
        if throttle >= self._linear:
            return self._slope * throttle + self._offset
        return self._low * throttle

    def throttle(self, thrust: float) -> float:
        """Return the throttle for a steady thrust (N) of one rotor, at most 1."""
        if thrust >= self.steady(self._linear):
            return min((thrust - self._offset) / self._slope, 1.0)
        return thrust / self._low

    def step(self, throttles: Four, sag: float) -> Four:
        """Advance one step towards the throttles.

        Args:
            throttles: 0..1 each.
            sag: thrust factor of the battery voltage.

        Returns:
            Total thrust (N) and torques about body x, y, z (N m), means over the step.
        """
        t0, t1, t2, t3 = throttles
        old0, old1, old2, old3 = self.thrusts
        decay = self._decay
        steady = self.steady
        goal = sag * steady(t0)
        new0 = goal + decay * (old0 - goal)
        goal = sag * steady(t1)
        new1 = goal + decay * (old1 - goal)
        goal = sag * steady(t2)
        new2 = goal + decay * (old2 - goal)
        goal = sag * steady(t3)
        new3 = goal + decay * (old3 - goal)
        self.thrusts = (new0, new1, new2, new3)
        f0 = 0.5 * (old0 + new0)
        f1 = 0.5 * (old1 + new1)
        f2 = 0.5 * (old2 + new2)
        f3 = 0.5 * (old3 + new3)
        return (
            f0 + f1 + f2 + f3,
            self._arm * (f1 + f2 - f0 - f3),
            self._arm * (f0 + f2 - f1 - f3),
            self._drag_ratio * (f0 + f1 - f2 - f3),
        )
