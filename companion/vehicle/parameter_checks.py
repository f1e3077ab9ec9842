"""Checks that several parameters share, whatever the autopilot."""

from collections.abc import Mapping
from math import degrees

from companion.vehicle.parameter_rules import Check, CheckResult, CompanionSettings, Problem, Values

UNSAFE, INEFFECTIVE = CheckResult.UNSAFE, CheckResult.INEFFECTIVE

LONGEST_HELD = 2.0
"""0.4 rad/s held for 1 s became 24° of tilt (measured on PX4); twice that is not recoverable, s."""

_SAME_HOVER = 1.4
"""Hover thrusts that differ by more than this factor are not of one vehicle at one battery."""

_SAME_LIMIT = 1.15
"""Acceleration limits that differ by less than this factor make no difference to a flight."""


def forbidden(result: CheckResult, bad: Mapping[float, str], set_to: float | None = None) -> Check:
    """Values that are forbidden, each with what follows from it."""

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        because = bad.get(value)
        return None if because is None else Problem(result, because, set_to)

    return check


def required(result: CheckResult, good: float, because: str) -> Check:
    """The one value that is right."""

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        return None if value == good else Problem(result, because, good)

    return check


def positive(result: CheckResult, because: str, set_to: float) -> Check:
    """Zero and below switch off a protection that is needed."""

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        return None if value > 0.0 else Problem(result, because, set_to)

    return check


def at_most(result: CheckResult, limit: float, because: str, set_to: float) -> Check:
    """Values above a limit do harm."""

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        return None if value <= limit else Problem(result, because, set_to)

    return check


def bit_set(result: CheckResult, bit: int, because: str) -> Check:
    """A bit of the mask, given by its value, that has to be set."""

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        mask = int(value)
        return None if mask & bit else Problem(result, because, float(mask | bit))

    return check


def bit_clear(result: CheckResult, bit: int, because: str) -> Check:
    """A bit of the mask, given by its value, that must not be set."""

    def check(value: float, _: Values, __: CompanionSettings) -> Problem | None:
        mask = int(value)
        return Problem(result, because, float(mask & ~bit)) if mask & bit else None

    return check


def shortest_hold(silence_limit: float) -> float:
    """Shortest time for which the autopilot must hold the last rates, s: we must give up first."""
    return 1.5 * silence_limit


def rates_held(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """The time for which the autopilot holds the last rates: short, but longer than our limit."""
    right = shortest_hold(settings.silence_limit)
    if value <= settings.silence_limit:
        return Problem(
            UNSAFE,
            f"the autopilot gives up on us before we do (deadman.silence_limit_ms "
            f"{1e3 * settings.silence_limit:g}), so a short gap ends in its failsafe",
            right,
        )
    if value > LONGEST_HELD:
        return Problem(
            UNSAFE,
            f"when our setpoints stop the last rates are held for {value:g} s: 0.4 rad/s become "
            f"{degrees(0.4 * value):.0f}° of tilt",
            right,
        )
    return None


def hover_thrust(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """The autopilot's hover thrust and ours describe the same vehicle."""
    ours = settings.hover_thrust
    if value > 0.0 and 1.0 / _SAME_HOVER < value / ours < _SAME_HOVER:
        return None
    return Problem(
        INEFFECTIVE,
        f"thrust.hover_thrust is {ours:g}, and one of the two is wrong: the vehicle jumps or sags "
        "when control changes hands; hover it, read its thrust, and set both to that",
    )


def thrust_curve(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Either the autopilot compensates the rotors' thrust curve or we do."""
    if value == 0.0 or settings.curve_factor == 0.0:
        return None
    return Problem(
        INEFFECTIVE,
        f"the autopilot compensates the thrust curve, and so do we (thrust.curve_factor "
        f"{settings.curve_factor:g}); set thrust.curve_factor to 0",
    )


def battery_scaling(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """Either the autopilot compensates the battery voltage or we do."""
    if value <= 0.0 or settings.battery_exponent == 0.0:
        return None
    return Problem(
        INEFFECTIVE,
        f"the autopilot compensates the battery voltage, and so do we (thrust.battery_exponent "
        f"{settings.battery_exponent:g}), so thrust grows as the battery empties; set "
        "thrust.battery_exponent to 0",
    )


def our_system(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
    """A companion shares its vehicle's system id."""
    if value == settings.source_system:
        return None
    return Problem(
        INEFFECTIVE,
        f"our heartbeat says system {settings.source_system}, so the autopilot takes us for "
        f"another vehicle; set link.source_system to {value:g}",
    )


def acceleration_limit(unit: float, axis: str) -> Check:
    """The acceleration limit that the planner assumes is the autopilot's.

    Args:
        unit: the parameter's unit in °/s².
        axis: `roll`, `pitch` or `yaw`.
    """
    prefix = "" if axis == "roll" else f"{axis}_"
    key = f"vehicle.{prefix}acceleration_limit_deg_s2"

    def check(value: float, _: Values, settings: CompanionSettings) -> Problem | None:
        limit = settings.acceleration_limits[axis]
        theirs = unit * value
        if limit is None:
            agrees = theirs == 0.0
        else:
            agrees = 1.0 / _SAME_LIMIT < theirs / degrees(limit) < _SAME_LIMIT
        if agrees:
            return None
        ours = "null" if limit is None else f"{degrees(limit):g}"
        right = "null" if theirs == 0.0 else f"{theirs:g}"
        return Problem(INEFFECTIVE, f"the planner assumes {key} {ours}; set that to {right}")

    return check
