"""Values that are permitted but probably a mistake, or not measured on this vehicle."""

from collections.abc import Iterator
from math import hypot
from typing import NamedTuple

from companion.config.reference import keys
from companion.config.root import Config
from companion.files.value_faults import mistaken_unit

BODY_RATE = "safety.max_body_rate_deg_s"
_CLIMB_SPEED, _LIFT_OFF_TIME = 1.5, 4.0
"""Speed of a take-off, m/s, and time before the vehicle leaves the ground, s; by the defaults of
the autopilot with the slower climb."""
_DESCENT_SPEED, _LANDING_SPEED, _LANDING_HEIGHT = 1.5, 0.5, 10.0
"""Speeds of a landing above and below this height, m/s and m; by the defaults of the autopilot with
the slower landing."""
_USUAL_VALUES = {"_deg_s2": 1000.0, "_ms": 50.0}
"""Usual value of a key whose default is null, by the suffix of the key."""
_MAX_SUSPECT_SHARE = 1.0 / 20.0
"""A value is suspect only if it is below this share of the usual value."""
_MIN_MEANT_SHARE = 1.0 / 5.0
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
    limits, allowed = config.limits, config.safety.max_body_rate_deg_s
    commanded = hypot(limits.max_tilt_rate_deg_s, limits.max_yaw_rate_deg_s)
    if allowed <= commanded:
        yield SuspectValue(
            BODY_RATE,
            f"{BODY_RATE} is {allowed:g} °/s, and the planner may command {commanded:.0f} °/s",
            "a turn at the commanded rate trips the body-rate monitor, which ends the flight",
            f"raise {BODY_RATE}, or lower limits.max_tilt_rate_deg_s and max_yaw_rate_deg_s",
        )


def _short_times(config: Config) -> Iterator[SuspectValue]:
    """Times for take-off and landing that are too short for the height of the take-off."""
    flight = config.flight
    if flight.take_over:
        return
    height = flight.takeoff_height_m
    low, high = min(height, _LANDING_HEIGHT), max(0.0, height - _LANDING_HEIGHT)
    for key, allowed, needed, end in (
        (
            "flight.takeoff_timeout_s",
            flight.takeoff_timeout_s,
            _LIFT_OFF_TIME + height / _CLIMB_SPEED,
            "the vehicle is landed before it has reached its height",
        ),
        (
            "flight.landing_timeout_s",
            flight.landing_timeout_s,
            low / _LANDING_SPEED + high / _DESCENT_SPEED,
            "the flight ends while the vehicle still sinks",
        ),
    ):
        if allowed < needed:
            yield SuspectValue(
                key,
                f"{key} is {allowed:g} s, and flight.takeoff_height_m {height:g} m",
                f"at the autopilot's default speeds that takes about {needed:.0f} s, so {end}",
                f"raise {key} if the speeds are not higher",
            )


def _mistaken_units(config: Config) -> Iterator[SuspectValue]:
    """Values that are probably radians for degrees, seconds for milliseconds, or shares for %."""
    for key in keys(config):
        if isinstance(key.value, bool) or not isinstance(key.value, int | float) or key.value <= 0:
            continue
        usual = key.default
        if usual is None:
            usual = next(
                (value for suffix, value in _USUAL_VALUES.items() if key.name.endswith(suffix)),
                None,
            )
        if key.value == key.default or not isinstance(usual, int | float) or not usual:
            continue
        unit, converted = mistaken_unit(key.name, key.value)
        if (
            converted > key.value
            and key.value < usual * _MAX_SUSPECT_SHARE
            and converted > usual * _MIN_MEANT_SHARE
        ):
            name = f"{key.section}.{key.name}"
            yield SuspectValue(
                name,
                f"{name} is {key.value:g} {key.unit}",
                f"that is unusually small; {key.value:g} {unit} would be "
                f"{converted:.4g} {key.unit}",
                f"write {converted:.4g} if that was meant",
            )
