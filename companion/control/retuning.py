"""Changes gains, weights and limits of the loops while they fly."""

from math import exp, log
from typing import Any

from companion.attitude import PLANNER_NAMES
from companion.config import Config
from companion.config.guidance import LINEAR
from companion.config.in_flight import Difference, differences
from companion.control.control_loop import ControlLoop
from companion.control.guidance_loop import GuidanceLoop
from companion.control.inner_loop import law_constants, rate_limits
from companion.control.outer_loop import (
    disturbance_bandwidth,
    hold_weights,
    linear_settings,
    observer_settings,
)
from companion.guidance import LinearGuidance


class Retuning:
    """Gives the values of a configuration to the loops of a flight.

    Only the keys that may change in flight have an effect; see `companion.config.in_flight`.

    Args:
        loop: the control loop.
        guidance_loop: the guidance loop.
    """

    def __init__(self, loop: ControlLoop, guidance_loop: GuidanceLoop) -> None:
        self._loop, self._guidance_loop = loop, guidance_loop

    def apply(self, config: Config) -> None:
        """Use the values of `config` from the next sample and the next step on.

        Raises:
            TypeError: planner or guidance is of another package and cannot change.
        """
        guidance_loop = self._guidance_loop
        if not isinstance(guidance_loop.guidance, LinearGuidance):
            raise TypeError(f"{type(guidance_loop.guidance).__name__} cannot be retuned")
        # All values are computed before the first one is used.
        guidance, observer = linear_settings(config), observer_settings(config)
        constants, limits = law_constants(config), rate_limits(config)
        self._loop.retune(constants, limits)
        guidance_loop.guidance.retune(guidance)
        guidance_loop.estimate.retune(observer)
        guidance_loop.max_tilt = config.limits.max_tilt


def fixed_because(config: Config) -> str | None:
    """Why nothing may change in flight with this configuration, as a sentence; None: it may."""
    if config.guidance.kind != LINEAR:
        return f"guidance.kind {config.guidance.kind} keeps the values with which the flight began"
    if config.planner_name not in PLANNER_NAMES:
        return f"planner.name {config.planner_name} keeps the values with which the flight began"
    return None


def between(before: Config, after: Config, share: float) -> Config:
    """A configuration on the way from one to another, in the keys that differ.

    Positive values move by the same factor in equal times, others by the same amount. A value that
    follows from others (null) counts as what it comes to.

    Args:
        before: where the way begins; its differences from `after` may change in flight.
        after: where it ends.
        share: from 0 to 1.
    """
    if share >= 1.0:
        return after
    middle: dict[str, dict[str, Any]] = {}
    for each in differences(before, after):
        first, last = _number(before, each, each.before), _number(after, each, each.after)
        if first > 0.0 and last > 0.0:
            value = exp((1.0 - share) * log(first) + share * log(last))
        else:
            value = (1.0 - share) * first + share * last
        middle.setdefault(each.section, {})[each.key] = value
    sections = {
        name: getattr(after, name).model_copy(update=values) for name, values in middle.items()
    }
    return after.model_copy(update=sections)


def _number(config: Config, difference: Difference, value: float | None) -> float:
    """The value, or what null comes to in `config`."""
    if value is not None:
        return value
    comes_to = {
        "guidance.position_weight_per_s4": lambda: hold_weights(config).position,
        "guidance.velocity_weight_per_s2": lambda: hold_weights(config).velocity,
        "guidance.disturbance_bandwidth_rad_s": lambda: disturbance_bandwidth(config),
    }
    return comes_to[difference.name]()
