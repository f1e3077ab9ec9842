"""The errors of a navigation filter between two fixes, in closed form and without side effects.

Horizontal vectors are complex numbers, north + j east. The functions can be compiled.
"""

from math import exp
from typing import NamedTuple

from sitl_mock.physics.height_error import HeightError
from sitl_mock.physics.quaternion import Vector
from sitl_mock.physics.rigid_body import GRAVITY, Motion

Errors = tuple[complex, complex, complex]
"""Errors of position (m), velocity (m/s), acceleration (m/s^2, from errors of roll and pitch)."""
TruthRow = tuple[*Motion, *Vector, *Vector]
"""The true motion after a step. Elements 0 to 9: `Motion`; 10 to 12: position (NED, m);
13 to 15: mean acceleration (NED, m/s^2)."""
TruthHistory = list[TruthRow]
"""Rows of the latest steps in a ring buffer; an array if the steps are compiled."""


class ErrorVectors(NamedTuple):
    """Estimate minus truth, NED: position (m), velocity (m/s), attitude (small rotation, rad)."""

    position: Vector
    velocity: Vector
    attitude: Vector


class ErrorState(NamedTuple):
    """Either the horizontal or the vertical errors after a fix."""

    errors: Errors
    pending_corrections: tuple[complex, complex]
    """Corrections of position (m) and velocity (m/s) that the output does not yet contain."""
    noise: tuple[complex, complex]
    """Noise of the latest fix: position, m, and velocity, m/s."""


class FilterState(NamedTuple):
    """All errors after a fix, and the true motion at its fusion time."""

    horizontal: ErrorState
    vertical: ErrorState
    yaw: float  # heading error, rad
    pending_yaw: float  # part of `yaw` that the output does not yet contain, rad
    noiseless_yaw: float  # heading error without its noise, rad
    height: HeightError
    fused_at: float  # fusion time of the fix, s
    corrected_at: float  # time at which the fix corrected the errors, s
    position: complex  # true position at the fusion time, m
    velocity: complex  # true velocity at the fusion time, m/s


class ErrorConstants(NamedTuple):
    """Constants of the errors between two fixes."""

    lead_time: float  # position error per velocity, and velocity error per acceleration, s
    acceleration_error: float  # relative error of the acceleration
    tilt_bias: complex  # constant rotation about north + j east, rad
    height_offset: float  # true minus estimated height, m
    predictor_ms: float  # time constant with which the output follows a correction, ms
    heading_predictor_ms: float  # the same for the heading, ms


def extrapolated_errors(errors: Errors, elapsed: float) -> Errors:
    """Return the errors ``elapsed`` s later, without new disturbances."""
    position, velocity, acceleration = errors
    return (
        position + elapsed * (velocity + 0.5 * elapsed * acceleration),
        velocity + elapsed * acceleration,
        acceleration,
    )


def pending_correction_fraction(predictor_ms: float, state: FilterState, now: float) -> float:
    """Return the fraction of the latest corrections that the output does not yet contain at `now`.

    ``predictor_ms`` is the time constant with which the output follows a correction.
    """
    return exp((state.corrected_at - now) * 1e3 / predictor_ms)


def propagated_horizontal_errors(
    constants: ErrorConstants, state: FilterState, truth: TruthRow, elapsed: float
) -> Errors:
    """Return the horizontal errors ``elapsed`` s after the fix.

    The filter integrated an acceleration that was rotated by the heading error, and scaled by the
    relative error of the acceleration.
    """
    position, velocity, acceleration = extrapolated_errors(state.horizontal.errors, elapsed)
    relative_error = complex(constants.acceleration_error, state.yaw)
    fused_velocity = state.velocity
    displacement = complex(truth[10], truth[11]) - state.position
    return (
        position + relative_error * (displacement - elapsed * fused_velocity),
        velocity + relative_error * (complex(truth[0], truth[1]) - fused_velocity),
        acceleration,
    )


def propagated_vertical_errors(
    constants: ErrorConstants, state: FilterState, truth: TruthRow, elapsed: float
) -> Errors:
    """Return the vertical errors (down) ``elapsed`` s after the fix; only the real parts count.

    With the tilt bias, a part of the horizontal acceleration (tilt times acceleration) appears
    vertical to the filter.
    """
    down, sink_rate, acceleration = extrapolated_errors(state.vertical.errors, elapsed)
    tilt_factor, fused_velocity = constants.tilt_bias.conjugate(), state.velocity
    displacement = complex(truth[10], truth[11]) - state.position
    return (
        down + (tilt_factor * (displacement - elapsed * fused_velocity)).imag,
        sink_rate + (tilt_factor * (complex(truth[0], truth[1]) - fused_velocity)).imag,
        acceleration,
    )


def error_at(
    constants: ErrorConstants, state: FilterState, truth: TruthRow, now: float
) -> ErrorVectors:
    """Return the error of the estimate at time ``now`` (s); ``truth`` is the true motion (pure)."""
    elapsed = now - state.fused_at
    pending_fraction = pending_correction_fraction(constants.predictor_ms, state, now)
    pending_yaw_fraction = pending_correction_fraction(constants.heading_predictor_ms, state, now)
    position, velocity, acceleration = propagated_horizontal_errors(
        constants, state, truth, elapsed
    )
    pending = state.horizontal.pending_corrections
    position += constants.lead_time * complex(truth[0], truth[1]) - pending_fraction * pending[0]
    velocity += constants.lead_time * complex(truth[13], truth[14]) - pending_fraction * pending[1]
    down, sink_rate, _ = propagated_vertical_errors(constants, state, truth, elapsed)
    pending = state.vertical.pending_corrections
    height = state.height
    slow_down = height.down + height.down_rate * (now - state.corrected_at)
    down += constants.height_offset + slow_down - pending_fraction * pending[0]
    slow_sink = height.sink_by_acceleration + height.sink_noise
    return ErrorVectors(
        (position.real, position.imag, down.real),
        (
            velocity.real,
            velocity.imag,
            (sink_rate - pending_fraction * pending[1]).real + slow_sink,
        ),
        # A wrong attitude rotates the thrust, which makes the acceleration wrong.
        (
            acceleration.imag / GRAVITY + constants.tilt_bias.real,
            -acceleration.real / GRAVITY + constants.tilt_bias.imag,
            state.yaw - pending_yaw_fraction * state.pending_yaw,
        ),
    )
