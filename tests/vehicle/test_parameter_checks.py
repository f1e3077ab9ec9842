"""The checks that both autopilots use, each by itself: what it accepts and what it says."""

from math import radians

import pytest

from companion.vehicle import parameter_checks as checks
from companion.vehicle.parameter_rules import CheckResult, CompanionSettings, Problem

SETTINGS = CompanionSettings(
    source_system=1,
    attitude_rate_hz=250.0,
    silence_limit=0.5,
    hover_thrust=0.4,
    curve_factor=0.3,
    battery_exponent=1.0,
    autopilot_compensates_tilt=False,
    acceleration_limits={"roll": radians(1000.0), "pitch": None, "yaw": radians(270.0)},
    max_tilt=0.6,
    signing=False,
)
UNSAFE, BAD = CheckResult.UNSAFE, CheckResult.INEFFECTIVE
WORSE = "it falls"


def problem(check, value):
    return check(value, {}, SETTINGS)


# Made within the test: `make mutants` changes the code between two tests.
@pytest.mark.parametrize(
    ("make", "told", "good", "bad", "set_to"),
    [
        (checks.forbidden, (UNSAFE, {3.0: WORSE}, 1.0), (0.0, 2.0), (3.0,), 1.0),
        (checks.safe_action, ((1.0, 2.0), {3.0: WORSE}, 2.0), (1.0, 2.0), (3.0,), 2.0),
        (checks.required, (UNSAFE, 4.0, WORSE), (4.0,), (0.0, 5.0), 4.0),
        (checks.positive, (UNSAFE, WORSE, 7.0), (0.1, 9.0), (0.0, -1.0), 7.0),
        (checks.at_most, (UNSAFE, 5.0, WORSE, 1.5), (5.0, -2.0), (5.1,), 1.5),
        (checks.bit_set, (UNSAFE, 8, WORSE), (8.0, 9.0), (1.0,), 9.0),
        (checks.bit_clear, (UNSAFE, 8, WORSE), (0.0, 7.0), (9.0,), 1.0),
    ],
)
def test_a_bad_value_is_named_with_its_consequence_and_the_value_to_set(
    make, told, good, bad, set_to
):
    check = make(*told)
    for value in good:
        assert problem(check, value) is None
    for value in bad:
        assert problem(check, value) == Problem(UNSAFE, WORSE, set_to)


def test_an_action_that_nobody_knows_is_unsafe():
    found = problem(checks.safe_action((1.0,), {3.0: WORSE}, 1.0), 99.0)
    assert found == Problem(UNSAFE, "companion does not know this action", 1.0)


def test_of_several_checks_the_first_that_finds_something_speaks():
    both = checks.first_problem(
        checks.positive(UNSAFE, "it is off", 7.0), checks.at_most(BAD, 5.0, WORSE, 1.5)
    )
    assert problem(both, 3.0) is None
    assert problem(both, 0.0) == Problem(UNSAFE, "it is off", 7.0)
    assert problem(both, 6.0) == Problem(BAD, WORSE, 1.5)


def test_each_of_several_checks_knows_the_other_parameters_and_our_settings():
    given = []
    both = checks.first_problem(*[lambda *arguments: given.append(arguments)] * 2)
    assert both(3.0, {"OTHER": 2.0}, SETTINGS) is None
    assert given == [(3.0, {"OTHER": 2.0}, SETTINGS)] * 2


@pytest.mark.parametrize(
    ("value", "words", "set_to"),
    [
        (0.5, "before companion releases control (deadman.silence_limit_ms 500)", 0.75),
        (3.0, "held for 3 s: at 0.4 rad/s that is 69° of tilt", 0.75),
    ],
)
def test_rates_are_held_neither_too_briefly_nor_too_long(value, words, set_to):
    assert problem(checks.rate_hold, 0.51) is problem(checks.rate_hold, 2.0) is None
    found = problem(checks.rate_hold, value)
    assert (found.result, found.set_to) == (UNSAFE, set_to)
    assert words in found.consequence


@pytest.mark.parametrize(
    ("axis", "value", "words"),
    [
        ("roll", 1.0, None),
        ("roll", 1.14, None),
        ("roll", 1.2, "vehicle.acceleration_limit_deg_s2 1000; set this key to 1200"),
        ("roll", 0.0, "vehicle.acceleration_limit_deg_s2 1000; set this key to null"),
        ("pitch", 0.0, None),
        ("pitch", 0.9, "vehicle.pitch_acceleration_limit_deg_s2 null; set this key to 900"),
        ("yaw", 0.27, None),
        ("yaw", 0.5, "vehicle.yaw_acceleration_limit_deg_s2 270; set this key to 500"),
    ],
)
def test_the_planner_assumes_the_autopilots_limit(axis, value, words):
    found = problem(checks.acceleration_limit(1000.0, axis), value)
    if words is None:
        assert found is None
    else:
        assert found == Problem(BAD, f"the planner assumes {words}")
