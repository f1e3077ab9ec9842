"""Converts attitudes to coefficients and heading and back; checks a planner's input.

Equations are those of the paper (`companion.attitude`); a, b, x, y, z are the fields of `TiltYaw`.
"""

from math import atan2, inf, pi, sqrt

from companion.attitude.kinematics import half_tilt_products, split
from companion.attitude.rotation import attitude_of
from companion.attitude.types import (
    BodyRates,
    Coefficients,
    InvalidBodyRatesError,
    InvalidPeriodError,
    InvalidQuaternionError,
    InvalidTargetError,
    Quaternion,
    Target,
    TiltYaw,
)

NORM_TOLERANCE = 1e-3
"""Largest deviation of a quaternion's norm from 1."""
_LARGEST_BODY_RATE = 100.0
"""Largest plausible body rate of a measurement, rad/s."""


def is_unit(q: Quaternion) -> bool:
    """Whether a planner accepts `q`: finite, and with a norm within 1e-3 of 1."""
    w, x, y, z = q
    norm = sqrt(w * w + x * x + y * y + z * z)
    return abs(norm - 1.0) <= NORM_TOLERANCE  # false for NaN, too


def normalised(q: Quaternion) -> Quaternion:
    """Return `q` with unit norm.

    Raises:
        InvalidQuaternionError: `q` is not four numbers, its norm differs from 1 by more than 1e-3,
            or a component is not finite.
    """
    try:
        w, x, y, z = q
        norm = sqrt(w * w + x * x + y * y + z * z)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidQuaternionError(
            f"an attitude quaternion must be four numbers: {error}"
        ) from error
    if not abs(norm - 1.0) <= NORM_TOLERANCE:  # written so that NaN is refused too
        raise InvalidQuaternionError(
            f"attitude quaternion {q} has norm {norm:.6g}; expected 1 within {NORM_TOLERANCE:g}"
        )
    return w / norm, x / norm, y / norm, z / norm


def wrap_angle(angle: float) -> float:
    """Wrap an angle in rad to (−π, π]."""
    wrapped = angle % (2.0 * pi)
    return wrapped - 2.0 * pi if wrapped > pi else wrapped


def decompose(q: Quaternion) -> TiltYaw:
    """Split an attitude into tilt ⊗ yaw (paper, equation 9).

    Raises:
        InvalidQuaternionError: `q` is not a unit quaternion; see `normalised`.
    """
    return TiltYaw(*split(*normalised(q)))


def coefficients(q: Quaternion) -> Coefficients:
    """Acceleration coefficients (−2ay, +2ax) of an attitude, with a, x, y of `decompose`.

    The norm of the coefficients is sin(tilt) (paper, equation 10).

    Raises:
        InvalidQuaternionError: `q` is not a unit quaternion; see `normalised`.
    """
    _, ax, ay = half_tilt_products(*normalised(q))
    return Coefficients(-2.0 * ay, 2.0 * ax)


def heading(q: Quaternion) -> float:
    """Tilt-yaw heading 2·atan2(z, b) in rad, in (−π, π], with z and b of `decompose`.

    When level, it equals the Euler yaw that an autopilot reports; tilted, it differs in general.

    Raises:
        InvalidQuaternionError: `q` is not a unit quaternion; see `normalised`.
    """
    w, _, _, z = normalised(q)
    return wrap_angle(2.0 * atan2(z, w))


def attitude(coefficients: Coefficients, heading: float) -> Quaternion:
    """The upright attitude that has these coefficients and this tilt-yaw heading (rad).

    Raises:
        ValueError: the norm of the coefficients exceeds 1, so no attitude has them, or a number is
            not finite.
    """
    north, east = coefficients
    if not north * north + east * east <= 1.0:
        raise ValueError(f"no attitude has the coefficients {coefficients}: their norm exceeds 1")
    if not -inf < heading < inf:
        raise ValueError(f"a heading must be finite, not {heading} rad")
    return attitude_of(north, east, heading)


LARGEST_HEADING_RATE = 1e9
"""Largest heading rate of a target, rad/s; with more, the rates to send might not be finite."""


def require_period(dt: float) -> None:
    """Refuse a sample period that is not positive and finite.

    Raises:
        InvalidPeriodError: the period `dt` is 0 s, negative, infinite or NaN.
    """
    if not 0.0 < dt < inf:
        raise InvalidPeriodError(f"the sample period dt must be positive and finite, not {dt} s")


def limited_target(target: Target, max_norm: float) -> Target:
    """`target` with its coefficients shortened to `max_norm`, and its heading wrapped to (−π, π].

    Raises:
        InvalidTargetError: `target` is not three or four numbers, or a value is not finite or far
            too large.
    """
    try:
        if not isinstance(target, Target):  # a plain tuple is accepted
            target = Target(*target)
        north, east, heading, heading_rate = target
        norm_squared = 0.0 + north * north + east * east  # an int too large for a float raises
        is_usable = (
            -inf < norm_squared + heading < inf and abs(heading_rate) <= LARGEST_HEADING_RATE
        )
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidTargetError(f"a target must be three or four numbers: {error}") from error
    if not is_usable:
        raise InvalidTargetError(f"target is not finite, or far too large: {target}")
    if norm_squared <= max_norm * max_norm and -pi < heading <= pi:
        return target
    scale = min(1.0, max_norm / sqrt(norm_squared)) if norm_squared > 0.0 else 1.0
    return Target(scale * north, scale * east, wrap_angle(heading), heading_rate)


def plausible_rates(body_rates: BodyRates | None) -> BodyRates | None:
    """`body_rates`, or None if one of them is NaN or implausibly large.

    Raises:
        InvalidBodyRatesError: `body_rates` are not three numbers.
    """
    if body_rates is None:
        return None
    try:
        roll, pitch, yaw = body_rates
        limit = _LARGEST_BODY_RATE
        if abs(roll) < limit and abs(pitch) < limit and abs(yaw) < limit:
            return BodyRates(roll, pitch, yaw)
    except (TypeError, ValueError) as error:
        raise InvalidBodyRatesError(f"body rates must be three numbers: {error}") from error
    return None
