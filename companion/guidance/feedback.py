"""Feedback: linear-quadratic gains for the horizontal position, and a cascade for the height."""

from dataclasses import dataclass
from math import isfinite

import numpy as np

from companion.drag import Drag
from companion.guidance.reference import GRAVITY, Reference, VehicleMotion, VerticalMode


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights of the cost ∫ position·e_p² + velocity·e_v² + u² dt of the horizontal feedback.

    e_p and e_v are the errors of position and velocity; u is the acceleration that feedback adds.

    Attributes:
        position: weight of the position error, 1/s⁴.
        velocity: weight of the velocity error, 1/s².

    Raises:
        ValueError: a weight is negative or not finite, or the position's weight is 0.
    """

    position: float
    velocity: float

    def __post_init__(self) -> None:
        if not (isfinite(self.position) and self.position > 0.0):
            raise ValueError(
                f"the weight of the position error must be positive, not {self.position}"
            )
        if not (isfinite(self.velocity) and self.velocity >= 0.0):
            raise ValueError(
                f"the weight of the velocity error must be 0 or more, not {self.velocity}"
            )


@dataclass(frozen=True, slots=True)
class HorizontalGains:
    """Gains of the feedback u = −(position·e_p + velocity·e_v + acceleration·e_a), u in m/s².

    Attributes:
        position: gain on the position error e_p, 1/s².
        velocity: gain on the velocity error e_v, 1/s.
        acceleration: gain on the acceleration error e_a, without unit.
    """

    position: float
    velocity: float
    acceleration: float


def horizontal_gains(weights: Weights, lag: float, drag: float = 0.0) -> HorizontalGains:
    """The optimal gains (LQR) for ė_p = e_v, ė_v = e_a − drag·e_v, ė_a = (u − e_a)/lag.

    X and Y are the upper and lower halves of the stable eigenvectors of the Hamiltonian matrix.
    Y·X⁻¹ solves the algebraic Riccati equation.

    Args:
        weights: weights of the cost.
        lag: lag of the acceleration behind its command, s, positive.
        drag: linear drag per mass, 1/s.

    Raises:
        ValueError: the lag is not positive and finite, or no positive and finite gains follow.
    """
    if not (isfinite(lag) and lag > 0.0):
        raise ValueError(f"the lag of the acceleration must be positive and finite, not {lag}")
    a = np.array([[0.0, 1.0, 0.0], [0.0, -drag, 1.0], [0.0, 0.0, -1.0 / lag]])
    b = np.array([[0.0], [0.0], [1.0 / lag]])
    q = np.diag([weights.position, weights.velocity, 0.0])
    eigenvalues, eigenvectors = np.linalg.eig(np.block([[a, -b @ b.T], [-q, -a.T]]))
    stable_eigenvectors = eigenvectors[:, np.argsort(eigenvalues.real)[:3]]
    riccati = np.real(stable_eigenvectors[3:] @ np.linalg.inv(stable_eigenvectors[:3]))
    position, velocity, acceleration = (b.T @ riccati)[0].tolist()
    gains = HorizontalGains(position, velocity, acceleration)
    if not all(isfinite(gain) and gain > 0.0 for gain in (position, velocity, acceleration)):
        raise ValueError(f"no positive and finite gains follow from {weights}: {gains}")
    return gains


_LARGEST_VERTICAL_ACCELERATION = 0.5 * GRAVITY
"""Largest acceleration that is commanded up or down, m/s²."""


@dataclass(frozen=True, slots=True)
class HeightGains:
    """Gains and limits of the height cascade.

    Attributes:
        height: vertical speed per height error, 1/s.
        climb: vertical acceleration per error of the vertical speed, 1/s.
        max_climb: largest climb rate, m/s.
        max_descent: largest descent rate, m/s.
    """

    height: float
    climb: float
    max_climb: float
    max_descent: float


def acceleration_down(
    gains: HeightGains,
    reference: Reference,
    motion: VehicleMotion,
    future_reference: Reference,
    drag: Drag,
) -> float:
    """Acceleration that thrust and gravity together shall give, m/s² downwards, from −g/2 to g/2.

    Args:
        gains: gains and limits of the height cascade.
        reference: the reference now.
        motion: the present motion.
        future_reference: the reference one rotor lag later; its acceleration and velocity are fed
            forward.
        drag: drag of the vehicle, which thrust balances in climb and descent; with
            `VerticalMode.ACCELERATION` neither drag nor feedback is added.
    """
    acceleration = future_reference.acceleration_ned[2]
    if reference.vertical is not VerticalMode.ACCELERATION:
        error = reference.position_ned[2] - motion.position_ned[2]
        speed = reference.velocity_ned[2] + gains.height * error
        speed = min(max(speed, -gains.max_climb), gains.max_descent)
        acceleration += gains.climb * (speed - motion.velocity_ned[2])
        acceleration += drag.deceleration(future_reference.velocity_ned)[2]
    return min(max(acceleration, -_LARGEST_VERTICAL_ACCELERATION), _LARGEST_VERTICAL_ACCELERATION)
