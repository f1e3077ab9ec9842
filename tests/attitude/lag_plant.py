"""A vehicle whose rate loop answers late: dead time, then a lag, on SciPy rotations.

The judge of `model-following`, written from that one sentence; nothing of its maths is shared.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates
from tests.attitude.independent import coefficients_of, headings_of, multiplied

LONGEST_STEP = 1e-3  # s


class LagPlant:
    """N vehicles sampled together; each τ·ω̇ = u(t − θ) − ω per axis, u held over each sample.

    `lag` and `dead_time` are the τ and θ of (roll, pitch, yaw), s: (3,) or (N, 3). Rates are solved
    exactly, also where u changes within a step; the attitude turns by their integral over at most
    a millisecond. Before the start, u was `rates`, as was the answer.
    """

    def __init__(self, start, lag, dead_time, rates=(0.0, 0.0, 0.0)):
        shape = (len(start), 3)
        self.r = start
        self._lag = np.maximum(np.broadcast_to(np.asarray(lag, dtype=float), shape), 1e-9)
        self._dead_time = np.broadcast_to(np.asarray(dead_time, dtype=float), shape)
        self.rates = np.broadcast_to(np.asarray(rates, dtype=float), shape)
        self.true_rates = self.rates
        self._time = 0.0
        self._times = np.array([-np.inf])
        self._commands = [self.rates]

    def hold(self, command, dt, push=0.0):
        """Hold `command` (N, 3) for `dt`; `push` (rad/s) turns the body without its rate loop."""
        self._forget()
        self._times = np.append(self._times, self._time)
        self._commands.append(np.asarray(command, dtype=float))
        steps = int(np.ceil(dt / LONGEST_STEP - 1e-9))
        h = dt / steps
        now = self._time + h * np.arange(steps)[:, None, None] - self._dead_time
        times = np.append(self._times, np.inf)
        which = np.searchsorted(times, now + 1e-9, side="right") - 1
        first = np.clip(times[which + 1] - now, 0.0, h)
        later = np.minimum(which + 1, len(self._commands) - 1)
        commands = np.array(self._commands)
        row, column = np.indices(self.rates.shape)
        before, after = commands[which, row, column], commands[later, row, column]
        turns, changed = np.empty_like(now), (first < h).any(axis=(1, 2))
        second = h - first
        decay, later_decay = self._decay(first), self._decay(second) if changed.any() else None
        for step in range(steps):
            turns[step] = self._answer(before[step], first[step], decay[step])
            if changed[step]:
                turns[step] += self._answer(after[step], second[step], later_decay[step])
        self.r = self.r * one_after_the_other(turns + np.asarray(push) * h)
        self._time += dt
        self.true_rates = self.rates + push

    def _forget(self):
        """Forget the commands that no axis can answer any more, or each step would cost more."""
        over = np.searchsorted(self._times, self._time - self._dead_time.max(), side="right") - 1
        if over > 0:
            self._times, self._commands = self._times[over:], self._commands[over:]

    def _decay(self, seconds):
        """What is left of a deviation after (S, N, 3) seconds; the first axis is that of steps."""
        return np.exp(-seconds / self._lag)

    def _answer(self, command, seconds, kept):
        """Rates after so many seconds of a steady command; returns their integral."""
        away = self.rates - command
        self.rates = command + away * kept
        return command * seconds + away * self._lag * (1.0 - kept)


def one_after_the_other(turns):
    """The product of the rotations by (S, N, 3) rotation vectors, of each of N bodies."""
    angle = np.linalg.norm(turns, axis=-1)
    vector = (0.5 * np.sinc(angle / (2.0 * np.pi)))[..., None] * turns
    product = np.concatenate([vector, np.cos(0.5 * angle)[..., None]], axis=-1)
    while len(product) > 1:
        even = len(product) // 2 * 2
        joined = multiplied(product[:even:2], product[1:even:2])
        product = np.concatenate([joined, product[even:]])
    return Rotation.from_quat(product[0])


@dataclass
class Flight:
    """Of N vehicles in S samples: what was measured at each, and what was answered to it."""

    c: np.ndarray  # (S + 1, N, 2)
    heading: np.ndarray  # (S + 1, N) rad, unwrapped
    rates: np.ndarray  # (S + 1, N, 3) rad/s, of the body
    commands: np.ndarray  # (S, N, 3) rad/s
    dt: float

    @property
    def t(self):
        return np.arange(len(self.c)) * self.dt

    @property
    def tilt_commands(self):
        return np.hypot(self.commands[..., 0], self.commands[..., 1])


class SecondOrderPlant(LagPlant):
    """As `LagPlant`, but (τ/2ζ)²·ω̈ + τ·ω̇ = u(t − θ) − ω, with `damping` ζ of each axis."""

    def __init__(self, start, lag, dead_time, damping):
        super().__init__(start, lag, dead_time)
        square = np.broadcast_to(
            (self._lag / (2.0 * np.asarray(damping, dtype=float))) ** 2, (1, 3)
        )
        root = np.sqrt(self._lag**2 - 4.0 * square + 0j)
        self._modes = (-self._lag + root) / (2.0 * square), (-self._lag - root) / (2.0 * square)
        self._slopes = np.zeros_like(self.rates)

    def _decay(self, seconds):
        return np.stack([np.exp(mode * seconds) for mode in self._modes], axis=1)

    def _answer(self, command, seconds, kept):
        first, second = self._modes
        away = self.rates - command
        a = (self._slopes - second * away) / (first - second)
        b = away - a
        a_later, b_later = a * kept[0], b * kept[1]
        self.rates = command + (a_later + b_later).real
        self._slopes = (first * a_later + second * b_later).real
        return command * seconds + ((a_later - a) / first + (b_later - b) / second).real


def fly(planners, plant, target_at, samples, dt, push_at=None):
    """`planners[i]` flies vehicle i; `target_at(n)` gives the N targets of sample n.

    `push_at(n)` are the disturbing rates (N, 3) until the next sample.
    """
    seen = [(plant.r, plant.true_rates)]
    commands = []
    for planner, q, w in zip(planners, *_measured(plant), strict=True):
        planner.reset(q, w)
    for n in range(samples):
        measured = zip(planners, *_measured(plant), target_at(n), strict=True)
        commands.append(np.array([p.rates(q, target, dt, w) for p, q, w, target in measured]))
        plant.hold(commands[-1], dt, 0.0 if push_at is None else push_at(n))
        seen.append((plant.r, plant.true_rates))
    shape = len(seen), len(planners)
    r = Rotation.from_quat(np.concatenate([r.as_quat() for r, _ in seen]))
    return Flight(
        coefficients_of(r).reshape(*shape, 2),
        np.unwrap(headings_of(r).reshape(shape), axis=0),
        np.array([rates for _, rates in seen]),
        np.array(commands),
        dt,
    )


def _measured(plant):
    q = plant.r.as_quat(scalar_first=True).tolist()
    return [tuple(row) for row in q], [BodyRates(*row) for row in plant.true_rates.tolist()]
