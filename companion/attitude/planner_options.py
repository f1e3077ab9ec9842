"""Checks the options of `make_planner`, and makes `model-following` from its many options."""

from collections.abc import Mapping
from math import inf
from typing import Any

from companion.attitude.limits import Constants, Limits, make_constants
from companion.attitude.model_following import ModelFollowingPlanner
from companion.attitude.rate_response import AxisResponse, RateLoopResponse


def constants_of(
    name: str, gain: float, yaw_gain: float, limits: Limits, options: Mapping[str, Any]
) -> Constants:
    """The constants of the planner `name`, whose only option is `recovery_angle`.

    Raises:
        TypeError: there is an option that the planner `name` does not take.
    """
    unknown_options = [option for option in options if option != "recovery_angle"]
    if unknown_options:
        raise TypeError(f"planner {name!r} does not take the option {unknown_options[0]!r}")
    return make_constants(gain, yaw_gain, limits, **options)


def make_model_following(
    gain: float,
    yaw_gain: float,
    limits: Limits,
    *,
    lag: float | None = None,
    dead_time: float | None = None,
    damping: float | None = None,
    acceleration: float | None = None,
    pitch_lag: float | None = None,
    pitch_dead_time: float | None = None,
    pitch_damping: float | None = None,
    pitch_acceleration: float | None = None,
    yaw_lag: float | None = None,
    yaw_dead_time: float | None = None,
    yaw_acceleration: float | None = None,
    frame_lead: float | None = None,
    **options: Any,
) -> ModelFollowingPlanner:
    """Make the planner `model-following`; `companion.attitude.make_planner` explains the options.

    Raises:
        TypeError: the planner does not take an option.
        ValueError: `lag` or `dead_time` is missing, or a value is out of range.
    """
    if lag is None or dead_time is None:
        raise ValueError(
            "model-following needs lag and dead_time, s: the response of the vehicle's rate loop, "
            "as `companion identify` measures it, or lag=0.0, dead_time=0.0 for an immediate one"
        )
    roll = AxisResponse(
        lag,
        dead_time,
        inf if acceleration is None else acceleration,
        inf if damping is None else damping,
    )
    if pitch_damping is None:
        pitch_damping = roll.damping if pitch_lag is None else inf
    response = RateLoopResponse(
        roll,
        _filled_from_roll(roll, pitch_lag, pitch_dead_time, pitch_acceleration, pitch_damping),
        _filled_from_roll(roll, yaw_lag, yaw_dead_time, yaw_acceleration, inf),
        frame_lead,
    )
    constants = constants_of("model-following", gain, yaw_gain, limits, options)
    return ModelFollowingPlanner(constants, response)


def _filled_from_roll(
    roll: AxisResponse,
    lag: float | None,
    dead_time: float | None,
    acceleration: float | None,
    damping: float,
) -> AxisResponse:
    """The response of pitch or yaw; None is replaced by the value of roll."""
    return AxisResponse(
        roll.lag if lag is None else lag,
        roll.dead_time if dead_time is None else dead_time,
        roll.acceleration if acceleration is None else acceleration,
        damping,
    )
