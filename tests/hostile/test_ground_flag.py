"""EXTENDED_SYS_STATE lies: a vehicle that flies is called landed, one that stands is not."""

from tests.hostile import personality as kinds
from tests.hostile.actions import IN_AIR, ON_GROUND, flaps, says, sets, stops, streams
from tests.hostile.endings import failed, never_armed, ok, on_the_ground
from tests.hostile.judge import commands
from tests.hostile.personality import ARDUPILOT, PX4
from tests.hostile.scenario import Scenario, flights

FLAG = "EXTENDED_SYS_STATE"
IN_A_MOMENT = says(FLAG, seconds=0.25, **ON_GROUND)
FIVE_METRES = {"flight": {"takeoff_height_m": 5.0}}
SLOW_HEARTBEAT = ("start", 0.0, streams("HEARTBEAT", 1.0, fixed=True))


def never_disarmed_in_the_air(flown):
    """No disarming was asked for in the air: only the autopilot's refusal would prevent a fall."""
    asked = [sent for sent in commands(flown, kinds.ARM) if sent.message.param1 < 0.5]
    assert not [sent for sent in asked if sent.in_air], flown.events


SCENARIOS = (
    Scenario(
        "ON_GROUND for a second in a slow landing at 5 m",
        (
            ("in control", 0.0, sets(descent=0.3)),
            ("landing", 0.5, says(FLAG, seconds=1.0, **ON_GROUND)),
        ),
        (never_disarmed_in_the_air,),
        changes=FIVE_METRES,
    ),
    Scenario(
        "one false ON_GROUND after the OFFBOARD command, before the heartbeat that confirms it",
        (("SET_MODE RATES", 0.0, IN_A_MOMENT),),
        (on_the_ground,),
        (PX4,),
    ),
    Scenario(
        "one false ON_GROUND before the first setpoint, heartbeats at 1 Hz",
        (SLOW_HEARTBEAT, ("at height", 0.0, IN_A_MOMENT)),
        (on_the_ground,),
        (ARDUPILOT,),
    ),
    Scenario(
        "one false ON_GROUND as the first setpoint is obeyed, heartbeats at 1 Hz",
        (SLOW_HEARTBEAT, ("in control", 0.0, IN_A_MOMENT)),
        (on_the_ground,),
    ),
    Scenario("ON_GROUND flaps in the climb", (("in air", 0.0, flaps),), (on_the_ground,)),
    Scenario("ON_GROUND flaps at height", (("at height", 0.0, flaps),), (on_the_ground,)),
    Scenario("ON_GROUND flaps in control", (("in control", 0.5, flaps),), (on_the_ground,)),
    Scenario("ON_GROUND flaps in the hold", (("holding", 0.0, flaps),), (on_the_ground,)),
    Scenario(
        "ON_GROUND for good at 5 m in control",
        (("in control", 0.5, says(FLAG, **ON_GROUND)),),
        (on_the_ground,),
        changes=FIVE_METRES,
    ),
    Scenario(
        "ON_GROUND for good from the climb on",
        (("in air", 0.3, says(FLAG, **ON_GROUND)),),
        (on_the_ground,),
        changes=FIVE_METRES,
    ),
    Scenario("ON_GROUND is never told", (("start", 0.0, says(FLAG, **IN_AIR)),), (never_armed,)),
    Scenario(
        "the landed state is undefined",
        (("start", 0.0, says(FLAG, landed_state=0)),),
        (never_armed,),
    ),
    Scenario("EXTENDED_SYS_STATE never comes", (("start", 0.0, stops(FLAG)),), (never_armed,)),
    Scenario(
        "EXTENDED_SYS_STATE stops in control", (("in control", 0.2, stops(FLAG)),), (on_the_ground,)
    ),
    Scenario(
        "ON_GROUND is not told after the landing",
        (("landing", 0.0, says(FLAG, **IN_AIR)),),
        (on_the_ground,),
    ),
    Scenario(
        "the take-off is never told to be over",
        (("at height", 0.0, says(FLAG, landed_state=3)),),
        (failed, on_the_ground),
    ),
    Scenario("a good flight", (), (ok,)),
)


@flights(SCENARIOS)
def test_ground_flag(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)
