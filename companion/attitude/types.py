"""Types of the attitude law, and the errors it raises: tuples of floats, SI units, radians."""

from typing import NamedTuple

Quaternion = tuple[float, float, float, float]
"""(w, x, y, z), Hamilton product, rotates body (FRD) into world (NED)."""


class TiltYaw(NamedTuple):
    """An attitude as tilt ⊗ yaw = [a, x, y, 0] ⊗ [b, 0, 0, z] (equation 9).

    a is cos(tilt/2), so it is 0 only for an exactly inverted vehicle.
    """

    a: float
    b: float
    x: float
    y: float
    z: float


class Coefficients(NamedTuple):
    """Horizontal acceleration per specific thrust, (a_N, a_E) (equation 10); |c| = sin(tilt)."""

    north: float
    east: float


class BodyRates(NamedTuple):
    """Angular velocity in rad/s about body x, y, z (FRD)."""

    roll: float
    pitch: float
    yaw: float


class Target(NamedTuple):
    """The setpoint that guidance gives a planner.

    `north`, `east` are the wanted acceleration coefficients; `heading` is the wanted tilt-yaw
    heading in rad, and `heading_rate` the feedforward of the heading in rad/s.
    """

    north: float
    east: float
    heading: float
    heading_rate: float = 0.0


class AttitudeError(ValueError):
    """The input or the result of a planner is invalid; no setpoint must be sent for this sample."""


class InvalidQuaternionError(AttitudeError):
    """A quaternion is not four finite numbers, or its norm differs from 1 by more than 1e-3."""


class InvalidTargetError(AttitudeError):
    """A target is not three or four numbers, or a value is not finite or far too large."""


class InvalidBodyRatesError(AttitudeError):
    """Body rates are not three numbers."""


class InvalidPeriodError(AttitudeError):
    """A sample period is not positive and finite."""
