"""Seeded random flights by the hundred: vehicles, what they are asked, and the gusts they meet."""

from dataclasses import dataclass

import numpy as np

from companion.attitude import Limits, Target, make_planner
from tests.attitude.independent import attitudes
from tests.attitude.lag_plant import Flight, LagPlant, fly

CALM = 0.7
"""The end of every flight without gusts, s."""
_GUST_MEMORY = 0.15  # s
_PULSE = 2.0, 0.05  # rad/s, s
_WAYPOINTS = 8


@dataclass
class Fleet:
    """N vehicles: how their rate loops answer, what their planners believe, and their limits.

    `lag` and `dead_time` are (N, 3), s, of roll, pitch and yaw; `known` holds both as believed,
    (N, 2, 2): of lag and dead time, for tilt and yaw. Limits are (N,), in rad and rad/s.
    """

    lag: np.ndarray
    dead_time: np.ndarray
    known: np.ndarray
    gain: np.ndarray
    max_tilt: np.ndarray
    max_tilt_rate: np.ndarray
    max_yaw_rate: np.ndarray

    @classmethod
    def random(cls, rng, count, error):
        """5 to 80 ms of dead time, 10 to 60 ms of lag, yaw slower; known up to `error` off."""
        lag = rng.uniform(0.01, 0.06, (count, 1)) * [1.0, 1.0, 0.0]
        dead_time = rng.uniform(0.005, 0.08, (count, 1)) * [1.0, 1.0, 0.0]
        lag[:, 2] = lag[:, 0] * rng.uniform(1.0, 5.0, count)
        dead_time[:, 2] = dead_time[:, 0] * rng.uniform(1.0, 2.5, count)
        true = np.stack([lag[:, 1:], dead_time[:, 1:]], axis=1)
        return cls(
            lag,
            dead_time,
            true * (1.0 + error * rng.uniform(-1.0, 1.0, true.shape)),
            rng.uniform(2.0, 8.0, count),
            np.radians(rng.uniform(15.0, 50.0, count)),
            rng.uniform(0.8, 3.0, count),
            rng.uniform(0.5, 2.0, count),
        )

    @property
    def longest(self):
        """Largest coefficients, (N,)."""
        return np.sin(self.max_tilt)

    def planners(self):
        """One `model-following` each."""
        rows = zip(
            self.gain.tolist(),
            self.known.tolist(),
            self.max_tilt.tolist(),
            self.max_tilt_rate.tolist(),
            self.max_yaw_rate.tolist(),
            strict=True,
        )
        return [
            make_planner(
                "model-following",
                gain,
                limits=Limits(*limits),
                lag=lag,
                yaw_lag=yaw_lag,
                dead_time=dead_time,
                yaw_dead_time=yaw_dead_time,
            )
            for gain, ((lag, yaw_lag), (dead_time, yaw_dead_time)), *limits in rows
        ]


def random_targets(rng, longest, samples, dt):
    """(S, N, 4) north, east, heading, heading rate: by turns steps, ramps and corners of the limit.

    Steps and ramps lie anywhere, also far beyond the tilt limit; from corner to corner the way
    leads past level or along the limit. Each vehicle has a waypoint every 0.25 to 0.9 s.
    """
    count = len(longest)
    kind = np.arange(count) % 3
    angle = rng.uniform(-np.pi, np.pi, (_WAYPOINTS, count))
    quarters = np.pi / 2 * np.cumsum(rng.integers(1, 4, (_WAYPOINTS, count)), axis=0)
    angle = np.where(kind == 2, quarters, angle)
    radius = np.where(kind == 2, longest, 1.5 * np.sqrt(rng.uniform(size=(_WAYPOINTS, count))))
    heading = np.cumsum(rng.uniform(-3.0, 3.0, (_WAYPOINTS, count)), axis=0)
    waypoints = np.stack([radius * np.cos(angle), radius * np.sin(angle), heading], axis=-1)
    period = rng.uniform(0.25, 0.9, count)
    time = np.arange(samples)[:, None] * dt / period
    passed = np.minimum(time.astype(int), _WAYPOINTS - 2)
    ramps = (kind == 1)[:, None]
    last, following = waypoints[passed, np.arange(count)], waypoints[passed + 1, np.arange(count)]
    share = np.where(ramps, np.minimum(time - passed, 1.0)[..., None], 0.0)
    turning = np.where(ramps[:, 0], (following - last)[..., 2] / period, 0.0)
    return np.concatenate([last + share * (following - last), turning[..., None]], axis=-1)


def random_gusts(rng, count, samples, dt):
    """(S, N, 3) rad/s: coloured noise of 0.2 to 0.5 rad/s, one pulse, and calm at the end."""
    strength = rng.uniform(0.2, 0.5, (count, 1))
    kept = np.exp(-dt / _GUST_MEMORY)
    gust, rows = strength * rng.normal(size=(count, 3)), []
    for _ in range(samples):
        rows.append(gust)
        gust = kept * gust + np.sqrt(1.0 - kept**2) * strength * rng.normal(size=(count, 3))
    gusts = np.array(rows)
    windy = samples - round(CALM / dt)
    axis = rng.normal(size=(count, 3))
    axis *= _PULSE[0] / np.linalg.norm(axis, axis=1, keepdims=True)
    for vehicle, start in enumerate(rng.integers(0, windy, count)):
        gusts[start : start + max(1, round(_PULSE[1] / dt)), vehicle] += axis[vehicle]
    gusts[windy:] = 0.0
    return gusts


def fly_random(seed, count, hz, seconds, error, gusts):
    """Fly so many vehicles, each from another attitude: the fleet and its flight."""
    rng = np.random.default_rng(seed)
    fleet, dt, samples = Fleet.random(rng, count, error), 1.0 / hz, round(seconds * hz)
    asked = random_targets(rng, fleet.longest, samples, dt).tolist()
    pushes = random_gusts(rng, count, samples, dt) * gusts
    start = rng.uniform(-0.7, 0.7, (count, 2)) * fleet.longest[:, None]
    plant = LagPlant(attitudes(start, rng.uniform(-3.0, 3.0, count)), fleet.lag, fleet.dead_time)
    flight = fly(
        fleet.planners(),
        plant,
        lambda n: [Target(*row) for row in asked[n]],
        samples,
        dt,
        lambda n: pushes[n],
    )
    return fleet, flight


def tilt_of(flight: Flight):
    """(S + 1, N) rad."""
    return np.arcsin(np.minimum(1.0, np.hypot(*np.moveaxis(flight.c, 2, 0))))


def outward(flight: Flight):
    """(S, N) 1/s: how quickly each command, were it followed at once, would lengthen |c|.

    With m the rotation matrix, c = −m·(0, 0, 1) moves with ω_x·m₁ − ω_y·m₀.
    """
    c, heading = flight.c[:-1].reshape(-1, 2), flight.heading[:-1].reshape(-1)
    roll, pitch, _ = flight.commands.reshape(-1, 3).T
    m = attitudes(c, heading).as_matrix()
    speed = roll[:, None] * m[:, :2, 1] - pitch[:, None] * m[:, :2, 0]
    along = (speed * c).sum(axis=1) / np.maximum(np.hypot(*c.T), 1e-9)
    return along.reshape(flight.commands.shape[:2])
