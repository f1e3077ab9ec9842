"""What guidance may ask, made fit for a law."""

from math import inf, pi, sqrt

from companion.attitude.errors import InvalidTargetError
from companion.attitude.representation import wrap_angle
from companion.attitude.types import Target

LARGEST_HEADING_RATE = 1e9
"""rad/s; nothing turns so fast, and what is led by a lag must stay finite."""


def admissible(target: Target, longest: float) -> Target:
    """`target` itself, or with its coefficients shortened to `longest` and its heading wrapped.

    Raises:
        InvalidTargetError: these are not four numbers, or a value is not finite or far too large.
    """
    try:
        if not isinstance(target, Target):  # a plain tuple will do
            target = Target(*target)
        north, east, heading, heading_rate = target
        square = 0.0 + north * north + east * east  # an int too large for a float raises
        usable = -inf < square + heading < inf and abs(heading_rate) <= LARGEST_HEADING_RATE
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidTargetError(f"a target is three or four numbers: {error}") from error
    if not usable:
        raise InvalidTargetError(f"target is not finite, or far too large: {target}")
    if square <= longest * longest and -pi < heading <= pi:
        return target
    scale = min(1.0, longest / sqrt(square)) if square > 0.0 else 1.0
    return Target(scale * north, scale * east, wrap_angle(heading), heading_rate)
