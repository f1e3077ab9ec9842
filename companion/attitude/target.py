"""What guidance may ask, made fit for a law."""

from math import inf, pi, sqrt

from companion.attitude.errors import InvalidTargetError
from companion.attitude.representation import wrap_angle
from companion.attitude.types import Target


def admissible(target: Target, longest: float) -> Target:
    """`target` itself, or with its coefficients shortened to `longest` and its heading wrapped.

    Raises:
        InvalidTargetError: a value is not finite.
    """
    north, east, heading, heading_rate = target
    square = north * north + east * east
    if not -inf < square + heading + heading_rate < inf:
        raise InvalidTargetError(f"target is not finite, or far too large: {target}")
    if square <= longest * longest and -pi < heading <= pi:
        return target
    scale = min(1.0, longest / sqrt(square)) if square > 0.0 else 1.0
    return Target(scale * north, scale * east, wrap_angle(heading), heading_rate)
