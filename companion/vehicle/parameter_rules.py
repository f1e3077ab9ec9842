"""Rules for the autopilot parameters that matter to a flight by body rates.

Each autopilot lists its rules as data; `apply_rules` applies them to the values that were read.
Nothing here reads or writes a parameter.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from typing import NamedTuple

Values = Mapping[str, float]
"""Values of the parameters that the autopilot has, by the newest name of each."""


class CompanionSettings(NamedTuple):
    """The part of the configuration with which the autopilot's parameters must agree."""

    source_system: int
    """System id of `companion`."""
    attitude_rate_hz: float
    """Rate of attitude samples that is requested, Hz."""
    silence_limit: float
    """Time without setpoints after which `companion` releases control, s."""
    hover_thrust: float
    """Configured collective thrust at hover, 0..1."""
    curve_factor: float
    """Factor of the thrust curve that `companion` compensates; 0: none."""
    battery_exponent: float
    """Exponent of the voltage that `companion` compensates; 0: none."""
    autopilot_compensates_tilt: bool
    """Whether the autopilot is expected to divide thrust by cos(tilt)."""
    acceleration_limits: Mapping[str, float | None]
    """Angular acceleration limits of `roll`, `pitch` and `yaw` that the planner assumes, rad/s²;
    `None`: no limit."""
    max_tilt: float
    """Largest tilt of a target, rad."""
    signing: bool
    """Whether message signing is configured."""


class CheckResult(Enum):
    """Result of a preflight check."""

    SAFE = "safe"
    UNSAFE = "unsafe"
    """Somebody may be hurt or the vehicle lost."""
    INEFFECTIVE = "ineffective"
    """The flight does not do what is commanded, or a protection has no effect."""
    NOT_READY = "not_ready"
    """The check fails only because the vehicle is not ready to arm yet."""
    NOT_CONNECTED = "not_connected"
    """No vehicle answers, so nothing was checked."""


class Problem(NamedTuple):
    """What is wrong with the value of a parameter."""

    result: CheckResult
    consequence: str
    """Consequence of the value, one sentence."""
    set_to: float | None = None
    """Value to which the parameter should be set. `None`: only the user can know it, or the
    configuration must change; `consequence` then says which key."""


Check = Callable[[float, Values, CompanionSettings], Problem | None]
"""Judges a parameter from its value, the other parameters (some may be absent) and the settings."""


@dataclass(frozen=True, slots=True)
class ParameterRule:
    """A rule for one parameter."""

    names: tuple[str, ...]
    """Names of the parameter, the newest first; older versions use the others."""
    meaning: str
    """What the parameter decides, one clause."""
    check: Check
    """Judges the value; returns `None` if the value is right."""
    source: str
    """Source of the rule: a reference or a measurement."""
    vital: bool = False
    """Whether the flight is refused if the vehicle does not send the parameter, because the effect
    of a setpoint, or how long the autopilot holds a setpoint, is then unknown."""
    in_all_versions: bool = False
    """Whether every supported version has the parameter, and some of its values are unsafe. A
    parameter that the link lost may then have an unsafe value."""
    alternative: str = ""
    """Name of the parameter that other versions have instead; that parameter has its own rule."""
    needs_reboot: bool = False
    """Whether a change takes effect only after the autopilot restarts."""

    @property
    def name(self) -> str:
        """The newest name."""
        return self.names[0]


_NOT_FINITE_PROBLEM = Problem(
    CheckResult.UNSAFE, "the value is not a number, and its effect on the autopilot is unknown"
)


class ParameterFinding(NamedTuple):
    """The result of one rule."""

    rule: ParameterRule
    value: float
    """The autopilot's value."""
    result: CheckResult
    consequence: str = ""
    """As in `Problem`; empty if the value is safe."""
    set_to: float | None = None
    """As in `Problem`; `None` also if the value is safe."""


def apply_rules(
    rules: Iterable[ParameterRule], values: Values, settings: CompanionSettings
) -> list[ParameterFinding]:
    """Apply the rules in their order; a rule whose parameter is absent is left out.

    A value that is NaN or infinite is unsafe, and other rules treat its parameter as absent.
    """
    findings = []
    finite_values = {name: value for name, value in values.items() if isfinite(value)}
    for rule in rules:
        if rule.name not in values:
            continue
        value = values[rule.name]
        problem = (
            rule.check(value, finite_values, settings) if isfinite(value) else _NOT_FINITE_PROBLEM
        )
        if problem is None:
            findings.append(ParameterFinding(rule, value, CheckResult.SAFE))
        else:
            findings.append(ParameterFinding(rule, value, *problem))
    return findings
