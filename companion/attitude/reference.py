"""The linear models that the coefficients should follow, exact at any sample rate.

Each is the closed-form solution over one sample with a constant target. It has no discretisation
error, so a deviation from it is a deviation of the vehicle's response.
"""

from dataclasses import dataclass
from math import cos, exp, expm1, inf, sin, sqrt

from companion.attitude.types import Coefficients


def distance_left(distance: float, gain: float, max_speed: float, dt: float) -> float:
    """Distance d to the target after `dt` seconds of ḋ = −min(gain·d, max_speed).

    It falls at the largest speed (equation 33) until gain·d is below that, then exponentially.
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
    """First order: ċ = p·(c_d − c), with |ċ| at most `max_speed`.

    Attributes:
        gain: p, 1/s.
        max_speed: largest |ċ|, 1/s; W_M·cos(max_tilt) in the paper (equation 33).
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
    """Second order: c̈ = ω²·(c_d − c) − 2ζω·ċ.

    Attributes:
        frequency: ω, rad/s.
        damping: ζ; 1 is critical.
    """

    frequency: float
    damping: float = 1.0

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
        """Transition matrix of the state (c − c_d, ċ) over `dt` seconds, row by row."""
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
    """One step of lag·ṙ = aim − r: the integral of r over `dt`, and r at the end.

    `rate` is r at the start; `lag` and `dt` are in s.
    """
    kept = exp(-dt / lag)
    return aim * dt + (rate - aim) * lag * (1.0 - kept), aim + (rate - aim) * kept


def lag_step(
    rate: float,
    slope: float,
    aim: float,
    dt: float,
    lag: float,
    sigma: float,
    transition: tuple[float, float, float, float],
) -> tuple[float, float, float]:
    """One step of σ·r̈ + lag·ṙ = aim − r: the integral of r over `dt`, and r and ṙ at the end.

    `rate` and `slope` are r and ṙ at the start; `sigma` is σ, s²; `transition` is
    `Lag.transition(dt)`. If σ is 0, `slope` has no effect, and 0 is returned for ṙ.
    """
    left, from_slope, falls, kept = transition
    later = aim + left * (rate - aim) + from_slope * slope
    steeper = falls * (rate - aim) + kept * slope
    return aim * dt - lag * (later - rate) - sigma * (steeper - slope), later, steeper


class Lag:
    """A lag of first or second order: σ·r̈ + lag·ṙ = aim − r.

    Args:
        lag: s.
        sigma: σ, s²; 0 makes it first order.
    """

    __slots__ = ("_lag", "_model", "_sigma")

    def __init__(self, lag: float, sigma: float = 0.0) -> None:
        self._lag, self._sigma = lag, sigma
        self._model = None
        if sigma > 0.0:
            self._model = SecondOrderReference(1.0 / sqrt(sigma), 0.5 * lag / sqrt(sigma))

    def after(self, rate: float, slope: float, aim: float, dt: float) -> tuple[float, float, float]:
        """The integral of r over `dt`, and r and ṙ at the end.

        Args:
            rate: r at the start, in any unit.
            slope: ṙ at the start, per second; has no effect in first order.
            aim: constant input during `dt`, in the unit of `rate`.
            dt: s.
        """
        if self._model is None:
            moved, later = first_order_step(rate, aim, self._lag, dt)
            return moved, later, (aim - later) / self._lag
        transition = self.transition(dt)
        return lag_step(rate, slope, aim, dt, self._lag, self._sigma, transition)

    def transition(self, dt: float) -> tuple[float, float, float, float]:
        """Transition matrix of the state (r − aim, ṙ) over `dt` seconds, row by row."""
        if self._model is None:
            return exp(-dt / self._lag), 0.0, 0.0, 0.0
        return self._model.transition(dt)
