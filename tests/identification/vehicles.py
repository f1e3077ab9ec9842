"""Vehicles to identify: one written down from its differential equation, and the mock's physics."""

from dataclasses import dataclass

import numpy as np

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.physics.multirotor import Multirotor

RATE_NOISE = 0.002
"""Standard deviation of a gyroscope's white noise, rad/s."""


@dataclass(frozen=True)
class Doublets:
    """+, − for twice as long, + again, then a rest: once for each size."""

    sizes: tuple[float, ...] = (0.25, 0.5, 1.0)
    width: float = 0.2

    @property
    def changes(self):
        """Rows (time, value from then on)."""
        rows, start = [(0.0, 0.0)], 0.7
        for size in self.sizes:
            for after, value in ((0, size), (1, -size), (3, size), (4, 0.0)):
                rows.append((start + after * self.width, value))
            start += 6 * self.width
        return np.array(rows)

    @property
    def end(self):
        return 0.7 + 6 * self.width * len(self.sizes) + 0.5

    def at(self, time):
        when, value = self.changes.T
        return value[np.searchsorted(when, time + 1e-9, side="right") - 1]


def regular(end, rate_hz):
    return np.arange(0.0, end, 1.0 / rate_hz)


def irregular(end, rng):
    """50 to 250 Hz, and now and then nothing for up to 120 ms."""
    steps = rng.uniform(0.004, 0.02, size=int(end / 0.004))
    steps[rng.random(steps.size) < 0.02] += 0.1
    times = np.cumsum(steps)
    return times[times < end]


def lag_with_dead_time(times, commanded, lag, dead_time, *, gain=1.0, slew=np.inf):
    """Rates at `times`, by steps of 0.1 ms through lag·dx/dt = v − x, |dv/dt| ≤ slew."""
    step = 1e-4
    fine = np.arange(times[0], times[-1] + step, step)
    held = np.searchsorted(times, fine + 0.5 * step - dead_time, side="right") - 1
    start = float(commanded[0])
    asked = np.concatenate(([start], _slewed(start, commanded[np.maximum(held, 0)], slew * step)))
    share = step / (lag + 0.5 * step)
    means = 0.5 * (asked[:-1] + asked[1:]) - start
    reached = _filtered([0.0, share], [1.0, share - 1.0], means)
    return gain * np.interp(times, fine, start + reached)


def _filtered(numerator, denominator, values):
    from scipy.signal import lfilter  # noqa: PLC0415  takes half a second, in every worker

    return lfilter(numerator, denominator, values)


def _slewed(start, targets, most):
    """What follows the targets by at most so much in each step."""
    if most == np.inf:
        return targets
    asked, reached = start, []
    for target in targets.tolist():
        asked += min(max(target - asked, -most), most)
        reached.append(asked)
    return np.array(reached)


def loop_with_dead_time(times, commanded, *, frequency, damping, dead_time, gain=1.0, slew=np.inf):
    """Rates at `times`, by steps of 0.2 ms through ẍ = ω²·(v − x) − 2ζω·ẋ, |dv/dt| ≤ slew."""
    step = 2e-4
    fine = np.arange(times[0], times[-1] + step, step)
    held = np.searchsorted(times, fine + 0.5 * step - dead_time, side="right") - 1
    start = float(commanded[0])
    asked = _slewed(start, commanded[np.maximum(held, 0)], slew * step) - start
    kept, pull = 1.0 - 2.0 * damping * frequency * step, (frequency * step) ** 2
    rates = _filtered([0.0, pull], [1.0, pull - 1.0 - kept, kept], asked)
    return gain * np.interp(times, fine, start + rates)


def mock_axis(axis, doublets, *, rate_hz=100, seed=1, delay=0.002):
    """Doublets about one axis of the mock in a hover: (time, commanded, time, measured).

    The samples are `delay` seconds old when they are answered, and noisy.
    """
    vehicle = Multirotor(AirframeConfig(), RateLoopConfig(), (1.0, 0.0, 0.0, 0.0), 9.80665)
    hover, rng = vehicle.throttle(9.80665), np.random.default_rng(seed)
    rates, times, commanded, measured = [], [], [], []
    setpoint, late = [0.0, 0.0, 0.0], round(delay / vehicle.dt)
    for step in range(round(doublets.end / vehicle.dt)):
        rates.append(vehicle.body_rates[axis])
        if step % round(1.0 / (rate_hz * vehicle.dt)) == 0 and step >= late:
            times.append((step - late) * vehicle.dt)
            measured.append(rates[step - late] + rng.normal(0.0, RATE_NOISE))
            setpoint[axis] = float(doublets.at(times[-1]))
            commanded.append(setpoint[axis])
        vehicle.move(vehicle.drive(tuple(setpoint), hover))
    return times, commanded, times, measured
