"""The last rates weighed against the fence and the ground, on what is configured to be flown."""

from dataclasses import replace

import pytest

from companion.config import Config
from companion.config.files import changed, load
from companion.config.known_drag import KnownDrag
from companion.flight.maneuvers import configured_maneuvers, fresh_copy
from companion.preflight.finding import Key
from companion.preflight.offboard_loss import offboard_loss
from companion.preflight.parameter_survey import Survey
from companion.vehicle.parameter_rules import CheckResult
from tests.flight.fly import CONFIGS
from tests.preflight.test_checks import ARDUPILOT, GOOD

INEFFECTIVE, SAFE = CheckResult.INEFFECTIVE, CheckResult.SAFE
WIDE = {
    "limits": {"fence_radius_m": 200.0, "fence_ceiling_m": 100.0, "fence_floor_m": 0.1},
    "safety": {"fence_polygon_m": ()},
}
NARROW = {"limits": {"fence_radius_m": 30.0}}
CIRCLE = {
    "flight": {"maneuvers": ("circle",), "takeoff_height_m": 10.0},
    "circle": {"radius_m": 5.0, "speed_m_s": 5.0, "laps": 2.0},
    "limits": {"fence_radius_m": 40.0, "max_tilt_deg": 50.0},
    "guidance": {"drag_per_s": 1.0},
}


def judged(config, held=1.0, autopilot=GOOD.autopilot):
    name = autopilot.offboard_loss_failsafe.parameter
    flown = configured_maneuvers(
        changed(config, WIDE, "test")
    )  # which refuses what comes near by itself
    evidence = replace(
        GOOD,
        autopilot=autopilot,
        survey=Survey({name: held}, {name: name}),
        maneuvers=flown,
        known_drag=KnownDrag(config.guidance.drag),
    )
    (finding,) = offboard_loss(config, evidence)
    assert finding.key == Key.OFFBOARD_LOSS
    return finding


def flying(*changes):
    config = changed(Config(), CIRCLE, "test")
    for change in changes:
        config = changed(config, change, "test")
    return config


def test_a_circle_that_stays_inside_whatever_happens_is_safe_and_says_how_far():
    finding = judged(flying())
    assert finding.result is SAFE
    assert "for 1 s (COM_OF_LOSS_T); these rates can carry the vehicle 17 m away" in finding.fact


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"limits": {"fence_radius_m": 15.0}}, "beyond limits.fence_radius_m"),
        ({"safety": {"fence_polygon_m": ((-15, -15), (-15, 15), (15, 15), (15, -15))}}, "polygon"),
        ({"limits": {"fence_ceiling_m": 0.3}}, "above limits.fence_ceiling_m"),
        ({"flight": {"takeoff_height_m": 2.5}}, "below limits.fence_floor_m"),
    ],
)
def test_each_side_of_the_fence_counts(change, words):
    finding = judged(flying(change))
    assert finding.result is INEFFECTIVE
    assert words in finding.consequence
    assert finding.fix.startswith("set COM_OF_LOSS_T to 0.75, fly more slowly")
    assert "widen" not in finding.fix
    assert "raise" not in finding.fix


def test_what_is_advised_mends_it():
    tight = flying({"limits": {"fence_radius_m": 17.0}})
    assert judged(tight).result is INEFFECTIVE
    assert judged(tight, held=0.75).result is SAFE
    assert judged(changed(tight, {"circle": {"speed_m_s": 3.0}}, "test")).result is SAFE
    assert "set COM_OF_LOSS_T" not in judged(tight, held=0.6).fix


def test_a_step_is_the_worst_moment_and_a_lower_rate_limit_mends_it():
    """Its rates are the planner's gain times the step, held from there."""
    steps = flying({"flight": {"maneuvers": ("steps",), "takeoff_height_m": 5.0}})
    assert "below limits.fence_floor_m" in judged(steps).consequence
    slower = changed(steps, {"limits": {"max_tilt_rate_deg_s": 30.0}}, "test")
    assert judged(slower).result is SAFE


def test_doublets_of_body_rates_are_weighed_too():
    identify = flying({"flight": {"maneuvers": ("identify",), "takeoff_height_m": 5.0}})
    assert judged(identify).result is INEFFECTIVE
    assert judged(identify, held=0.75).result is SAFE


def test_an_autopilot_that_does_not_hold_drifts_farther():
    assert judged(flying(NARROW)).result is SAFE
    finding = judged(flying({"guidance": {"drag_per_s": 0.36}, **NARROW}), autopilot=ARDUPILOT)
    assert finding.result is INEFFECTIVE
    assert "beyond limits.fence_radius_m" in finding.consequence


def test_a_trajectory_is_weighed_without_being_begun():
    path = CONFIGS / "trajectories" / "figure8.yaml"
    config = flying(
        {"flight": {"maneuvers": ("trajectory",), "trajectory": path, "slow_down": True}}
    )
    flown = configured_maneuvers(config)
    duration = flown.duration
    evidence = replace(GOOD, maneuvers=fresh_copy(flown))
    (finding,) = offboard_loss(config, evidence)
    assert "carry the vehicle" in finding.fact
    assert flown.duration == duration


def test_nothing_is_said_of_what_is_not_known():
    config = flying()
    assert list(offboard_loss(config, GOOD)) == []  # nothing is to be flown
    unread = replace(GOOD, survey=Survey({}, {}), maneuvers=configured_maneuvers(config))
    assert list(offboard_loss(config, unread)) == []


@pytest.mark.parametrize("name", ["px4", "ardupilot", "mock-px4", "mock-ardupilot"])
def test_the_shipped_configurations_are_clean(name):
    """The bundled vehicles hold the last rates for 0.75 s, as advised; real ones for 1 s."""
    autopilot = ARDUPILOT if "ardupilot" in name else GOOD.autopilot
    held = 0.75 if "mock" in name else 1.0
    assert judged(load(CONFIGS / f"{name}.yaml"), held, autopilot).result is SAFE
    if "mock" in name:
        assert judged(load(CONFIGS / f"{name}.yaml"), 1.0, autopilot).result is INEFFECTIVE
