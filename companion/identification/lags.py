"""Exact response of first- and second-order lags to held commands, with or without a slew limit.

Between two knots the input of the lag is a straight line v + m·(t − t_i). The output solves
τ·ẋ = v + m·(t − t_i) − x:  x(t) = v + m·(t − t_i − τ) + (x_i − v + m·τ)·exp(−(t − t_i)/τ).
"""

from math import copysign, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.least_squares import Floats

Numbers = NDArray[Any]
"""Array of real or complex numbers."""

_LARGEST_EXPONENT = 500.0
"""Largest exponent used, so that `exp` does not overflow."""


class Knots(NamedTuple):
    """A piecewise linear command, with possible jumps between the pieces."""

    time: Floats
    """(n,), start of each piece, s, not decreasing."""
    value: Floats
    """(n,), value at the start of each piece."""
    slope: Floats
    """(n,), slope of each piece, per second."""


def held_commands(time: Floats, commanded: Floats, tolerance: float = 0.0) -> Knots:
    """Commands (n,), each held from its time (n,) until the next.

    A command begins a new piece only if it differs by more than `tolerance` from the latest piece.
    Otherwise noise in the commands would make many pieces, which take long to compute.
    """
    piece_starts, latest_value = [], np.inf
    for index, value in enumerate(commanded.tolist()):
        if abs(value - latest_value) > tolerance:
            piece_starts.append(index)
            latest_value = value
    return Knots(time[piece_starts], commanded[piece_starts], np.zeros(len(piece_starts)))


def slew_limited(commands: Knots, slew: float) -> Knots:
    """Held commands after the slew limit `slew` (per second), from the first command on."""
    start = _start_values(commands, slew)
    change = commands.value - start
    arrival = commands.time + np.abs(change) / slew
    ramps = np.column_stack((commands.time, start, np.copysign(slew, change)))
    holds = np.column_stack((arrival, commands.value, np.zeros(change.size)))
    has_ramp, has_hold = arrival > commands.time, arrival < np.append(commands.time[1:], np.inf)
    # Each ramp is followed by a hold; ramps and holds of no duration are left out.
    rows = np.stack((ramps, holds), axis=1).reshape(-1, 3)
    return Knots(*rows[np.column_stack((has_ramp, has_hold)).ravel()].T)


def _start_values(commands: Knots, slew: float) -> Floats:
    """(n,), output of the slew limit at the time of each command.

    The computation needs a loop, because each ramp starts where the previous ramp ended.
    """
    output = float(commands.value[0])
    outputs, largest_changes = [output], slew * np.diff(commands.time)
    for command, largest_change in zip(
        commands.value[:-1].tolist(), largest_changes.tolist(), strict=True
    ):
        change = command - output
        if change > largest_change:
            output += largest_change
        elif change < -largest_change:
            output -= largest_change
        else:
            output = command
        outputs.append(output)
    return np.array(outputs)


def first_order_response(commands: Knots, lag: complex, times: Floats) -> Numbers:
    """(m,), response of a first-order lag of `lag` > 0 s to the commands, at `times`, s.

    The response starts in the steady state of the first command. No time may be before it.

    The lag may be complex: an underdamped second-order response is a weighted sum of two such
    responses with complex conjugate lags.
    """
    steady_output = commands.value - commands.slope * lag
    steady_at_ends = steady_output[:-1] + commands.slope[:-1] * np.diff(commands.time)
    jumps = np.concatenate(
        ([commands.value[0] - steady_output[0]], steady_at_ends - steady_output[1:])
    )
    transients = _transients_at_knots(commands.time / lag, jumps)
    pieces = np.searchsorted(commands.time, times, side="right") - 1
    elapsed = times - commands.time[pieces]
    steady_response = steady_output[pieces] + commands.slope[pieces] * elapsed
    response: Numbers = steady_response + transients[pieces] * np.exp(-elapsed / lag)
    return response


def _transients_at_knots(scaled_times: Numbers, jumps: Numbers) -> Numbers:
    """(n,), at each knot the sum of the jumps so far, each decayed by exp(−elapsed time / lag).

    `scaled_times` are the times of the knots divided by the lag. The sums are computed in parts so
    short that no exponential overflows.
    """
    transients = np.empty_like(jumps)
    real_times = np.real(scaled_times)
    start, previous_sum = 0, 0.0 * jumps[0]
    while start < jumps.size:
        end = int(np.searchsorted(real_times, real_times[start] + _LARGEST_EXPONENT, side="right"))
        growth = np.exp(scaled_times[start:end] - scaled_times[start])
        transients[start:end] = (previous_sum + np.cumsum(jumps[start:end] * growth)) / growth
        if end < jumps.size:
            elapsed = scaled_times[end] - scaled_times[end - 1]
            previous_sum = transients[end - 1] * np.exp(-elapsed)
        start = end
    return transients


def value_at(commands: Knots, times: Floats) -> Floats:
    """(m,), values of the commands at `times` (m,), s; none may be before the first knot."""
    piece = np.searchsorted(commands.time, times, side="right") - 1
    return commands.value[piece] + commands.slope[piece] * (times - commands.time[piece])


_NEARLY_CRITICAL = 1e-6
"""Smallest |ζ² − 1| that is used; at 0 both lags would be equal, with a division by 0."""


def second_order_response(
    commands: Knots, frequency: float, damping: float, times: Floats
) -> Floats:
    """(m,), response of a second-order lag, from the steady state of the first command.

    Args:
        commands: the commands; no time in `times` may be before the first knot.
        frequency: natural frequency ω, rad/s.
        damping: damping ratio ζ.
        times: (m,), times, s.
    """
    first_lag, second_lag = _two_lags(frequency, damping)
    if first_lag.imag:
        return (
            np.imag(first_lag * first_order_response(commands, first_lag, times)) / first_lag.imag
        )
    slow_lag, quick_lag = first_lag.real, second_lag.real
    slow_response = first_order_response(commands, slow_lag, times)
    quick_response = first_order_response(commands, quick_lag, times)
    return (slow_lag * slow_response - quick_lag * quick_response) / (slow_lag - quick_lag)


def second_order_free_responses(elapsed: Floats, frequency: float, damping: float) -> Floats:
    """(m, 2), two independent free responses of a second-order lag.

    Args:
        elapsed: (m,), time after the start, s.
        frequency: natural frequency ω, rad/s.
        damping: damping ratio ζ.
    """
    first_lag, second_lag = _two_lags(frequency, damping)
    if first_lag.imag:
        oscillation = np.exp(-elapsed / first_lag)
        return np.column_stack((np.real(oscillation), np.imag(oscillation)))
    slow_decay, quick_decay = np.exp(-elapsed / first_lag.real), np.exp(-elapsed / second_lag.real)
    # The second column is a difference, so that the two stay independent near critical damping.
    return np.column_stack(
        (slow_decay, (slow_decay - quick_decay) / (first_lag.real - second_lag.real))
    )


def _two_lags(frequency: float, damping: float) -> tuple[complex, complex]:
    """The two first-order lags of a second-order lag, s: the longer first, or a conjugate pair."""
    discriminant = damping * damping - 1.0
    discriminant = copysign(max(abs(discriminant), _NEARLY_CRITICAL), discriminant)
    root = complex(0.0, sqrt(-discriminant)) if discriminant < 0.0 else complex(sqrt(discriminant))
    return 1.0 / (frequency * (damping - root)), 1.0 / (frequency * (damping + root))
