"""Whether a trajectory can be flown within limits."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi
from typing import NamedTuple

import numpy as np

from companion.drag import NO_DRAG, Drag
from companion.guidance.trajectory.demand import Motion, demand, require_finite, sampled_motion
from companion.guidance.trajectory.sample import Trajectory, reporting_numerical_errors
from companion.guidance.trajectory.septic_spline import Floats

_ROUNDING = 1e-9
"""Relative tolerance of limits for rounding errors. Some trajectories just meet a limit."""

_TO_DEGREES = 180.0 / pi

TILT_LIMIT = "limits.max_tilt_deg"
"""Configuration key of the tilt limit."""
TILT_RATE_LIMIT = "limits.max_tilt_rate_deg_s"
"""Configuration key of the limit of the roll-pitch rate."""
SLOWER_REMEDY = (
    "fly it more slowly (--slow-down, or flight.slow_down: true, finds how much), or change the "
    "limit"
)
"""The remedy if a slower motion would keep the limit."""


class Violation(NamedTuple):
    """A limit that a trajectory breaks, with the message for the user.

    Attributes:
        limit: configuration key of the limit.
        begin_time: time when the limit is first broken, s.
        time: time when the limit is exceeded most, s.
        text: the message for the user.
        remedy: what the user should do, as the end of a sentence.
        slowing_helps: whether it makes sense to try the trajectory more slowly.
    """

    limit: str
    begin_time: float
    time: float
    text: str
    remedy: str = SLOWER_REMEDY
    slowing_helps: bool = True

    def __str__(self) -> str:
        return self.text


_NOT_NEGATIVE = (
    "max_tilt_rate",
    "max_yaw_rate",
    "min_thrust",
    "max_thrust",
    "full_thrust",
    "max_climb",
    "max_descent",
    "max_speed",
    "gravity",
)


@dataclass(frozen=True, slots=True)
class Envelope:
    """Limits of a trajectory; `None` is no limit. Positions are relative to the start.

    Attributes:
        max_tilt: largest tilt of the thrust from the vertical, rad.
        max_tilt_rate: largest roll-pitch rate, rad/s.
        max_yaw_rate: largest heading rate, rad/s.
        min_thrust: smallest specific thrust, m/s².
        max_thrust: largest specific thrust, m/s².
        full_thrust: specific thrust at a normalised thrust of 1, m/s². If it is given, messages
            show limits.min_thrust and limits.max_thrust as in the configuration (0..1) and in m/s².
        max_climb: largest upward speed, m/s.
        max_descent: largest downward speed, m/s.
        max_speed: largest speed, m/s.
        fence: fence for the positions and for the places where the vehicle would stop.
        drag: drag in still air.
        gravity: gravity, m/s².

    Raises:
        ValueError: a limit is negative or not a number, or `max_tilt` is not in (0, π/2): it may be
            in degrees.
    """

    max_tilt: float | None = None
    max_tilt_rate: float | None = None
    max_yaw_rate: float | None = None
    min_thrust: float | None = None
    max_thrust: float | None = None
    full_thrust: float | None = None
    max_climb: float | None = None
    max_descent: float | None = None
    max_speed: float | None = None
    fence: Callable[[Motion], Violation | None] | None = None
    drag: Drag = NO_DRAG
    gravity: float = 9.80665

    def __post_init__(self) -> None:
        if self.max_tilt is not None and not 0.0 < self.max_tilt < pi / 2.0:
            raise ValueError(f"max_tilt must be in (0, π/2) rad, not {self.max_tilt:g}")
        for name in _NOT_NEGATIVE:
            limit = getattr(self, name)
            # Written so that NaN is refused too: no motion would exceed a limit of NaN.
            if limit is not None and not limit >= 0.0:
                raise ValueError(f"{name} must be 0 or more, or None for no limit, not {limit:g}")


class _LimitedQuantity(NamedTuple):
    """A limited quantity over a motion, and its limit.

    Attributes:
        limit: key of the limit in the configuration.
        limit_value: the limit in SI units; None: no limit.
        values: (m,), the quantity at each time, in the unit of `limit_value`.
        unit_text: unit and quantity as messages show them after the number, such as "° of tilt".
        message_scale: factor from the unit of `limit_value` to the unit in messages.
        is_lower_limit: whether `limit_value` is a lower limit.
        key_scale: `limit_value` divided by the value of the configuration key, which messages then
            show too; None: messages show only `limit_value`.
    """

    limit: str
    limit_value: float | None
    values: Floats
    unit_text: str
    message_scale: float = 1.0
    is_lower_limit: bool = False
    key_scale: float | None = None


def violations(trajectory: Trajectory, envelope: Envelope) -> tuple[Violation, ...]:
    """All limits that a trajectory breaks, in order of time; empty if it can be flown.

    Raises:
        TrajectoryError: the trajectory cannot be computed, or is too long to be checked.
    """
    with reporting_numerical_errors():
        return broken_limits(sampled_motion(trajectory), envelope)


def excess(motion: Motion, envelope: Envelope) -> dict[str, Floats]:
    """Relative excess over each limit at each time, (m,); negative where the limit is kept.

    The fence is not included, because it is checked for a whole motion.
    """
    return {
        quantity.limit: _excess(quantity) / max(abs(quantity.limit_value), _ROUNDING) - _ROUNDING
        for quantity in _limited_quantities(motion, envelope)
        if quantity.limit_value is not None
    }


def motion_violations(motion: Motion, envelope: Envelope) -> tuple[Violation, ...]:
    """All limits that a motion breaks, in order of time.

    Raises:
        TrajectoryError: a numerical error, a number that is not finite, or unequal lengths.
    """
    with reporting_numerical_errors():
        require_finite(motion)
        return broken_limits(motion, envelope)


def broken_limits(motion: Motion, envelope: Envelope) -> tuple[Violation, ...]:
    """Like `motion_violations`, for a caller already within `reporting_numerical_errors`."""
    violations_or_none = [
        _violation(motion.times, quantity) for quantity in _limited_quantities(motion, envelope)
    ]
    if envelope.fence is not None:
        violations_or_none.append(envelope.fence(motion))
    return tuple(sorted((one for one in violations_or_none if one), key=lambda one: one.begin_time))


def _limited_quantities(motion: Motion, envelope: Envelope) -> Iterator[_LimitedQuantity]:
    """All quantities that an envelope can limit, except the fence, over this motion."""
    limits, climb = envelope, -motion.velocity[:, 2]
    demanded = demand(motion, limits.drag, limits.gravity)
    yaw_rate = np.abs(motion.heading_rate)
    speed = np.linalg.norm(motion.velocity, axis=1)
    yield _LimitedQuantity(TILT_LIMIT, limits.max_tilt, demanded.tilt, "° of tilt", _TO_DEGREES)
    yield _LimitedQuantity(
        TILT_RATE_LIMIT,
        limits.max_tilt_rate,
        demanded.tilt_rate,
        "°/s of roll and pitch",
        _TO_DEGREES,
    )
    yield _LimitedQuantity(
        "limits.max_yaw_rate_deg_s", limits.max_yaw_rate, yaw_rate, "°/s of yaw", _TO_DEGREES
    )
    yield _LimitedQuantity(
        "limits.min_thrust",
        limits.min_thrust,
        demanded.thrust,
        " m/s² of thrust",
        is_lower_limit=True,
        key_scale=limits.full_thrust,
    )
    yield _LimitedQuantity(
        "limits.max_thrust",
        limits.max_thrust,
        demanded.thrust,
        " m/s² of thrust",
        key_scale=limits.full_thrust,
    )
    yield _LimitedQuantity("limits.max_climb_m_s", limits.max_climb, climb, " m/s of climb")
    yield _LimitedQuantity("limits.max_descent_m_s", limits.max_descent, -climb, " m/s of descent")
    yield _LimitedQuantity("safety.max_speed_m_s", limits.max_speed, speed, " m/s of speed")


def _excess(quantity: _LimitedQuantity) -> Floats:
    """(m,), excess over the limit in the limit's unit; negative if the limit is kept."""
    limit_value = quantity.limit_value or 0.0
    return (
        limit_value - quantity.values if quantity.is_lower_limit else quantity.values - limit_value
    )


def _violation(times: Floats, quantity: _LimitedQuantity) -> Violation | None:
    if quantity.limit_value is None:
        return None
    quantity_excess = _excess(quantity)
    is_broken = quantity_excess > _ROUNDING * max(abs(quantity.limit_value), 1.0)
    if not is_broken.any():
        return None
    begin_time, time = float(times[np.argmax(is_broken)]), float(times[np.argmax(quantity_excess)])
    worst_value = float(quantity.values[np.argmax(quantity_excess)]) * quantity.message_scale
    limit_value, limit, unit = quantity.limit_value * quantity.message_scale, quantity.limit, ""
    if quantity.key_scale is not None:
        limit, unit = f"{limit} = {quantity.limit_value / quantity.key_scale:.4g}", " m/s²"
    text = (
        f"at {time:.2f} s it needs {worst_value:.4g}{quantity.unit_text}, {limit} allows "
        f"{'no less than ' if quantity.is_lower_limit else ''}{limit_value:.4g}{unit}"
    )
    if begin_time < time:
        text += f" (violated from {begin_time:.2f} s on)"
    return Violation(quantity.limit, begin_time, time, text)
