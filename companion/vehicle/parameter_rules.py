"""Parameters of an autopilot that matter to a flight by body rates, as data and a pure judgement.

A family lists its rules; `judge` tells what they find in a set of values. Nothing here reads or
writes a parameter.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from typing import NamedTuple

Values = Mapping[str, float]
"""Parameters as read, under the newest of their names; those the autopilot has not are absent."""


class Setup(NamedTuple):
    """What our configuration says, as far as the autopilot's parameters have to agree with it.

    Attributes:
        source_system: Our own system id.
        attitude_rate_hz: Asked of it for attitude.
        silence_limit: After this long without control we hand back, s.
        hover_thrust: Normalised thrust at hover that the flight begins with.
        curve_factor: Of the thrust curve that we make up for; 0: none.
        battery_exponent: Of the battery's voltage that we make up for; 0: none.
        tilt_compensated: Whether it is to divide thrust by cos(tilt) itself.
        acceleration_limits: Of `roll`, `pitch` and `yaw`, as the planner has them, rad/s²; `None`:
            no limit.
        max_tilt: Largest tilt of a target, rad.
        signs: Whether we sign what we send, and refuse what is not signed.
    """

    source_system: int
    attitude_rate_hz: float
    silence_limit: float
    hover_thrust: float
    curve_factor: float
    battery_exponent: float
    tilt_compensated: bool
    acceleration_limits: Mapping[str, float | None]
    max_tilt: float
    signs: bool


class Verdict(Enum):
    """How much a value matters."""

    SAFE = "safe"
    UNSAFE = "unsafe"
    """Somebody may be hurt or the vehicle lost."""
    INEFFECTIVE = "ineffective"
    """The flight does not do what is asked of it, or a protection does nothing."""
    NOT_READY = "not_ready"
    """The vehicle is not ready to be armed yet, and this is a consequence of it."""
    NOT_CONNECTED = "not_connected"
    """Nobody answers, so nothing was judged."""


class Complaint(NamedTuple):
    """What is wrong with a value.

    Attributes:
        verdict: How much it matters.
        because: What comes of it, one sentence.
        set_to: What to set the parameter to; `None` where only the user can know, or where it is
            our configuration that is to change, and `because` says so.
    """

    verdict: Verdict
    because: str
    set_to: float | None = None


Check = Callable[[float, Values, Setup], Complaint | None]
"""Judges a parameter's own value; others, which may be absent, and our setup may count."""


@dataclass(frozen=True, slots=True)
class ParameterRule:
    """One parameter that matters.

    Attributes:
        names: Its name, the newest first; older versions know it by the others.
        meaning: What it decides, one clause.
        check: Judges it; `None` is a value that is as it should be.
        source: Where this is known from.
        vital: Without it nobody can know how a setpoint is obeyed, or for how long, so a vehicle
            that does not tell it is not flown.
        universal: Every supported version has it, and some value of it is unsafe: where it was not
            told on a link that loses frames, such a value may have been lost.
        instead: Another rule's name, of the parameter that other versions have in its place.
        reboot: A change counts only after the autopilot was started anew.
    """

    names: tuple[str, ...]
    meaning: str
    check: Check
    source: str
    vital: bool = False
    universal: bool = False
    instead: str = ""
    reboot: bool = False

    @property
    def name(self) -> str:
        """The newest name."""
        return self.names[0]


_NO_NUMBER = Complaint(
    Verdict.UNSAFE, "that is no number, and nobody knows what the autopilot makes of it"
)


class ParameterFinding(NamedTuple):
    """What a rule says of a vehicle.

    Attributes:
        rule: Which.
        value: What the autopilot has.
        verdict: How much it matters.
        because: What comes of it; empty where it is safe.
        set_to: What to set it to, or `None`.
    """

    rule: ParameterRule
    value: float
    verdict: Verdict
    because: str = ""
    set_to: float | None = None


def judge(rules: Iterable[ParameterRule], values: Values, setup: Setup) -> list[ParameterFinding]:
    """What the rules find, in their order; a parameter that the autopilot has not is left out.

    One that is NaN or infinite is unsafe whatever its rule says, and tells other rules nothing.
    """
    findings = []
    finite = {name: value for name, value in values.items() if isfinite(value)}
    for rule in rules:
        if rule.name not in values:
            continue
        value = values[rule.name]
        complaint = rule.check(value, finite, setup) if isfinite(value) else _NO_NUMBER
        if complaint is None:
            findings.append(ParameterFinding(rule, value, Verdict.SAFE))
        else:
            findings.append(ParameterFinding(rule, value, *complaint))
    return findings
