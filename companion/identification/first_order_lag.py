"""Exact response of a first-order lag to held commands, at any time, with or without a slew limit.

Between two knots the lag's input is a straight line v + m·(t − t_i), and the output solves
τ·ẋ = v + m·(t − t_i) − x:  x(t) = v + m·(t − t_i − τ) + (x_i − v + m·τ)·exp(−(t − t_i)/τ).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Knots(NamedTuple):
    """A command in straight pieces, which may jump.

    Attributes:
        time: (n,), start of each piece, s, not decreasing.
        value: (n,), at the start of each piece.
        slope: (n,), per second.
    """

    time: Floats
    value: Floats
    slope: Floats


def held(time: Floats, commanded: Floats) -> Knots:
    """Commands (n,) held from their times (n,) on; repetitions make no piece of their own."""
    new = np.concatenate(([True], commanded[1:] != commanded[:-1]))
    return Knots(time[new], commanded[new], np.zeros(int(new.sum())))


def slewed(commands: Knots, slew: float) -> Knots:
    """Held commands approached no faster than `slew` (per second), from rest at the first."""
    rows: list[tuple[float, float, float]] = []
    value = float(commands.value[0])
    ends = np.append(commands.time[1:], np.inf)
    for start, end, target in zip(
        commands.time.tolist(), ends.tolist(), commands.value.tolist(), strict=True
    ):
        slope = slew if target > value else -slew
        arrival = start + (target - value) / slope
        if arrival > start:
            rows.append((start, value, slope))
        if arrival < end:
            rows.append((arrival, target, 0.0))
            value = target
        else:
            value += slope * (end - start)
    return Knots(*np.array(rows).T)


def lagged(commands: Knots, lag: float, at: Floats) -> Floats:
    """What a lag of `lag` > 0 seconds makes of the commands, at the times (m,), begun at rest.

    No time in `at` may lie before the first knot.
    """
    steady = commands.value - commands.slope * lag
    decays = np.exp(-np.diff(commands.time) / lag).tolist()
    after = (steady[:-1] + commands.slope[:-1] * np.diff(commands.time)).tolist()
    excess = [float(commands.value[0] - steady[0])]
    for decay, end, start in zip(decays, after, steady[1:].tolist(), strict=True):
        excess.append(end + excess[-1] * decay - start)
    piece = np.searchsorted(commands.time, at, side="right") - 1
    since = at - commands.time[piece]
    straight = steady[piece] + commands.slope[piece] * since
    response: Floats = straight + np.array(excess)[piece] * np.exp(-since / lag)
    return response


def value_at(commands: Knots, at: Floats) -> Floats:
    """The commands themselves at the times (m,), none before the first knot."""
    piece = np.searchsorted(commands.time, at, side="right") - 1
    values: Floats = commands.value[piece] + commands.slope[piece] * (at - commands.time[piece])
    return values
