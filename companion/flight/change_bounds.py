"""Bounds on changes of values in flight, in addition to the types and ranges of the keys."""

from math import inf

from companion.config import Config
from companion.config.in_flight import Difference, changeable_keys, differences
from companion.control.hold_settings import flies_identify
from companion.control.retuning import value_in_effect
from companion.files.yaml_file import ConfigError

LARGEST_CHANGE_FACTOR = 3.0
"""Largest factor by which a change may multiply or divide a value."""
_NEVER_ZERO_KEYS = frozenset(
    {"planner.yaw_gain_per_s", "guidance.height_gain_per_s", "guidance.climb_gain_per_s"}
)
"""Gains that must not be 0, because yaw or height would be uncontrolled."""
_BANDWIDTH_KEY = "guidance.disturbance_bandwidth_rad_s"
_WITHOUT_EFFECT_IN_IDENTIFY = frozenset(
    {"guidance.position_weight_per_s4", "guidance.velocity_weight_per_s2", _BANDWIDTH_KEY}
)
"""Keys without effect in the maneuver `identify`, which has its own weights and bandwidth."""


def require_moderate_change(before: Config, after: Config, name: str) -> None:
    """Check that a change is not too large for a vehicle in the air.

    Args:
        before: the configuration now.
        after: the wanted configuration; it differs only in keys that may change in flight.
        name: name of the change in error messages.

    Raises:
        ConfigError: a value changes by more than `LARGEST_CHANGE_FACTOR`, becomes too small to
            control the vehicle, or cannot change in this flight.
        ValueError: weights cannot be computed from the configuration.
    """
    for each in differences(before, after):
        if (each.section, each.key) not in changeable_keys():
            continue  # such as `include`, which is no value
        refusal = _refusal(before, after, each)
        if refusal is not None:
            raise ConfigError(f"{name}: {refusal}")


def _refusal(before: Config, after: Config, change: Difference) -> str | None:
    """Why `change` is not permitted, as a sentence; None: it is permitted."""
    key = change.name
    if key in _WITHOUT_EFFECT_IN_IDENTIFY and flies_identify(before):
        return f"{key} has no effect while the maneuver `identify` is flown"
    if key == _BANDWIDTH_KEY and None in (change.before, change.after):
        return (
            f"{key} must not change between null and a number in flight; begin the next flight "
            "with a number to change it in flight"
        )
    if key in _NEVER_ZERO_KEYS and change.after == 0.0:
        return f"{key} must not become 0 in flight"
    old = value_in_effect(before, change, change.before)
    new = value_in_effect(after, change, change.after)
    low, high = min(old, new), max(old, new)
    if (high / low if low > 0.0 else inf) > LARGEST_CHANGE_FACTOR * (1.0 + 1e-9):
        return (
            f"{key} from {old:g} to {new:g} is more than a factor of {LARGEST_CHANGE_FACTOR:g}; "
            "change it in several smaller steps"
        )
    return None
