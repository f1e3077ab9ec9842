"""Checks for planners and guidance of other packages, for use in those packages' tests."""

import random
from collections.abc import Sequence
from math import cos, hypot, inf, isfinite, radians, sin, sqrt, tau
from typing import Any

from companion import plugins
from companion.attitude import (
    BodyRates,
    Coefficients,
    Law,
    Limits,
    Planner,
    Quaternion,
    Target,
    attitude,
    coefficients,
    make_planner,
)
from companion.attitude.planner import MODEL_FOLLOWING
from companion.attitude.rotation import after_constant_rates
from companion.testing.flying import fly
from companion.testing.vehicle import MockVehicle

_LIMITS = Limits(max_tilt=radians(40.0), max_tilt_rate=radians(200.0), max_yaw_rate=radians(90.0))
_GAIN = 5.0  # 1/s
_DT = 0.004  # s
_CASE_COUNT = 200
_SETTLING_TIME = 3.0
"""Time allowed to reach a new target, s: 15 times the time constant 1/`_GAIN`."""
_MAX_REMAINING_ERROR = 0.02
"""Largest distance of the acceleration coefficients from their target after `_SETTLING_TIME`."""
_MAX_TRACKING_ERROR = 1.5
"""Largest distance of the vehicle from its reference in a hover and a circle, m."""


def check_planner(planner: str | Law | type[Planner], seed: int = 0) -> None:
    """Check that a planner may fly: finite, limited rates, equal for q and −q, that reach a target.

    Args:
        planner: a law, a class of planners, or the name of one, installed plug-ins included.
        seed: seed of the attitudes and targets.

    Raises:
        AssertionError: the planner may not fly; the message gives the attitude from which the
            planner started (as a quaternion or as a target), and the target to reach.
        PluginError: the plug-in cannot be loaded, or two packages give it.
        TypeError: `planner` is no planner: the law does not return three numbers, or the class
            lacks a method of a `Planner`.
        ValueError: there is no planner of that name.
    """
    if isinstance(planner, str) and planner in plugins.names(plugins.PLANNERS):
        planner = plugins.load(plugins.PLANNERS, planner)
    rng = random.Random(seed)
    for _ in range(_CASE_COUNT):
        q, target = _random_attitude(rng), _random_target(rng)
        rates = _first_rates(planner, q, target)
        case = f"at q = {q} towards {target}"
        assert all(map(isfinite, rates)), f"rates {rates} are not finite, {case}"
        tilt_rate = hypot(rates.roll, rates.pitch)
        assert tilt_rate <= (_LIMITS.max_tilt_rate or inf) * (1.0 + 1e-9), (
            f"a roll-pitch rate of {tilt_rate} rad/s exceeds the limit, {case}"
        )
        assert abs(rates.yaw) <= (_LIMITS.max_yaw_rate or inf) * (1.0 + 1e-9), (
            f"a yaw rate of {rates.yaw} rad/s exceeds the limit, {case}"
        )
        w, x, y, z = q
        rates_at_negative_q = _first_rates(planner, (-w, -x, -y, -z), target)
        difference = max(abs(a - b) for a, b in zip(rates, rates_at_negative_q, strict=True))
        assert difference < 1e-6, f"q and −q give rates that differ by {difference} rad/s, {case}"
    for _ in range(_CASE_COUNT // 20):
        _check_convergence(planner, _random_target(rng), _random_target(rng))


def check_guidance(name: str) -> None:
    """Check installed guidance by flights on both mock vehicles: a hover and a circle.

    Args:
        name: name of its entry point in `companion.guidance`.

    Raises:
        AssertionError: a flight ended early, or strayed too far from its reference.
        ConfigError: there is no guidance of that name, or it cannot be loaded.
    """
    changes: dict[str, dict[str, Any]] = {
        "guidance": {"kind": name},
        "flight": {"arm": True, "maneuvers": ["hover", "circle"]},
    }
    for autopilot, hover in (("px4", 0.49), ("ardupilot", 0.364)):
        vehicle = MockVehicle(
            autopilot, prearm_delay_s=_BOOT_S, parameters=_SAFE_PARAMETERS.get(autopilot, {})
        )
        summary = fly({**changes, "thrust": {"hover_thrust": hover}}, vehicle)
        assert summary.result == "ok", f"{autopilot}: {summary.result}"
        distance = summary.tracking()["position_max_m"]
        assert distance < _MAX_TRACKING_ERROR, (
            f"{autopilot}: {distance:.2f} m away from its reference"
        )


_BOOT_S = 0.5
"""Boot time of the mock autopilots in this check, s, shorter than the 4 to 42 s of real ones."""
_SAFE_PARAMETERS = {"ardupilot": {"GUID_OPTIONS": 8, "ATC_ANGLE_BOOST": 0, "GUID_TIMEOUT": 1.0}}
"""Parameters with which the vehicle passes the preflight checks, by autopilot."""


def _make_planner(planner: str | Law | type[Planner]) -> Planner:
    # The attitudes in these checks follow the commanded rates at once.
    rate_loop = {"lag": 0.0, "dead_time": 0.0} if planner == MODEL_FOLLOWING else {}
    return make_planner(planner, gain=_GAIN, limits=_LIMITS, **rate_loop)


def _rates(planner: Planner, q: Quaternion, target: Target, body_rates: BodyRates) -> BodyRates:
    """The planner's body rates, rad/s.

    Raises:
        AssertionError: the planner raised an error, or did not return three numbers.
    """
    try:
        return BodyRates(*map(float, planner.rates(q, target, _DT, body_rates)))
    except Exception as error:
        raise AssertionError(
            f"the planner raised {error!r}, at q = {q} towards {target}"
        ) from error


def _first_rates(planner: str | Law | type[Planner], q: Quaternion, target: Target) -> BodyRates:
    instance, zero_rates = _make_planner(planner), BodyRates(0.0, 0.0, 0.0)
    instance.reset(q, zero_rates)
    return _rates(instance, q, target, zero_rates)


def _check_convergence(planner: str | Law | type[Planner], start: Target, target: Target) -> None:
    instance, rates = _make_planner(planner), BodyRates(0.0, 0.0, 0.0)
    q = attitude(Coefficients(start.north, start.east), start.heading)
    instance.reset(q, rates)
    for _ in range(round(_SETTLING_TIME / _DT)):
        rates = _rates(instance, q, target, rates)
        q = after_constant_rates(q, rates, _DT)
    reached = coefficients(q)
    remaining = hypot(reached.north - target.north, reached.east - target.east)
    assert remaining < _MAX_REMAINING_ERROR, (
        f"after {_SETTLING_TIME:g} s the coefficients are {remaining:.3f} away from {target}; "
        f"the planner began at {start}"
    )


def _random_attitude(rng: random.Random) -> Quaternion:
    values: Sequence[float] = [rng.gauss(0.0, 1.0) for _ in range(4)]
    length = sqrt(sum(value * value for value in values))
    w, x, y, z = (value / length for value in values)
    return w, x, y, z


def _random_target(rng: random.Random) -> Target:
    length, direction = sin(_LIMITS.max_tilt or 0.0) * rng.random(), tau * rng.random()
    return Target(length * cos(direction), length * sin(direction), tau * rng.random())
