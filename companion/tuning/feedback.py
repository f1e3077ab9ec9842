"""Frequency response of guidance: motion observer, prediction and feedback gains on one axis."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.guidance import GRAVITY
from companion.guidance.linear import LinearSettings
from companion.guidance.motion_observer import ObserverSettings

Complex = NDArray[np.complex128]


class Feedback(NamedTuple):
    """Responses of the commanded acceleration coefficient to the measurements, sign reversed.

    An acceleration coefficient c is a horizontal acceleration per specific thrust. The command is
    −(tilt·c + velocity·v + position·x), before it is held for a guidance period.
    """

    tilt: Complex
    """Response to the measured coefficient c, (n,)."""
    velocity: Complex
    """Response to the measured velocity v, (n,), s/m."""
    position: Complex
    """Response to the measured position x, (n,), 1/m."""


def hold_element(s: Complex, period: float) -> Complex:
    """(n,), frequency response of a zero-order hold of `period` s at the frequencies `s`, rad/s."""
    return (1.0 - np.exp(-s * period)) / (s * period)


def guidance_feedback(
    s: Complex,
    guidance: LinearSettings,
    observer: ObserverSettings,
    drag: float,
    position_period: float,
) -> Feedback:
    """The feedback of `LinearGuidance` with the states of `MotionObserver`.

    Guidance and observer are linear while no limit is reached. A position is used until the next
    one arrives, so its mean age is half a period; the prediction covers this age.

    Args:
        s: (n,), frequencies, rad/s, none of them 0.
        guidance: gains, response of the tilt and period of guidance.
        observer: settings of the motion observer.
        drag: assumed linear drag of the vehicle, 1/s.
        position_period: time between two position messages, s.
    """
    to_acceleration, to_position, to_velocity = _observer_responses(s, observer, position_period)
    position_age = 0.5 * position_period
    delay = np.exp(-s * position_age)[:, None]
    horizon = position_age + (guidance.tilt.dead_time + 0.5 * guidance.period)
    # The known acceleration is g·c − drag·v; between two positions its newest value is used.
    inputs = (
        (GRAVITY * to_acceleration, GRAVITY),
        (to_velocity - drag * to_acceleration, -drag),
        (to_position, 0.0),
    )
    responses = []
    for observer_response, known_acceleration in inputs:
        position, velocity, disturbance = (delay * observer_response).T
        total_acceleration = disturbance + known_acceleration
        present_velocity = velocity + position_age * total_acceleration
        predicted_velocity = velocity + horizon * total_acceleration
        predicted_position = (
            position + horizon * velocity + 0.5 * horizon * horizon * total_acceleration
        )
        # Drag acts on the observed velocity, not on the measured one.
        tilt_acceleration = max(known_acceleration, 0.0)
        acceleration = tilt_acceleration - drag * present_velocity + disturbance
        gains = guidance.gains
        command = (
            gains.position * predicted_position
            + gains.velocity * predicted_velocity
            + gains.acceleration * acceleration
            + disturbance
        )
        responses.append(command / GRAVITY)
    return Feedback(*responses)


def _observer_responses(
    s: Complex, observer: ObserverSettings, period: float
) -> tuple[Complex, Complex, Complex]:
    """Frequency responses of the motion observer, as three arrays (n, 3).

    The arrays are for three inputs: known acceleration, measured position, measured velocity. The
    columns are the observed position, velocity and disturbance. The observer is
    x = (I − K·C)·(A·x/z + B·a) + K·y, where a is the mean acceleration over the past period.
    """
    # The largest trust, in motion, leaves the smallest margins.
    gains, coupling = observer.gains(period, trust=1.0), observer.coupling(period, trust=1.0)
    a = np.array([[1.0, period, 0.5 * period**2], [0.0, 1.0, period], [0.0, 0.0, 1.0]])
    b = np.array([0.5 * period**2, period, 0.0])
    c = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    k = np.array(
        [
            [gains.position, 0.0],
            [gains.velocity * coupling, gains.velocity],
            [gains.disturbance * coupling, gains.disturbance],
        ]
    )
    i_minus_kc = np.eye(3) - k @ c
    z = np.exp(s * period)
    resolvent = np.linalg.inv(z[:, None, None] * np.eye(3) - i_minus_kc @ a) * z[:, None, None]
    to_acceleration = (resolvent @ (i_minus_kc @ b)) * hold_element(s, period)[:, None]
    to_measurements = resolvent @ k
    return to_acceleration, to_measurements[:, :, 0], to_measurements[:, :, 1]
