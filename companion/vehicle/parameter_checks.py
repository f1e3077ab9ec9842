"""The checks that several parameters share, of whichever family."""

from collections.abc import Mapping
from math import degrees

from companion.vehicle.parameter_rules import Check, Complaint, Setup, Values, Verdict

UNSAFE, INEFFECTIVE = Verdict.UNSAFE, Verdict.INEFFECTIVE

LONGEST_HELD = 2.0
"""0.4 rad/s held for 1 s became 24° of tilt (measured on PX4); twice that is not flown out, s."""

_SAME_HOVER = 1.4
"""Hover thrusts that differ by more than this factor are not of one vehicle at one battery."""

_SAME_LIMIT = 1.15
"""Acceleration limits that differ by less than this factor make no difference to a flight."""


def forbidden(verdict: Verdict, bad: Mapping[float, str], set_to: float | None = None) -> Check:
    """Values that must not be, each with what comes of it."""

    def check(value: float, _: Values, __: Setup) -> Complaint | None:
        because = bad.get(value)
        return None if because is None else Complaint(verdict, because, set_to)

    return check


def required(verdict: Verdict, good: float, because: str) -> Check:
    """The one value that is right."""

    def check(value: float, _: Values, __: Setup) -> Complaint | None:
        return None if value == good else Complaint(verdict, because, good)

    return check


def positive(verdict: Verdict, because: str, set_to: float) -> Check:
    """Zero and below switch off what is needed."""

    def check(value: float, _: Values, __: Setup) -> Complaint | None:
        return None if value > 0.0 else Complaint(verdict, because, set_to)

    return check


def at_most(verdict: Verdict, limit: float, because: str, set_to: float) -> Check:
    """Values above a limit do harm."""

    def check(value: float, _: Values, __: Setup) -> Complaint | None:
        return None if value <= limit else Complaint(verdict, because, set_to)

    return check


def bit_set(verdict: Verdict, bit: int, because: str) -> Check:
    """A bit of the mask, given by its value, that has to be set."""

    def check(value: float, _: Values, __: Setup) -> Complaint | None:
        mask = int(value)
        return None if mask & bit else Complaint(verdict, because, float(mask | bit))

    return check


def bit_clear(verdict: Verdict, bit: int, because: str) -> Check:
    """A bit of the mask, given by its value, that must not be set."""

    def check(value: float, _: Values, __: Setup) -> Complaint | None:
        mask = int(value)
        return Complaint(verdict, because, float(mask & ~bit)) if mask & bit else None

    return check


def shortest_hold(silence_limit: float) -> float:
    """How long the autopilot must hold the last rates at least, s, so that we give up first."""
    return 1.5 * silence_limit


def rates_held(value: float, _: Values, setup: Setup) -> Complaint | None:
    """How long the autopilot holds the last rates: not for long, but longer than we take."""
    right = shortest_hold(setup.silence_limit)
    if value <= setup.silence_limit:
        return Complaint(
            UNSAFE,
            f"the autopilot gives up on us before we do (deadman.silence_limit_ms "
            f"{1e3 * setup.silence_limit:g}), so a short gap ends in its failsafe",
            right,
        )
    if value > LONGEST_HELD:
        return Complaint(
            UNSAFE,
            f"when our setpoints stop the last rates are held for {value:g} s: 0.4 rad/s become "
            f"{degrees(0.4 * value):.0f}° of tilt",
            right,
        )
    return None


def hover_thrust(value: float, _: Values, setup: Setup) -> Complaint | None:
    """The autopilot's hover thrust and ours are of the same vehicle."""
    ours = setup.hover_thrust
    if value > 0.0 and 1.0 / _SAME_HOVER < value / ours < _SAME_HOVER:
        return None
    return Complaint(
        INEFFECTIVE,
        f"thrust.hover_thrust is {ours:g}, and one of the two is wrong: the vehicle jumps or sags "
        "when control changes hands; hover it, read the thrust, and set both to that",
    )


def thrust_curve(value: float, _: Values, setup: Setup) -> Complaint | None:
    """The autopilot makes up for the curve of the rotors' thrust, or we do; not both."""
    if value == 0.0 or setup.curve_factor == 0.0:
        return None
    return Complaint(
        INEFFECTIVE,
        f"the autopilot makes up for the thrust curve, and so do we (thrust.curve_factor "
        f"{setup.curve_factor:g}); set thrust.curve_factor to 0",
    )


def battery_scaling(value: float, _: Values, setup: Setup) -> Complaint | None:
    """The autopilot makes up for the battery's voltage, or we do; not both."""
    if value <= 0.0 or setup.battery_exponent == 0.0:
        return None
    return Complaint(
        INEFFECTIVE,
        f"the autopilot makes up for the battery's voltage, and so do we (thrust.battery_exponent "
        f"{setup.battery_exponent:g}), so that thrust grows as the battery empties; set "
        "thrust.battery_exponent to 0",
    )


def our_system(value: float, _: Values, setup: Setup) -> Complaint | None:
    """A companion shares its vehicle's system id."""
    if value == setup.source_system:
        return None
    return Complaint(
        INEFFECTIVE,
        f"our heartbeat says system {setup.source_system}, so the autopilot takes us for another "
        f"vehicle; set link.source_system to {value:g}",
    )


def acceleration_limit(unit: float, axis: str) -> Check:
    """The limit that the planner reckons with is the autopilot's.

    Args:
        unit: the parameter's unit in °/s².
        axis: `roll`, `pitch` or `yaw`.
    """
    prefix = "" if axis == "roll" else f"{axis}_"
    key = f"vehicle.{prefix}acceleration_limit_deg_s2"

    def check(value: float, _: Values, setup: Setup) -> Complaint | None:
        limit = setup.acceleration_limits[axis]
        theirs = unit * value
        if limit is None:
            agrees = theirs == 0.0
        else:
            agrees = 1.0 / _SAME_LIMIT < theirs / degrees(limit) < _SAME_LIMIT
        if agrees:
            return None
        ours = "null" if limit is None else f"{degrees(limit):g}"
        right = "null" if theirs == 0.0 else f"{theirs:g}"
        return Complaint(INEFFECTIVE, f"the planner reckons with {key} {ours}; set that to {right}")

    return check
