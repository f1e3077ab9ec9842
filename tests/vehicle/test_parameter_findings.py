"""What a pilot is told of each parameter rule, over values around its limits.

`parameter_findings.txt` holds every finding. After an intended change read its difference, and
write it again: `python -m tests.vehicle.test_parameter_findings`.
"""

from collections.abc import Iterator
from itertools import groupby, product
from pathlib import Path

from companion.vehicle.parameter_rules import CompanionSettings, ParameterRule, apply_rules
from companion.vehicle.registry import AUTOPILOTS
from tests.vehicle.test_parameter_rules import PX4_SETUP

KEPT = Path(__file__).with_name("parameter_findings.txt")
VALUES = (
    -1.0, 0.0, 0.25, 0.5, 1.0, 1.9, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 45.0, 250.0, 255.0, 400.0,
    1145.0,
)  # fmt: skip
PLAIN = PX4_SETUP._replace(silence_limit=0.25, hover_thrust=0.5, battery_exponent=0.0, max_tilt=0.6)
"""No limits, and nothing is compensated."""
OTHER = CompanionSettings(
    source_system=255,
    attitude_rate_hz=900.0,
    silence_limit=0.5,
    hover_thrust=0.25,
    curve_factor=0.3,
    battery_exponent=1.0,
    autopilot_compensates_tilt=True,
    acceleration_limits={"roll": 20.0, "pitch": 20.0, "yaw": 5.0},
    max_tilt=1.0,
    signing=True,
)
"""Other values everywhere."""


def findings() -> Iterator[str]:
    """A line for each rule and settings, and below it one for values judged alike.

    Where it matters to the rule, once more beside other parameters, each of which is 1.
    """
    for autopilot, (name, settings) in product(AUTOPILOTS, (("plain", PLAIN), ("other", OTHER))):
        for rule in autopilot.parameters:
            yield f"{autopilot.name} {name}: {rule.name}, {rule.meaning} [{rule.source}]"
            alone = list(judged(rule, {}, settings))
            yield from alone
            names = [name for other in autopilot.parameters for name in other.names]
            beside_others = list(judged(rule, dict.fromkeys(names, 1.0), settings))
            if beside_others != alone:
                yield "  beside others:"
                yield from beside_others


def judged(
    rule: ParameterRule, others: dict[str, float], settings: CompanionSettings
) -> Iterator[str]:
    """What is told of this rule's values beside those of other parameters."""
    found = [apply_rules([rule], others | {rule.name: value}, settings)[0] for value in VALUES]
    for told, alike in groupby(found, lambda one: one[2:]):
        values = " ".join(f"{one.value:g}" for one in alike)
        yield f"  {values}: {told[0].value} {told[2]} {told[1]}".rstrip()


def test_each_rule_says_what_was_approved():
    assert "\n".join(findings()) + "\n" == KEPT.read_text(encoding="utf-8")


if __name__ == "__main__":
    KEPT.write_text("\n".join(findings()) + "\n", encoding="utf-8")
