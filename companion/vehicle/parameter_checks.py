"""Checks of parameter values that both autopilots use."""

from collections.abc import Callable, Iterable, Mapping
from math import degrees

from companion.vehicle.parameter_rules import Check, CheckResult, CompanionSettings, Problem, Values

UNSAFE, INEFFECTIVE = CheckResult.UNSAFE, CheckResult.INEFFECTIVE

MAX_RATE_HOLD_TIME = 2.0
"""Longest time for which the autopilot may hold the last rates, s. 0.4 rad/s held for 1 s became
24° of tilt (measured on PX4); twice that tilt is not recoverable."""

_MAX_HOVER_RATIO = 1.4
"""Largest plausible ratio of two hover thrusts, the autopilot's and the configured one."""

_MAX_LIMIT_RATIO = 1.15
"""Acceleration limits that differ by less than this factor have the same effect."""


def forbidden(result: CheckResult, consequences: Mapping[float, str], set_to: float) -> Check:
    """A check that forbids some values; `consequences` gives the consequence of each."""

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        consequence = consequences.get(value)
        return None if consequence is None else Problem(result, consequence, set_to)

    return check


def first_problem(*checks: Check) -> Check:
    """A check that reports the first problem that any of the checks finds."""

    def check(value: float, values: Values, settings: CompanionSettings) -> Problem | None:
        return next(filter(None, (each(value, values, settings) for each in checks)), None)

    return check


def safe_action(
    safe_actions: Iterable[float], unsafe_actions: Mapping[float, str], set_to: float
) -> Check:
    """A check of what the autopilot does in an emergency: only `safe_actions` are safe.

    Args:
        safe_actions: safe actions.
        unsafe_actions: unsafe actions, with the consequence of each. An action in neither is
            unsafe, too.
        set_to: a safe action to set.
    """
    safe_values = frozenset(safe_actions)

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        if value in safe_values:
            return None
        return Problem(
            UNSAFE, unsafe_actions.get(value, "companion does not know this action"), set_to
        )

    return check


def _problem_unless(is_good: Callable[[float], bool], problem: Problem) -> Check:
    """A check that returns `problem` for every value for which `is_good` is false."""
    return lambda value, _values, _settings: None if is_good(value) else problem


def required(result: CheckResult, required_value: float, consequence: str) -> Check:
    """A check that requires a value; `consequence`: consequence of any other value."""
    return _problem_unless(
        lambda value: value == required_value, Problem(result, consequence, required_value)
    )


def positive(result: CheckResult, consequence: str, set_to: float) -> Check:
    """A check that requires a value above zero, because zero or less turns a protection off."""
    return _problem_unless(lambda value: value > 0.0, Problem(result, consequence, set_to))


def at_most(result: CheckResult, limit: float, consequence: str, set_to: float) -> Check:
    """A check that requires a value of at most `limit`."""
    return _problem_unless(lambda value: value <= limit, Problem(result, consequence, set_to))


def bit_set(result: CheckResult, bit: int, consequence: str) -> Check:
    """A check that requires a bit of a mask to be set; `bit` is the bit's value."""

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        mask = int(value)
        return None if mask & bit else Problem(result, consequence, float(mask | bit))

    return check


def bit_clear(result: CheckResult, bit: int, consequence: str) -> Check:
    """A check that requires a bit of a mask not to be set; `bit` is the bit's value."""

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        mask = int(value)
        return Problem(result, consequence, float(mask & ~bit)) if mask & bit else None

    return check


def min_rate_hold_time(silence_limit: float) -> float:
    """Shortest time for which the autopilot must hold the last rates, s.

    The result is longer than `silence_limit` (s), so that `companion` releases control first.
    """
    return 1.5 * silence_limit


def rate_hold(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Check the time for which the autopilot holds the last rates after setpoints stop.

    The time must be longer than `silence_limit`, and at most `MAX_RATE_HOLD_TIME`.
    """
    set_to = min_rate_hold_time(settings.silence_limit)
    if value <= settings.silence_limit:
        return Problem(
            UNSAFE,
            f"the autopilot's failsafe begins before companion releases control "
            f"(deadman.silence_limit_ms {1e3 * settings.silence_limit:g}), so a short gap in the "
            "setpoints triggers it",
            set_to,
        )
    if value > MAX_RATE_HOLD_TIME:
        return Problem(
            UNSAFE,
            f"when setpoints stop, the last rates are held for {value:g} s: at 0.4 rad/s that is "
            f"{degrees(0.4 * value):.0f}° of tilt",
            set_to,
        )
    return None


def hover_thrust(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Check that the autopilot's hover thrust agrees with `thrust.hover_thrust`."""
    configured = settings.hover_thrust
    if value > 0.0 and 1.0 / _MAX_HOVER_RATIO < value / configured < _MAX_HOVER_RATIO:
        return None
    return Problem(
        INEFFECTIVE,
        f"thrust.hover_thrust is {configured:g}, and one of the two is wrong, so the vehicle jumps "
        "or sags at the takeover; hover the vehicle, read its thrust, and set both to that",
    )


def thrust_curve(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Check that autopilot and `companion` do not both compensate the rotors' thrust curve."""
    if value == 0.0 or settings.curve_factor == 0.0:
        return None
    return Problem(
        INEFFECTIVE,
        f"both the autopilot and companion compensate the thrust curve (thrust.curve_factor "
        f"{settings.curve_factor:g}); set thrust.curve_factor to 0",
    )


def battery_scaling(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Check that autopilot and `companion` do not both compensate the battery voltage."""
    if value <= 0.0 or settings.battery_exponent == 0.0:
        return None
    return Problem(
        INEFFECTIVE,
        f"both the autopilot and companion compensate the battery voltage "
        f"(thrust.battery_exponent {settings.battery_exponent:g}), so thrust grows as the battery "
        "empties; set thrust.battery_exponent to 0",
    )


def system_id(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Check that `companion` uses the vehicle's system id, as a companion computer must."""
    if value == settings.source_system:
        return None
    return Problem(
        INEFFECTIVE,
        f"companion's heartbeat has system id {settings.source_system}, so the autopilot takes "
        f"companion for another vehicle; set link.source_system to {value:g}",
    )


def acceleration_limit(unit_deg_s2: float, axis: str) -> Check:
    """A check that the configured angular acceleration limit of an axis equals the autopilot's.

    Args:
        unit_deg_s2: the parameter's unit as a multiple of 1 °/s².
        axis: `roll`, `pitch` or `yaw`.
    """
    prefix = "" if axis == "roll" else f"{axis}_"
    key = f"vehicle.{prefix}acceleration_limit_deg_s2"

    def check(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
        assumed_limit, actual_limit = settings.acceleration_limits[axis], unit_deg_s2 * value
        if assumed_limit is None:
            limits_agree, assumed_text = actual_limit == 0.0, "null"
        else:
            limits_agree = (
                1.0 / _MAX_LIMIT_RATIO < actual_limit / degrees(assumed_limit) < _MAX_LIMIT_RATIO
            )
            assumed_text = f"{degrees(assumed_limit):g}"
        if limits_agree:
            return None
        actual_text = "null" if actual_limit == 0.0 else f"{actual_limit:g}"
        return Problem(
            INEFFECTIVE, f"the planner assumes {key} {assumed_text}; set this key to {actual_text}"
        )

    return check
