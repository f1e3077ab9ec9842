"""Random vehicles for the tests of the batch."""

import math

import numpy as np

from companion.attitude import Limits, Target, make_planner

LIMITS = (
    Limits(),
    Limits(math.radians(40), 1.5, 0.8),
    Limits(math.radians(40), 1.5, 0.8, shape="paper"),
)


def anywhere(count, seed=1, longest=0.7):
    """Attitudes over the whole sphere, inverted ones too; targets of every heading."""
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(4, count))
    q /= np.linalg.norm(q, axis=0)
    length, bearing = longest * np.sqrt(rng.uniform(0, 1, count)), rng.uniform(-3, 3, count)
    heading, heading_rate = rng.uniform(-3.1, 3.1, count), rng.uniform(-1, 1, count)
    aim = [length * np.cos(bearing), length * np.sin(bearing), heading, heading_rate]
    return q, np.array(aim)


def in_flight(name, limits, q, targets, dt):
    """What a flight with this planner would answer: (3, n)."""
    planner = make_planner(name, limits=limits)
    vehicles = zip(q.T.tolist(), targets.T.tolist(), strict=True)
    return np.array([planner.rates(tuple(a), Target(*b), dt) for a, b in vehicles]).T
