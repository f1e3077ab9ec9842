"""Specific thrust (m/s²) for a wanted acceleration; thrust curve, and loss of thrust by voltage."""

from math import acos, hypot, isfinite, sqrt

from companion.attitude import BodyRates, Quaternion
from companion.attitude.rotation import down_in_body
from companion.guidance.reference import GRAVITY, Vector

TILT_THRUST_SHARE = 0.95
"""Largest share of the largest thrust that a commanded tilt may need; the rest is for gusts."""

_MIN_COSINE = 0.5
"""Cosine of the largest tilt (60°) up to which the thrust is raised with the tilt."""


def specific_thrust(acceleration_down: float, cos_tilt: float) -> float:
    """Specific thrust T = (g − a_D)/cos(tilt) that gives a vertical acceleration a_D, m/s².

    Beyond 60° of tilt the result decreases, to 0 at 90°: upside down, thrust would push the vehicle
    to the ground.
    """
    wanted = max(0.0, GRAVITY - acceleration_down)
    if cos_tilt < _MIN_COSINE:
        return wanted * max(0.0, cos_tilt) / (_MIN_COSINE * _MIN_COSINE)
    return wanted / cos_tilt


def predicted_cos_tilt(q: Quaternion, body_rates: BodyRates, lead_time: float) -> float:
    """Cosine of the tilt in `lead_time` s, if the vehicle keeps rotating at `body_rates`, rad/s.

    Thrust for this tilt instead of the present one compensates the lag of the rotors while the
    vehicle tilts, to first order (T + lag·Ṫ). Source: third row of Ṙ = R·[ω]ₓ.

    If the present tilt is below 60°, the predicted tilt is limited to 60°. A quick rotation seldom
    lasts as long as the lag, and `specific_thrust` reduces the thrust beyond 60°.
    """
    x, y, z = down_in_body(q)
    cosine = z + lead_time * (x * body_rates.pitch - y * body_rates.roll)
    return min(max(cosine, _MIN_COSINE if z > _MIN_COSINE else -1.0), 1.0)


def largest_tilt(lift: float, largest_thrust: float) -> float:
    """The tilt, rad, at which the lift needs `TILT_THRUST_SHARE` of the largest thrust.

    The tilt is 0 if the lift needs this share or more without tilt.

    Args:
        lift: upward component of the specific thrust, m/s².
        largest_thrust: largest specific thrust, m/s².
    """
    if lift >= TILT_THRUST_SHARE * largest_thrust:
        return 0.0
    return acos(max(lift, 0.0) / (TILT_THRUST_SHARE * largest_thrust))


def acceleration_within_thrust(wanted: Vector, smallest: float, largest: float) -> Vector:
    """Limit the acceleration to what the thrust gives, with priority for the height.

    If the thrust is too small, the horizontal part is shortened in its direction: the tilt shrinks
    and the height is kept. Tilt uses at most the share `TILT_THRUST_SHARE` of the largest thrust.
    The vertical part changes if it alone needs more than the largest thrust, or if `wanted` needs
    less than the smallest one, as in a fast descent.

    Args:
        wanted: acceleration NED, m/s².
        smallest: smallest specific thrust, m/s².
        largest: largest specific thrust, m/s².

    Returns:
        Acceleration NED, m/s².
    """
    north, east, down = wanted
    lift = min(max(GRAVITY - down, 0.0), largest)
    squared_horizontal_thrust = (TILT_THRUST_SHARE * largest) ** 2 - lift * lift
    length, limit = hypot(north, east), sqrt(max(squared_horizontal_thrust, 0.0))
    if length > limit:
        north, east, length = north * limit / length, east * limit / length, limit
    if lift * lift + length * length < smallest * smallest:
        lift = sqrt(smallest * smallest - length * length)
    return north, east, GRAVITY - lift


_VOLTAGE_FILTER_TIME = 0.3
"""Time constant of the voltage filter, s; ArduPilot's (MOT_BAT_V_MAX) has a cutoff of 0.5 Hz."""

_PLAUSIBLE_VOLTAGE_RATIO = 0.6, 1.2
"""Plausible range of V/V₀ (see `BatterySag`); a voltage outside it is ignored."""


class ThrustCurve:
    """Thrust curve of the motors: a signal u gives factor·u² + (1 − factor)·u of full thrust.

    PX4's THR_MDL_FAC and ArduPilot's MOT_THST_EXPO are this factor.

    Args:
        factor: 0 for a straight line up to 1 for a parabola.
    """

    def __init__(self, factor: float) -> None:
        self._factor = factor

    def share(self, signal: float) -> float:
        """The share of full thrust that a signal gives."""
        return signal * (1.0 + self._factor * (signal - 1.0))

    def signal(self, share: float) -> float:
        """The signal that gives a share of full thrust; the inverse of `share`."""
        factor = self._factor
        if factor == 0.0 or share <= 0.0:  # for a parabola the root at 0 would be 0/0
            return share
        linear = 1.0 - factor
        # The root of the quadratic in the form that stays exact for a small factor.
        return 2.0 * share / (linear + sqrt(linear * linear + 4.0 * factor * share))


class BatterySag:
    """Loss of thrust when the battery voltage falls: thrust is proportional to (V/V₀)^exponent.

    V₀ is the first voltage in the air, because the configured hover thrust is that of a vehicle
    whose battery is under load.

    Args:
        exponent: 2 for plain speed controllers, whose rotor speed follows the voltage; 0 if the
            autopilot or the speed controllers compensate the voltage.

    Attributes:
        factor: thrust relative to that at V₀; 1 if the voltage is unknown or `exponent` is 0.
    """

    def __init__(self, exponent: float) -> None:
        self.factor = 1.0
        self._exponent = exponent
        self._first_voltage: float | None = None
        self._ratio = 1.0
        self._time = 0.0

    def reset(self) -> None:
        """Forget V₀; the next voltage becomes V₀. Called at each step on the ground."""
        self._first_voltage = None
        self._ratio = self.factor = 1.0

    def note_voltage(self, time: float, voltage: float | None) -> None:
        """Take the voltage of the whole battery (V) at `time` (s); an unusable one is ignored."""
        if voltage is None or not isfinite(voltage) or voltage <= 0.0 or self._exponent == 0.0:
            return
        if self._first_voltage is None:
            self._first_voltage = voltage
        dt, self._time = time - self._time, time
        ratio = voltage / self._first_voltage
        if dt > 0.0 and _PLAUSIBLE_VOLTAGE_RATIO[0] < ratio < _PLAUSIBLE_VOLTAGE_RATIO[1]:
            self._ratio += dt / (dt + _VOLTAGE_FILTER_TIME) * (ratio - self._ratio)
            self.factor = self._ratio**self._exponent
