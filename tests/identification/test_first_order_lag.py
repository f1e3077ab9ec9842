"""The lag's response in running sums, against its recursion from knot to knot."""

import numpy as np
import pytest

from companion.identification.lags import (
    first_order_response,
    held_commands,
    slew_limited,
    value_at,
)


def recursion(commands, lag, at):
    """x(t) = v + m·(t − t_i − τ) + (x_i − v + m·τ)·exp(−(t − t_i)/τ), one piece after the other."""

    def after(piece, start, since):
        value, slope = commands.value[piece], commands.slope[piece]
        settled = value + slope * (since - lag)
        return settled + (start - value + slope * lag) * np.exp(-since / lag)

    starts = [float(commands.value[0])]
    for piece, length in enumerate(np.diff(commands.time)):
        starts.append(after(piece, starts[-1], length))
    pieces = np.searchsorted(commands.time, at, side="right") - 1
    return [after(p, starts[p], t - commands.time[p]) for p, t in zip(pieces, at, strict=True)]


@pytest.mark.parametrize("slew", [None, 3.0])
@pytest.mark.parametrize("lag", [0.001, 0.05, 1.0])
def test_running_sums_are_the_recursion_however_long_the_record(lag, slew):
    rng = np.random.default_rng(4)
    steps = rng.uniform(0.004, 0.02, size=2000)
    steps[[300, 301, 900]] = 0.9  # with a lag of 1 ms more than an exponential can bear
    commands = held_commands(np.cumsum(steps), rng.normal(size=2000))
    if slew is not None:
        commands = slew_limited(commands, slew)
    at = np.sort(rng.uniform(commands.time[0], commands.time[-1] + 2.0, size=3000))
    assert first_order_response(commands, lag, at) == pytest.approx(
        recursion(commands, lag, at), abs=1e-9
    )


def test_commands_that_hardly_differ_make_no_piece_of_their_own():
    time = np.arange(6.0)
    commands = held_commands(
        time, np.array([0.0, 0.004, -0.004, 0.02, 0.024, 0.0]), tolerance=0.005
    )
    assert commands.time.tolist() == [0.0, 3.0, 5.0]
    assert value_at(commands, np.array([2.5, 4.5])).tolist() == [0.0, 0.02]
    assert held_commands(time, np.array([0.0, 0.0, 1e-9, 1e-9, 0.0, 0.0])).time.tolist() == [
        0.0,
        2.0,
        4.0,
    ]


@pytest.mark.parametrize("slew", [0.5, 5.0, 500.0])
def test_slewed_commands_are_those_approached_in_small_steps(slew):
    rng = np.random.default_rng(6)
    commands = held_commands(np.cumsum(rng.integers(4, 60, size=200)) * 1e-3, rng.normal(size=200))
    step = 1e-4
    at = np.arange(commands.time[0], commands.time[-1] + 0.5, step)
    asked = value_at(commands, at + 0.5 * step)
    value, approached = float(asked[0]), []
    for target in asked.tolist():
        approached.append(value)
        value += min(max(target - value, -slew * step), slew * step)
    limited = slew_limited(commands, slew)
    assert np.all(np.diff(limited.time) >= 0.0)
    assert np.abs(value_at(limited, at) - approached).max() < 1.01 * slew * step + 1e-9
