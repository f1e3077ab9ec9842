"""The one way to a planner: by its name."""

from collections.abc import Callable
from typing import Any, Protocol

from companion.attitude.first_order import FirstOrderPlanner
from companion.attitude.limits import Limits
from companion.attitude.types import BodyRates, Quaternion, Target


class Planner(Protocol):
    """Turns one attitude sample and the newest target into body rates."""

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """One step: rates in rad/s for attitude `q`; `dt` is the sample period in s."""
        ...


_PLANNERS: dict[str, Callable[..., Planner]] = {"first-order": FirstOrderPlanner}

PLANNER_NAMES = tuple(_PLANNERS)


def make_planner(
    name: str,
    gain: float = 5.0,
    yaw_gain: float = 2.0,
    limits: Limits = Limits(),  # noqa: B008  (frozen)
    **options: Any,
) -> Planner:
    """Make a planner by its name.

    Args:
        name: one of `PLANNER_NAMES`.
        gain: p in 1/s, the inverse of the time constant asked for.
        yaw_gain: gain of the heading error, 1/s.
        limits: bounds on tilt and rates.
        options: what the named planner takes beyond these.

    Raises:
        ValueError: unknown name, or a value out of range.
    """
    if name not in _PLANNERS:
        raise ValueError(f"unknown planner {name!r}; known: {', '.join(PLANNER_NAMES)}")
    return _PLANNERS[name](gain=gain, yaw_gain=yaw_gain, limits=limits, **options)
