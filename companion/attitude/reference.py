"""The linear models that the coefficients should follow, exact at any sample rate.

Each model is the closed-form solution over one sample with a constant target. The models have no
discretisation error, so a deviation from them is a deviation of the vehicle's response.
"""

from dataclasses import dataclass
from math import cos, exp, expm1, inf, sin, sqrt

from companion.attitude.types import Coefficients


def remaining_distance(distance: float, gain: float, max_speed: float, dt: float) -> float:
    """Distance d to the target after `dt` seconds of ḋ = −min(gain·d, max_speed).

    The distance falls at `max_speed` (equation 33) until gain·d is below it, then exponentially.
    """
    excess_speed = gain * distance - max_speed
    if excess_speed > 0.0:
        full_speed_time = excess_speed / (gain * max_speed)  # s
        if full_speed_time >= dt:
            return distance - max_speed * dt
        return max_speed / gain * exp(-gain * (dt - full_speed_time))
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
        remaining_share = remaining_distance(distance, self.gain, self.max_speed, dt) / distance
        return Coefficients(
            target.north - remaining_share * north, target.east - remaining_share * east
        )


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
        c_from_c, c_from_speed, speed_from_c, speed_from_speed = self.transition(dt)
        north, east = c.north - target.north, c.east - target.east
        return (
            Coefficients(
                target.north + c_from_c * north + c_from_speed * speed.north,
                target.east + c_from_c * east + c_from_speed * speed.east,
            ),
            Coefficients(
                speed_from_c * north + speed_from_speed * speed.north,
                speed_from_c * east + speed_from_speed * speed.east,
            ),
        )

    def transition(self, dt: float) -> tuple[float, float, float, float]:
        """Transition matrix of the state (c − c_d, ċ) over `dt` seconds, row by row."""
        decay_rate = self.damping * self.frequency
        root_squared = self.frequency * self.frequency * (1.0 - self.damping * self.damping)
        if root_squared > 0.0:
            root, decay_factor = sqrt(root_squared), exp(-decay_rate * dt)
            even_part = decay_factor * cos(root * dt)
            odd_part = decay_factor * sin(root * dt) / root
        elif root_squared < 0.0:
            root = sqrt(-root_squared)
            # The slower exponential cannot overflow. Its rate is decay_rate − root, written without
            # this difference, which is all rounding error for a large damping.
            slow_decay = exp(-self.frequency * self.frequency / (decay_rate + root) * dt)
            even_part = 0.5 * slow_decay * (1.0 + exp(-2.0 * root * dt))
            odd_part = -0.5 * slow_decay * expm1(-2.0 * root * dt) / root
        else:
            even_part = exp(-decay_rate * dt)
            odd_part = even_part * dt
        return (
            even_part + decay_rate * odd_part,
            odd_part,
            -self.frequency * self.frequency * odd_part,
            even_part - decay_rate * odd_part,
        )


def first_order_step(rate: float, command: float, lag: float, dt: float) -> tuple[float, float]:
    """One step of lag·ṙ = command − r: the integral of r over `dt`, and r at the end.

    `rate` is r at the start; `lag` and `dt` are in s.
    """
    decay_factor, difference = exp(-dt / lag), rate - command
    integral = command * dt + difference * lag * (1.0 - decay_factor)
    return integral, command + difference * decay_factor


def lag_step(
    rate: float,
    slope: float,
    command: float,
    dt: float,
    lag: float,
    sigma: float,
    transition: tuple[float, float, float, float],
) -> tuple[float, float, float]:
    """One step of σ·r̈ + lag·ṙ = command − r: the integral of r over `dt`, and r and ṙ at the end.

    `rate` and `slope` are r and ṙ at the start; `sigma` is σ, s²; `transition` is
    `Lag.transition(dt)`. If σ is 0, `slope` has no effect, and 0 is returned for ṙ.
    """
    r_from_r, r_from_slope, slope_from_r, slope_from_slope = transition
    end_rate = command + r_from_r * (rate - command) + r_from_slope * slope
    end_slope = slope_from_r * (rate - command) + slope_from_slope * slope
    return command * dt - lag * (end_rate - rate) - sigma * (end_slope - slope), end_rate, end_slope


class Lag:
    """A lag of first or second order: σ·r̈ + lag·ṙ = command − r.

    Args:
        lag: τ, s.
        sigma: σ, s²; 0 makes it first order.
    """

    def __init__(self, lag: float, sigma: float = 0.0) -> None:
        self._lag, self._sigma = lag, sigma
        self._model = None
        if sigma > 0.0:
            self._model = SecondOrderReference(1.0 / sqrt(sigma), 0.5 * lag / sqrt(sigma))

    def after(
        self, rate: float, slope: float, command: float, dt: float
    ) -> tuple[float, float, float]:
        """One step with a constant command; return the integral of r over it, and r and ṙ after it.

        Args:
            rate: r at the start, in any unit.
            slope: ṙ at the start, per second; has no effect in first order.
            command: the command, in the unit of `rate`.
            dt: length of the step, s.
        """
        if self._model is None:
            integral, end_rate = first_order_step(rate, command, self._lag, dt)
            return integral, end_rate, (command - end_rate) / self._lag
        transition = self.transition(dt)
        return lag_step(rate, slope, command, dt, self._lag, self._sigma, transition)

    def transition(self, dt: float) -> tuple[float, float, float, float]:
        """Transition matrix of the state (r − command, ṙ) over `dt` seconds, row by row."""
        if self._model is None:
            return exp(-dt / self._lag), 0.0, 0.0, 0.0
        return self._model.transition(dt)
