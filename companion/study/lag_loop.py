"""A rate loop of dead time and first-order lag, the same on every axis."""

from collections import deque
from dataclasses import dataclass
from math import exp

import numpy as np

from companion.attitude import BodyRates, Planner, Quaternion, Target
from companion.attitude.rotation import after_constant_rates
from companion.study.step import LoopFlight

STEP_HZ = 1000
"""Simulation steps per second; dead times and sample periods are whole numbers of steps."""


class LagBody:
    """A body whose rates follow ω̇ = (ω_commanded(t − θ) − ω)/τ, in steps of 1/STEP_HZ s.

    Args:
        q: attitude at the start, at rest.
        lag_ms: lag τ, ms.
        dead_time_ms: dead time θ, ms.

    Attributes:
        q: attitude, body → world.
        rates: body rates, rad/s.
    """

    def __init__(self, q: Quaternion, lag_ms: int, dead_time_ms: int) -> None:
        self.q = q
        self.rates = BodyRates(0.0, 0.0, 0.0)
        self._decay = exp(-1e3 / (STEP_HZ * lag_ms))
        self._mean_decay = 1e-3 * lag_ms * (1.0 - self._decay) * STEP_HZ  # mean over a step
        self._delayed_commands = deque([self.rates] * (dead_time_ms + 1), maxlen=dead_time_ms + 1)

    def simulate(self, commanded_rates: BodyRates, steps: int) -> None:
        """Simulate `steps` steps of 1/STEP_HZ s with constant commanded rates, rad/s."""
        decay, mean_decay, (roll, pitch, yaw) = self._decay, self._mean_decay, self.rates
        for _ in range(steps):
            self._delayed_commands.append(commanded_rates)
            delayed_roll, delayed_pitch, delayed_yaw = self._delayed_commands[0]
            # The difference of each rate from its delayed command decays.
            roll, pitch, yaw = roll - delayed_roll, pitch - delayed_pitch, yaw - delayed_yaw
            rates = (
                delayed_roll + mean_decay * roll,
                delayed_pitch + mean_decay * pitch,
                delayed_yaw + mean_decay * yaw,
            )
            self.q = after_constant_rates(self.q, rates, 1.0 / STEP_HZ)
            roll, pitch, yaw = (
                delayed_roll + decay * roll,
                delayed_pitch + decay * pitch,
                delayed_yaw + decay * yaw,
            )
        self.rates = BodyRates(roll, pitch, yaw)


@dataclass(frozen=True)
class LagLoop:
    """The inner loop of a planner that commands a `LagBody`."""

    lag_ms: int
    """Lag τ of the body rates, ms."""
    dead_time_ms: int
    """Dead time θ of the body rates, ms."""

    def fly(
        self, planner: Planner, start: Quaternion, target: Target, *, seconds: float, rate_hz: float
    ) -> LoopFlight:
        """Fly from rest to a target; commanded rates are held until the next planner sample.

        `rate_hz` must divide `STEP_HZ`.
        """
        steps = round(STEP_HZ / rate_hz)
        body = LagBody(start, self.lag_ms, self.dead_time_ms)
        attitudes, commanded_rates, body_rates = [start], [], [body.rates]
        for _ in range(round(seconds * rate_hz)):
            rates = planner.rates(body.q, target, 1.0 / rate_hz, body.rates)
            commanded_rates.append(rates)
            body.simulate(rates, steps)
            attitudes.append(body.q)
            body_rates.append(body.rates)
        return LoopFlight(np.array(attitudes), np.array(commanded_rates), np.array(body_rates))
