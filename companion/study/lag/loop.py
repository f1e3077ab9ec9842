"""A rate loop in two numbers: dead time and first-order lag, the same on every axis."""

from collections import deque
from dataclasses import dataclass
from math import exp
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.attitude import BodyRates, Planner, Quaternion, Target
from companion.attitude.rotation import turned

Floats = NDArray[np.float64]

STEP_HZ = 1000
"""Steps a second of the plant; dead times and samples are whole numbers of them."""


class LagFlight(NamedTuple):
    """q (samples + 1, 4) and the commanded body rates (samples, 3), rad/s."""

    q: Floats
    commanded: Floats


@dataclass(frozen=True)
class LagLoop:
    """Body rates follow ω̇ = (ω_commanded(t − θ) − ω)/τ; the attitude follows the body rates.

    Attributes:
        lag_ms: τ.
        dead_time_ms: θ.
    """

    lag_ms: int
    dead_time_ms: int

    def fly(
        self, planner: Planner, start: Quaternion, target: Target, *, seconds: float, rate_hz: float
    ) -> LagFlight:
        """Fly one target from rest, the planner's rates held from one of its samples to the next.

        Raises:
            ValueError: a sample is not a whole number of steps.
        """
        dt = 1.0 / STEP_HZ
        steps = round(STEP_HZ / rate_hz)
        if steps * rate_hz != STEP_HZ:
            raise ValueError(f"rate_hz must divide {STEP_HZ}, not {rate_hz}")
        kept = exp(-1e3 * dt / self.lag_ms)
        mean = 1e-3 * self.lag_ms * (1.0 - kept) / dt  # of what is kept, over the step
        under_way = deque([BodyRates(0.0, 0.0, 0.0)] * (self.dead_time_ms + 1))
        q, roll, pitch, yaw = start, 0.0, 0.0, 0.0
        attitudes, commanded = [q], []
        for _ in range(round(seconds * rate_hz)):
            rates = planner.rates(q, target, 1.0 / rate_hz, BodyRates(roll, pitch, yaw))
            commanded.append(rates)
            for _ in range(steps):
                under_way.append(rates)
                under_way.popleft()
                p, r, y = under_way[0]
                roll, pitch, yaw = roll - p, pitch - r, yaw - y
                q = turned(q, (p + mean * roll, r + mean * pitch, y + mean * yaw), dt)
                roll, pitch, yaw = p + kept * roll, r + kept * pitch, y + kept * yaw
            attitudes.append(q)
        return LagFlight(np.array(attitudes), np.array(commanded))
