"""Rules for the autopilot parameters that matter to a flight by body rates.

Each autopilot lists its rules as data; `judge` applies them to the values that were read. Nothing
here reads or writes a parameter.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from typing import NamedTuple

Values = Mapping[str, float]
"""Parameters as read, by the newest of their names; those the autopilot lacks are absent."""


class CompanionSettings(NamedTuple):
    """The part of our configuration that the autopilot's parameters must agree with.

    Attributes:
        source_system: Our own system id.
        attitude_rate_hz: Rate of attitude samples that we request.
        silence_limit: After this long without control we hand back, s.
        hover_thrust: Normalised thrust at hover with which the flight begins.
        curve_factor: Of the thrust curve that we compensate; 0: none.
        battery_exponent: Of the battery voltage that we compensate; 0: none.
        tilt_compensated: Whether the autopilot is expected to divide thrust by cos(tilt).
        acceleration_limits: Of `roll`, `pitch` and `yaw` as the planner assumes them, rad/s²;
            `None`: no limit.
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


class CheckResult(Enum):
    """What a preflight check came to."""

    SAFE = "safe"
    UNSAFE = "unsafe"
    """Somebody may be hurt or the vehicle lost."""
    INEFFECTIVE = "ineffective"
    """The flight does not do what is asked of it, or a protection does nothing."""
    NOT_READY = "not_ready"
    """The finding only follows from a vehicle that is not ready to arm yet."""
    NOT_CONNECTED = "not_connected"
    """Nobody answers, so nothing was checked."""


class Problem(NamedTuple):
    """What is wrong with a value.

    Attributes:
        result: How bad it is.
        because: What follows from it, one sentence.
        set_to: What to set the parameter to. `None` where only the user can know, or where our
            configuration must change; `because` then says so.
    """

    result: CheckResult
    because: str
    set_to: float | None = None


Check = Callable[[float, Values, CompanionSettings], Problem | None]
"""Judges a parameter by its value, the other values (which may be absent) and our settings."""


@dataclass(frozen=True, slots=True)
class ParameterRule:
    """One parameter that matters.

    Attributes:
        names: Its names, the newest first; older versions use the others.
        meaning: What it decides, one clause.
        check: Judges its value; returns `None` if the value is right.
        source: How this is known.
        vital: Without it the effect of a setpoint, or for how long it is held, is unknown. A
            vehicle that does not send it is not flown.
        universal: Every supported version has it, and some value of it is unsafe. If it was not
            received on a link that loses frames, it may hold such a value.
        instead: Name of the rule for the parameter that other versions have in its place.
        reboot: A change takes effect only after the autopilot restarts.
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


_NO_NUMBER = Problem(
    CheckResult.UNSAFE, "that is no number, and what the autopilot makes of it is unknown"
)


class ParameterFinding(NamedTuple):
    """What a rule found.

    Attributes:
        rule: Which rule.
        value: The autopilot's value.
        result: How bad it is.
        because: What follows from it; empty if it is safe.
        set_to: What to set it to, or `None`.
    """

    rule: ParameterRule
    value: float
    result: CheckResult
    because: str = ""
    set_to: float | None = None


def judge(
    rules: Iterable[ParameterRule], values: Values, settings: CompanionSettings
) -> list[ParameterFinding]:
    """Apply the rules, in their order; a parameter that the autopilot lacks is left out.

    A value that is NaN or infinite is unsafe under every rule, and hidden from other rules.
    """
    findings = []
    finite = {name: value for name, value in values.items() if isfinite(value)}
    for rule in rules:
        if rule.name not in values:
            continue
        value = values[rule.name]
        problem = rule.check(value, finite, settings) if isfinite(value) else _NO_NUMBER
        if problem is None:
            findings.append(ParameterFinding(rule, value, CheckResult.SAFE))
        else:
            findings.append(ParameterFinding(rule, value, *problem))
    return findings
