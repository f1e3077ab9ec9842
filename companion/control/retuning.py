"""Changes gains, weights and limits of the loops while they fly, in small steps."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import exp, log
from typing import Any, NamedTuple

from companion.attitude import PLANNER_NAMES, Constants, Limits
from companion.config import Config
from companion.config.guidance import LINEAR
from companion.config.in_flight import Difference, differences
from companion.control.control_loop import ControlLoop
from companion.control.guidance_loop import GuidanceLoop
from companion.control.hold_settings import correction_settings, hold_weights, observer_settings
from companion.control.inner_loop import planner_constants, rate_limits
from companion.control.outer_loop import linear_settings
from companion.guidance import LinearGuidance, LinearSettings, ObserverSettings
from companion.guidance.position_correction import CorrectionSettings

SLEW_TIME = 0.7
"""Time over which a change takes effect, s."""
_SHORTEST_STEP_PERIOD = 0.035
"""Shortest time between two steps of a change, s: each step computes the gains again."""


class LoopSettings(NamedTuple):
    """The values of a configuration that may change in flight, computed for the loops."""

    guidance: LinearSettings
    observer: ObserverSettings
    correction: CorrectionSettings
    constants: Constants
    """Gains and limits of the planner."""
    limits: Limits
    """Limits of body rates that guidance commands."""
    max_tilt: float
    """Largest tilt in open loop, rad."""


def loop_settings(config: Config) -> LoopSettings:
    """Compute from a configuration the values that may change in flight.

    Raises:
        ValueError: gains cannot be computed from the configuration.
    """
    return LoopSettings(
        linear_settings(config),
        observer_settings(config),
        correction_settings(config),
        planner_constants(config),
        rate_limits(config),
        config.limits.max_tilt,
    )


class Retuning:
    """Applies the values of a configuration to the loops of a flight.

    Only the keys that may change in flight have an effect; see `companion.config.in_flight`.
    """

    def __init__(self, loop: ControlLoop, guidance_loop: GuidanceLoop) -> None:
        self._loop, self._guidance_loop = loop, guidance_loop

    @contextmanager
    def before_each_step(self, before_step: Callable[[float], None]) -> Iterator[None]:
        """Call `before_step` with the time, s, before each guidance step while the block runs."""
        self._guidance_loop.before_step = before_step
        try:
            yield
        finally:
            self._guidance_loop.before_step = lambda _: None

    def apply(self, settings: LoopSettings) -> None:
        """Use these values from the next sample and the next step on.

        Raises:
            TypeError: planner or guidance comes from another package and cannot change.
        """
        guidance_loop = self._guidance_loop
        guidance = guidance_loop.command_maker.guidance
        if not isinstance(guidance, LinearGuidance):
            raise TypeError(f"the values of {type(guidance).__name__} cannot be changed in flight")
        self._loop.retune(settings.constants, settings.limits)
        guidance.retune(settings.guidance)
        guidance_loop.estimate.retune(settings.observer, settings.correction)
        guidance_loop.hold.max_tilt = settings.max_tilt


def reason_against_changes(config: Config) -> str | None:
    """Why this configuration permits no changes in flight, as a sentence; None: it permits them."""
    if config.guidance.kind != LINEAR:
        return f"guidance.kind {config.guidance.kind} keeps the values with which the flight began"
    if config.planner_name not in PLANNER_NAMES:
        return f"planner.name {config.planner_name} keeps the values with which the flight began"
    return None


def interpolated_config(config_before: Config, config_after: Config, share: float) -> Config:
    """A configuration between two others; only keys that differ are interpolated.

    Positive values are interpolated geometrically, others linearly. A value that is null is first
    replaced by the value that the program computes for it (`value_in_effect`).

    Args:
        config_before: configuration at share 0; it differs from `config_after` only in keys that
            may change in flight.
        config_after: configuration at share 1.
        share: 0..1.
    """
    if share >= 1.0:
        return config_after
    changed_values: dict[str, dict[str, Any]] = {}
    for difference in differences(config_before, config_after):
        value_before = value_in_effect(config_before, difference, difference.before)
        value_after = value_in_effect(config_after, difference, difference.after)
        if value_before > 0.0 and value_after > 0.0:
            value = exp((1.0 - share) * log(value_before) + share * log(value_after))
        else:
            value = (1.0 - share) * value_before + share * value_after
        changed_values.setdefault(difference.section, {})[difference.key] = value
    sections = {
        name: getattr(config_after, name).model_copy(update=values)
        for name, values in changed_values.items()
    }
    return config_after.model_copy(update=sections)


def value_in_effect(config: Config, difference: Difference, value: float | None) -> float:
    """`value`, or for null the value that the program computes from `config`."""
    if value is not None:
        return value
    functions_by_key = {
        "guidance.position_weight_per_s4": lambda: hold_weights(config).position,
        "guidance.velocity_weight_per_s2": lambda: hold_weights(config).velocity,
    }
    return functions_by_key[difference.name]()


class Slew:
    """Interpolates from the present configuration to the wanted one; times are in s of one clock.

    Attributes:
        settled_config: the newest configuration that was completely in effect.

    Args:
        config: the present configuration, which is also the wanted one at first.
    """

    def __init__(self, config: Config) -> None:
        self._present_config = self._start_config = self._wanted_config = config
        self.settled_config = config
        self._start_time: float | None = None
        self._last_step_time = 0.0

    def jump(self, wanted_config: Config) -> None:
        """Take the wanted values at once, because control has not begun yet or has ended."""
        self._present_config = self._wanted_config = self.settled_config = wanted_config
        self._start_time = None

    def begin(self, wanted_config: Config, now: float) -> None:
        """Begin to move from the present values to the wanted ones."""
        self._start_config, self._wanted_config = self._present_config, wanted_config
        self._start_time = now

    def stop(self) -> None:
        """Stay at the present values."""
        self._start_time = None

    def step(self, now: float) -> LoopSettings | None:
        """The values to use from now on; None: no change.

        Raises:
            ValueError: gains cannot be computed from the new values.
        """
        if self._start_time is None or now - self._last_step_time < _SHORTEST_STEP_PERIOD:
            return None
        self._last_step_time = now
        share = (now - self._start_time) / SLEW_TIME
        self._present_config = interpolated_config(self._start_config, self._wanted_config, share)
        settings = loop_settings(self._present_config)
        if share >= 1.0:
            self._start_time, self.settled_config = None, self._wanted_config
        return settings
