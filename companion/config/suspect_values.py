"""Values that are permitted but probably a mistake, or not measured on this vehicle."""

from collections.abc import Iterator
from math import hypot
from typing import NamedTuple

from companion.config.reference import keys
from companion.config.root import Config
from companion.files.value_faults import mistaken_unit

BODY_RATE_KEY = "safety.max_body_rate_deg_s"
_CLIMB_SPEED, _LIFT_OFF_TIME = 1.5, 4.0
"""Speed of a take-off, m/s, and time before the vehicle leaves the ground, s; by the defaults of
the autopilot with the slower climb."""
_DESCENT_SPEED, _LANDING_SPEED, _LANDING_HEIGHT = 1.5, 0.5, 10.0
"""Speeds of a landing above and below `_LANDING_HEIGHT`, m/s, and this height, m; by the defaults
of the autopilot with the slower landing."""
_USUAL_VALUE_BY_SUFFIX = {"_deg_s2": 1000.0, "_ms": 50.0}
"""Usual value of a key whose default is null, by the suffix of the key."""
_MAX_SHARE_OF_USUAL = 1.0 / 20.0
"""A value is suspect only if it is below this share of the usual value."""
_MIN_CONVERTED_SHARE_OF_USUAL = 1.0 / 5.0
"""A value is suspect only if converting it from the mistaken unit gives more than this share of the
usual value."""


class SuspectValue(NamedTuple):
    """A suspect value of the configuration."""

    key: str
    description: str
    """The present value, as a clause."""
    consequence: str
    """Why the value is suspect: its consequence, as a clause."""
    fix: str
    """What the user should do."""

    def sentence(self) -> str:
        """The message for the user."""
        return f"{self.description}: {self.consequence}; {self.fix}"


def suspect_values(config: Config) -> Iterator[SuspectValue]:
    """All suspect values of a configuration."""
    yield from _mistaken_units(config)
    yield from _low_body_rate_limit(config)
    yield from _short_times(config)
    if config.vehicle.response_known and config.vehicle.identified is None and config.mock is None:
        yield SuspectValue(
            "vehicle.identified",
            "vehicle.lag_ms and vehicle.dead_time_ms were not measured on this vehicle",
            "the response is less exact than after `companion identify`; steps are still "
            "straighter than with planner.name: first-order (docs/identify.md)",
            "run `companion identify` before raising planner.gain_per_s, and include its file",
        )


def _low_body_rate_limit(config: Config) -> Iterator[SuspectValue]:
    """`safety.max_body_rate_deg_s`, if the planner may command a rate that reaches it."""
    limits, limit_deg_s = config.limits, config.safety.max_body_rate_deg_s
    commanded_deg_s = hypot(limits.max_tilt_rate_deg_s, limits.max_yaw_rate_deg_s)
    if limit_deg_s <= commanded_deg_s:
        yield SuspectValue(
            BODY_RATE_KEY,
            f"{BODY_RATE_KEY} is {limit_deg_s:g} °/s, and the planner may command "
            f"{commanded_deg_s:.0f} °/s",
            "a turn at the commanded rate trips the body-rate monitor, which ends the flight",
            f"raise {BODY_RATE_KEY}, or lower limits.max_tilt_rate_deg_s and max_yaw_rate_deg_s",
        )


def _short_times(config: Config) -> Iterator[SuspectValue]:
    """Times for take-off and landing that are too short for the height of the take-off."""
    flight = config.flight
    if flight.take_over:
        return
    height = flight.takeoff_height_m
    slow_descent = min(height, _LANDING_HEIGHT)
    fast_descent = height - slow_descent
    for key, allowed_s, needed_s, maneuver, consequence in (
        (
            "flight.takeoff_timeout_s",
            flight.takeoff_timeout_s,
            _LIFT_OFF_TIME + height / _CLIMB_SPEED,
            "climb",
            "the vehicle is landed before it has reached its height",
        ),
        (
            "flight.landing_timeout_s",
            flight.landing_timeout_s,
            slow_descent / _LANDING_SPEED + fast_descent / _DESCENT_SPEED,
            "landing",
            "the flight ends while the vehicle still sinks",
        ),
    ):
        if allowed_s < needed_s:
            yield SuspectValue(
                key,
                f"{key} is {allowed_s:g} s, and flight.takeoff_height_m {height:g} m",
                f"at the autopilot's default speeds the {maneuver} takes about {needed_s:.0f} s, "
                f"so {consequence}",
                f"raise {key}, unless the speeds are set higher in the autopilot",
            )


def _mistaken_units(config: Config) -> Iterator[SuspectValue]:
    """Values that are probably radians for degrees, seconds for milliseconds, or shares for %."""
    for key in keys(config):
        if isinstance(key.value, bool) or not isinstance(key.value, int | float) or key.value <= 0:
            continue
        usual_value = key.default
        if usual_value is None:
            usual_value = next(
                (
                    value
                    for suffix, value in _USUAL_VALUE_BY_SUFFIX.items()
                    if key.name.endswith(suffix)
                ),
                None,
            )
        if key.value == key.default or not isinstance(usual_value, int | float) or not usual_value:
            continue
        mistaken_unit_name, converted = mistaken_unit(key.name, key.value)
        if (
            converted > key.value
            and key.value < usual_value * _MAX_SHARE_OF_USUAL
            and converted > usual_value * _MIN_CONVERTED_SHARE_OF_USUAL
        ):
            name = f"{key.section}.{key.name}"
            yield SuspectValue(
                name,
                f"{name} is {key.value:g} {key.unit}",
                f"that is unusually small; {key.value:g} {mistaken_unit_name} would be "
                f"{converted:.4g} {key.unit}",
                f"write {converted:.4g} if that was meant",
            )
