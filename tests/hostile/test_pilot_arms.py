"""The pilot arms, and what was good at the checks is not good any more."""

from tests.hostile import actions
from tests.hostile.actions import arms, parameter, switches, together
from tests.hostile.endings import (
    left_alone,
    never_armed,
    never_took_off,
    never_took_over,
    ok,
    on_the_ground,
)
from tests.hostile.personality import ARDUPILOT, BOTH, PX4
from tests.hostile.scenario import Scenario, flights, in_turn

ARMED, HANDED_OVER = 1.0, 1.6
PILOT = (("checked", ARMED, arms), ("checked", HANDED_OVER, switches("READY")))
MODES = {PX4.name: "PILOT", ARDUPILOT.name: "STABILIZE"}
PILOT_ARMS = {"flight": {"arm": False}}
GROUND = {
    "before the pilot arms": ("checked", 0.3),
    "as the pilot arms": ("checked", ARMED),
    "before the take-off": ("checked", 1.3),
}
FAULTS = {
    "battery at 3 %": actions.BATTERY_EMPTY,
    "GPS gone": actions.GPS_GONE,
    "estimator gone": actions.ESTIMATOR_GONE,
    "MAV_STATE_CRITICAL": actions.CRITICAL,
    "attitude at 12 Hz": actions.SLOW_ATTITUDE,
    "position stopped": actions.POSITION_GONE,
}
ON_GROUND_ONLY = {"pre-arm checks bad": actions.PREARM_BAD}
DANGEROUS = {
    PX4.name: parameter("COM_OBL_RC_ACT", 7),
    ARDUPILOT.name: parameter("GUID_OPTIONS", 0),
}


def on_ground(kind):
    faults = {**FAULTS, **ON_GROUND_ONLY, "a parameter made unsafe": DANGEROUS[kind.name]}
    for fault, action in faults.items():
        for when, (mark, delay) in GROUND.items():
            if fault == "a parameter made unsafe" and when == "before the take-off":
                continue  # what was read less than a second ago is not read again
            # In the order of a script at the same time: the fault first.
            script = ((mark, delay, action), *PILOT)
            yield row(f"{fault} {when}", script, (never_took_off,), kind)


def before_takeover(kind):
    for fault, action in FAULTS.items():
        script = (*PILOT, ("TAKEOFF", 0.3, action))
        # PX4's failsafe holds before it returns, so its hold is not ours to end.
        by_failsafe = kind is PX4 and action is actions.CRITICAL
        demands = (never_took_over, left_alone if by_failsafe else on_the_ground)
        yield row(f"{fault} before the take-over", script, demands, kind)


def row(name, script, demands, kind):
    return Scenario(name, script, demands, (kind,), mode=MODES[kind.name], changes=PILOT_ARMS)


def others(kind):
    keeps = (("checked", ARMED, arms), ("checked", HANDED_OVER, switches("STABILIZE")))
    yield row("the pilot arms and keeps it", keeps, (never_took_off,), kind)
    yield row("a good flight", PILOT, (ok,), kind)
    away = ("checked", HANDED_OVER + 0.02, actions.takes("PILOT"))
    yield row("the pilot hands over and takes it back", (*PILOT, away), (never_took_off,), kind)
    passing = together(
        actions.says("SYS_STATUS", 0.5, battery_remaining=3),
        actions.says("BATTERY_STATUS", 0.5, battery_remaining=3),
    )
    script = (("checked", 0.2, passing), *PILOT)
    yield row("battery at 3 % for a moment before the pilot arms", script, (), kind)


@flights(in_turn(on_ground))
def test_what_went_bad_on_the_ground_forbids_the_take_off(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights([scenario for kind in BOTH for scenario in before_takeover(kind)])
def test_what_went_bad_in_the_climb_forbids_the_take_over(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights([scenario for kind in BOTH for scenario in others(kind)])
def test_whose_it_is(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


def before_we_arm():
    for fault, action in {**FAULTS, **ON_GROUND_ONLY}.items():
        script = (("setpoint", 0.1, action),)
        yield Scenario(f"{fault} before we arm", script, (never_armed,), (PX4,))


@flights(before_we_arm())
def test_what_went_bad_after_the_checks_forbids_our_arming(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)
