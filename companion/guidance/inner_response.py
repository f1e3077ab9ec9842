"""Response of the attitude loop to its targets, and the lead that compensates its delay."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import exp, inf

from companion.attitude import Coefficients
from companion.attitude.reference import first_order_step
from companion.attitude.representation import wrap_angle

CoefficientPath = Callable[[float], Coefficients]
"""Coefficients as a function of event-loop time, s."""

_PATH_STEP = 2e-3
"""Time step of the central differences along a path, s; their error in flight is about 1e-7."""
_INTEGRATION_STEP = 1e-3
"""Step of the integration in `step_time`, s."""
_MOST_STEPS = 60_000
_STEP_FRACTION_AT_TIME_CONSTANT = 1.0 - exp(-1.0)
"""Share of a step that a first-order response covers in its time constant."""


@dataclass(frozen=True, slots=True)
class InnerResponse:
    """Response of the coefficients c to their target c_d: ċ + lag·c̈ = gain·(c_d − c), delayed.

    The acceleration coefficients c are the north and east parts of the unit vector of the thrust.

    Attributes:
        gain: gain p of the planner, 1/s.
        lag: lag of the rate loop, s; 0: the response is of first order.
        dead_time: dead time of the rate loop, s.
        follows_model: True: the planner accounts for the dead time, and the response is that of its
            model, delayed: ċ + lag·c̈ = gain·(c_d(t − dead_time) − c). False: the planner compares
            the target with the measurement, and both are delayed:
            ċ + lag·c̈ = gain·(c_d − c)(t − dead_time).
    """

    gain: float
    lag: float
    dead_time: float
    follows_model: bool

    @property
    def effective_delay(self) -> float:
        """Delay of the response for the design of the position hold: 1/gain + lag + dead time, s.

        A target that moves at constant speed is followed with less delay: 1/gain, plus the dead
        time if `follows_model` is true.
        """
        return 1.0 / self.gain + self.lag + self.dead_time

    def step_time(self, step_size: float, max_speed: float = inf) -> float:
        """Time from a step of the target until the coefficients cover 63 % of the step, s.

        Args:
            step_size: size of the step, without unit.
            max_speed: largest speed of the coefficients, 1/s.

        Returns:
            The time; infinite if it is longer than 60 s.
        """
        delay = 0.0 if self.follows_model else self.dead_time
        speeds = deque([0.0] * (1 + round(delay / _INTEGRATION_STEP)))
        c = speed = 0.0
        for k in range(_MOST_STEPS):
            if c >= _STEP_FRACTION_AT_TIME_CONSTANT * step_size:
                return k * _INTEGRATION_STEP + (self.dead_time if self.follows_model else 0.0)
            # Without a model, the present error takes effect one dead time later.
            speeds.append(min(self.gain * (step_size - c), max_speed))
            change, speed = first_order_step(
                speed, speeds.popleft(), max(self.lag, _INTEGRATION_STEP), _INTEGRATION_STEP
            )
            c += change
        return inf

    def target(self, path: CoefficientPath, time: float) -> Coefficients:
        """The target at `time` that makes the coefficients follow `path` without error."""
        effect_time = time + self.dead_time
        before, middle, after = (path(effect_time + dt) for dt in (-_PATH_STEP, 0.0, _PATH_STEP))
        # The planner compares the target with its model at `effect_time`, or measures at `time`.
        compared_value = middle if self.follows_model or self.dead_time == 0.0 else path(time)
        return Coefficients(
            compared_value.north + self._lead(before.north, middle.north, after.north),
            compared_value.east + self._lead(before.east, middle.east, after.east),
        )

    def heading_target(self, heading: Callable[[float], float], time: float) -> tuple[float, float]:
        """Target heading (rad) and heading rate (rad/s) that make the heading follow `heading`.

        The planner turns at gain·(ψ_d − ψ) + ψ̇_d, so only lag·ψ̈ remains to be compensated. With
        a gain of 0 nothing is compensated.

        Args:
            heading: the wanted heading as a function of event-loop time, rad.
            time: s of event-loop time.
        """
        effect_time = time + self.dead_time
        middle = heading(effect_time)
        before = middle - wrap_angle(middle - heading(effect_time - _PATH_STEP))
        after = middle + wrap_angle(heading(effect_time + _PATH_STEP) - middle)
        rate, acceleration = _derivatives(before, middle, after)
        compared_value = middle if self.follows_model else heading(time)
        if self.gain == 0.0:
            return compared_value, rate
        return compared_value + self.lag * acceleration / self.gain, rate

    def _lead(self, before: float, middle: float, after: float) -> float:
        """Target minus coefficient c, so that c follows its path: (ċ + lag·c̈)/gain.

        The arguments are three values of c on the path, `_PATH_STEP` seconds apart.
        """
        speed, acceleration = _derivatives(before, middle, after)
        return (speed + self.lag * acceleration) / self.gain


def _derivatives(before: float, middle: float, after: float) -> tuple[float, float]:
    """First and second derivative of three values, `_PATH_STEP` s apart, by central differences."""
    first_derivative = 0.5 * (after - before) / _PATH_STEP
    return first_derivative, (after - 2.0 * middle + before) / (_PATH_STEP * _PATH_STEP)


IMMEDIATE = InnerResponse(gain=inf, lag=0.0, dead_time=0.0, follows_model=True)
"""A response without delay, so that a target needs no lead."""
