"""Flies one vehicle with a model of its rate loop, compiled.

The model has a dead time, a slew limit and a lag for each axis. `companion.batch.loops` steps all
vehicles together, with an ideal rate loop and the same gains and limits. In this module, a call
flies a single vehicle from beginning to end. Each vehicle may therefore have its own limits, gains
and rate loop, and the memory does not grow with the number of vehicles.
"""

from collections.abc import Callable, Sequence
from functools import cache
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.attitude.kinematics import half_tilt_products
from companion.attitude.limits import Constants
from companion.attitude.planner import Law, LawPlanner
from companion.attitude.rate_response import AxisResponse
from companion.attitude.reference import Lag, lag_step
from companion.attitude.rotation import after_constant_rates, clamp
from companion.attitude.types import Quaternion
from companion.batch.compiler import Compiler
from companion.batch.loops import Array
from companion.extras import require

STEP_HZ = 1000
"""Simulation steps per second; dead times are rounded to whole steps."""
_UNLIMITED = 1e300
"""Largest change of the command per step on an axis without a slew limit, rad/s."""


class StepFlight(NamedTuple):
    """One vehicle's flight, with one row for each attitude sample of the planner.

    Attributes:
        coefficients: (samples, 2), coefficients north and east at the sample.
        targets: (samples, 2), target coefficients at the sample.
        commanded_rates: (samples, 3), commanded body rates, rad/s.
        q: attitude at the end.
    """

    coefficients: Array
    targets: Array
    commanded_rates: Array
    q: Quaternion


def fly_steps(
    planner: LawPlanner,
    axes: Sequence[AxisResponse],
    start: Quaternion,
    targets: Array,
    steps_per_sample: int,
) -> StepFlight:
    """Fly one vehicle from rest; it follows one target after the other.

    Args:
        planner: gives the law and its constants.
        axes: response of roll, pitch and yaw to commanded body rates.
        start: attitude, body → world.
        targets: (samples, 4), targets within the limits: coefficients north and east, heading in
            rad, heading rate in rad/s.
        steps_per_sample: simulation steps from one sample to the next.

    Raises:
        MissingExtraError: numba is not installed.
    """
    require("numba", "study", "a compiled batch")
    coefficients, commanded_rates = np.empty((len(targets), 2)), np.empty((len(targets), 3))
    responses, delays = _response_arrays(axes)
    fly = _compiled(planner.law)
    q = fly(
        start,
        targets,
        responses,
        delays,
        planner.constants,
        steps_per_sample,
        coefficients,
        commanded_rates,
    )
    return StepFlight(coefficients, targets[:, :2], commanded_rates, q)


def _response_arrays(axes: Sequence[AxisResponse]) -> tuple[Array, NDArray[np.int64]]:
    """The responses of the axes as the arrays `responses` and `delays` of `fly`.

    Returns:
        (3, 7), for each axis: lag (s) and σ (s²) of `Lag`, largest change of the acting command per
        step (rad/s), and the 2x2 transition matrix of `Lag.transition`, row by row;
        (3,), dead times in steps.
    """
    response_rows = []
    for axis in (each.with_least_lag() for each in axes):
        max_change = axis.acceleration / STEP_HZ if isfinite(axis.acceleration) else _UNLIMITED
        transition = Lag(axis.lag, axis.sigma).transition(1.0 / STEP_HZ)
        response_rows.append((axis.lag, axis.sigma, max_change, *transition))
    return np.array(response_rows), np.array([round(axis.dead_time * STEP_HZ) for axis in axes])


@cache
def _compiled(law: Law) -> Callable[..., Quaternion]:
    """Compile the flight of one vehicle under `law`."""
    compiler = Compiler({})
    vehicle_law = compiler.compile_function(law)
    rotate = compiler.compile_function(after_constant_rates)
    lag_response = compiler.compile_function(lag_step)
    clamp_change = compiler.compile_function(clamp)
    tilt_products = compiler.compile_function(half_tilt_products)
    dt = 1.0 / STEP_HZ

    def fly(
        q: Quaternion,
        targets: Array,
        responses: Array,
        delays: NDArray[np.int64],
        constants: Constants,
        steps_per_sample: int,
        coefficients: Array,
        commanded_rates: Array,
    ) -> Quaternion:
        buffer_size = delays.max() + 1
        commands = np.zeros((buffer_size, 3))  # ring buffer of the newest commands
        slewed_rates, rates, slopes, mean_rates = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
        k = 0
        for sample in range(targets.shape[0]):
            target = targets[sample, 0], targets[sample, 1], targets[sample, 2], targets[sample, 3]
            _, ax, ay = tilt_products(q[0], q[1], q[2], q[3])
            coefficients[sample, 0], coefficients[sample, 1] = -2.0 * ay, 2.0 * ax
            roll, pitch, yaw = vehicle_law(q, target, steps_per_sample * dt, constants)
            commanded_rates[sample, 0], commanded_rates[sample, 1] = roll, pitch
            commanded_rates[sample, 2] = yaw
            for _ in range(steps_per_sample):
                slot = k % buffer_size
                commands[slot, 0], commands[slot, 1], commands[slot, 2] = roll, pitch, yaw
                for axis in range(3):
                    delayed = commands[(k + buffer_size - delays[axis]) % buffer_size, axis]
                    response = responses[axis]
                    lag, sigma, max_change = response[0], response[1], response[2]
                    slewed_rates[axis] += clamp_change(delayed - slewed_rates[axis], max_change)
                    transition = response[3], response[4], response[5], response[6]
                    angle, rates[axis], slopes[axis] = lag_response(
                        rates[axis], slopes[axis], slewed_rates[axis], dt, lag, sigma, transition
                    )
                    mean_rates[axis] = angle / dt
                q = rotate(q, (mean_rates[0], mean_rates[1], mean_rates[2]), dt)
                k += 1
        return q

    compiled: Any = compiler.compile_loop(fly)
    return compiled  # type: ignore[no-any-return]
