"""The linear models that the coefficients should follow, exact at any sample rate.

Each is the closed solution over one sample with the target held, so that it has no discretisation
error: a deviation from it is a deviation of the response.
"""

from dataclasses import dataclass
from math import cos, exp, expm1, inf, sin, sqrt

from companion.attitude.types import Coefficients


def distance_left(distance: float, gain: float, max_speed: float, dt: float) -> float:
    """Distance to the target after `dt` seconds, first order with a top speed.

    d' = −min(gain·d, max_speed): at the top speed (equation 33) until gain·d falls below it, from
    there on exponentially.
    """
    beyond = gain * distance - max_speed
    if beyond > 0.0:
        full_speed = beyond / (gain * max_speed)  # s
        if full_speed >= dt:
            return distance - max_speed * dt
        return max_speed / gain * exp(-gain * (dt - full_speed))
    return distance * exp(-gain * dt)


@dataclass(frozen=True, slots=True)
class FirstOrderReference:
    """ċ = p·(c_d − c), its length at most `max_speed`.

    Attributes:
        gain: p, 1/s.
        max_speed: 1/s; W_M·cos(max_tilt) is the paper's (equation 33).
    """

    gain: float
    max_speed: float = inf

    def after(self, c: Coefficients, target: Coefficients, dt: float) -> Coefficients:
        """The coefficients `dt` seconds later, on the straight line from `c` to `target`."""
        north, east = target.north - c.north, target.east - c.east
        distance = sqrt(north * north + east * east)
        if distance == 0.0:
            return target
        left = distance_left(distance, self.gain, self.max_speed, dt) / distance
        return Coefficients(target.north - left * north, target.east - left * east)


@dataclass(frozen=True, slots=True)
class SecondOrderReference:
    """c̈ = ω²·(c_d − c) − 2ζω·ċ.

    Attributes:
        frequency: ω, rad/s.
        damping: ζ; 1 is critical.
    """

    frequency: float
    damping: float = 1.0

    @classmethod
    def with_lag(cls, gain: float, lag: float) -> "SecondOrderReference":
        """First order with gain p (1/s) behind a lag τ (s): c̈ = (p·(c_d − c) − ċ)/τ."""
        return cls(sqrt(gain / lag), 0.5 / sqrt(gain * lag))

    def after(
        self, c: Coefficients, speed: Coefficients, target: Coefficients, dt: float
    ) -> tuple[Coefficients, Coefficients]:
        """Coefficients and their speed (1/s) `dt` seconds later."""
        still, moved, slope, kept = self.transition(dt)
        north, east = c.north - target.north, c.east - target.east
        return (
            Coefficients(
                target.north + still * north + moved * speed.north,
                target.east + still * east + moved * speed.east,
            ),
            Coefficients(
                slope * north + kept * speed.north,
                slope * east + kept * speed.east,
            ),
        )

    def transition(self, dt: float) -> tuple[float, float, float, float]:
        """The matrix exponential over `dt`: (c, ċ) from (c − c_d, ċ), row by row."""
        decay = self.damping * self.frequency
        square = self.frequency * self.frequency * (1.0 - self.damping * self.damping)
        if square > 0.0:
            root, fading = sqrt(square), exp(-decay * dt)
            even, odd = fading * cos(root * dt), fading * sin(root * dt) / root
        elif square < 0.0:
            root = sqrt(-square)
            slow = exp((root - decay) * dt)  # the slower of the two: nothing here overflows
            even = 0.5 * slow * (1.0 + exp(-2.0 * root * dt))
            odd = -0.5 * slow * expm1(-2.0 * root * dt) / root
        else:
            even = exp(-decay * dt)
            odd = even * dt
        return (
            even + decay * odd,
            odd,
            -self.frequency * self.frequency * odd,
            even - decay * odd,
        )


def first_order_step(rate: float, aim: float, lag: float, dt: float) -> tuple[float, float]:
    """One step of lag·ṙ = aim − r: the integral of the rate over `dt`, and the rate at its end.

    `lag` and `dt` in s; the integral in the unit of the rate times s.
    """
    kept = exp(-dt / lag)
    return aim * dt + (rate - aim) * lag * (1.0 - kept), aim + (rate - aim) * kept


class Lag:
    """square·r̈ + lag·ṙ = aim − r.

    Args:
        lag: s.
        square: s²; 0 makes it first order.
    """

    __slots__ = ("_lag", "_model", "_square")

    def __init__(self, lag: float, square: float = 0.0) -> None:
        self._lag, self._square = lag, square
        self._model = None
        if square > 0.0:
            self._model = SecondOrderReference(1.0 / sqrt(square), 0.5 * lag / sqrt(square))

    def after(self, rate: float, slope: float, aim: float, dt: float) -> tuple[float, float, float]:
        """The integral of the rate over `dt`; the rate and its slope at the end.

        Args:
            rate: in any unit.
            slope: its change a second; without effect in first order.
            aim: held, in the rate's unit.
            dt: s.
        """
        if self._model is None:
            moved, later = first_order_step(rate, aim, self._lag, dt)
            return moved, later, (aim - later) / self._lag
        left, from_slope, falls, kept = self._model.transition(dt)
        later = aim + left * (rate - aim) + from_slope * slope
        steeper = falls * (rate - aim) + kept * slope
        moved = aim * dt - self._lag * (later - rate) - self._square * (steeper - slope)
        return moved, later, steeper
