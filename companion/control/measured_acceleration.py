"""The horizontal acceleration that two positions show, and the thrust between them."""

from typing import NamedTuple

from companion.guidance.reference import NorthEast


class MeasuredAcceleration(NamedTuple):
    """Mean horizontal values between two positions; NED.

    `thrust` follows from the reported attitude, `acceleration` from the reported velocity.
    """

    dt: float
    """Time between the two positions, s."""
    thrust: NorthEast
    """Acceleration by the thrust, m/s²."""
    acceleration: NorthEast
    """Acceleration of the vehicle, m/s²."""
    velocity: NorthEast
    """Velocity, m/s."""
    heading_resets: float
    """Sum of the estimator's heading jumps so far, rad."""
