"""Pilot, failsafe or somebody else has the vehicle: nothing that steers or commands may follow."""

from tests.hostile import actions
from tests.hostile import personality as kinds
from tests.hostile.actions import fails_safe, sets, takes, tells
from tests.hostile.endings import failed, gives_back, lands, ok, on_the_ground, stops_within
from tests.hostile.personality import ARDUPILOT, PX4
from tests.hostile.scenario import Scenario, flights

MOMENTS = {
    PX4.name: ("setpoint", "SET_MODE HOLD", "ARM", "TAKEOFF", "SET_MODE RATES", "LAND"),
    ARDUPILOT.name: ("SET_MODE READY", "ARM", "TAKEOFF", "SET_MODE HOLD", "SET_MODE LAND"),
}
BETWEEN = ("armed", "in air", "at height", "in control", "holding", "landing", "down")
FAST_MODE_S = 0.15
LONGER = {"hover": {"duration_s": 6.0}}


def takeovers(kind):
    for mark in (*MOMENTS[kind.name], *BETWEEN):
        script = ((mark, 0.02, takes("PILOT")),)
        yield Scenario(f"the pilot takes over after {mark}", script, (), (kind,))


def others(**fields):
    """A second HEARTBEAT from the vehicle's ids, with other fields."""
    return tells("HEARTBEAT", lambda told: [told, {**told, **fields}])


def another_steers(autopilot):
    """Another station's setpoints come between ours; the vehicle obeys both."""
    vehicle = autopilot.vehicle
    vehicle.obey = lambda *_: type(vehicle).obey(vehicle, (0.5, 0.0, 0.0), 0.5)


NOT_THE_AUTOPILOT = {"autopilot": 8, "base_mode": 0, "custom_mode": 0, "system_status": 4}
IN_CONTROL = (
    Scenario(
        "the pilot takes over in control, told at once",
        (("in control", 0.7, takes("PILOT")),),
        (stops_within(FAST_MODE_S),),
    ),
    Scenario("return by failsafe", (("in control", 0.7, fails_safe("RETURN")),), (failed,)),
    Scenario(
        "landing by failsafe in control",
        (("in control", 0.7, fails_safe("LAND")),),
        (failed,),
    ),
    Scenario(
        "landing by failsafe in the climb",
        (("in air", 0.4, fails_safe("LAND")),),
        (failed,),
    ),
    Scenario(
        "a failsafe is told and the mode stays",
        (("in control", 0.7, actions.CRITICAL),),
        (gives_back(1.4),),
    ),
    Scenario(
        "a failsafe is told in the climb and the mode stays",
        (("in air", 0.4, actions.CRITICAL),),
        (failed,),
    ),
    Scenario(
        "the motors stop in control",
        (("in control", 0.7, actions.disarms),),
        (stops_within(1.2),),
        rules={"may_fall": True},
    ),
    Scenario(
        "another station steers, too", (("in control", 0.5, another_steers),), (gives_back(4.0),)
    ),
    Scenario(
        "the vehicle is pushed away",
        (("in control", 0.5, sets("body", push=(12.0, 0.0, 0.0))),),
        (failed,),
        changes=LONGER,
    ),
    Scenario(
        "the vehicle is pushed down",
        (("in control", 0.5, sets("body", push=(0.0, 0.0, 12.0))),),
        (failed,),
        changes=LONGER,
        rules={"may_fall": True},
    ),
    Scenario("the battery runs out", (("in control", 0.7, actions.BATTERY_EMPTY),), (lands(1.0),)),
    Scenario("GPS is lost", (("in control", 0.7, actions.GPS_GONE),), (lands(1.0),)),
    Scenario("the estimator fails", (("in control", 0.7, actions.ESTIMATOR_GONE),), (lands(1.2),)),
    Scenario(
        "HEARTBEAT stops in control",
        (("in control", 0.7, actions.stops("HEARTBEAT")),),
        (stops_within(5.2),),
        changes=LONGER,
    ),
    Scenario(
        "the vehicle stays armed after the landing, and the pilot keeps it",
        (("in control", 0.0, sets(keeps_armed=True)), ("down", 0.4, takes("PILOT"))),
        (),
    ),
    Scenario(
        "the vehicle stays armed after the landing",
        (("in control", 0.0, sets(keeps_armed=True)),),
        (on_the_ground,),
    ),
)


def left_in_a_mode_of_its_own(flown):
    assert flown.autopilot.vehicle.mode != "RATES", flown.events


HEARTBEATS = tuple(
    Scenario(f"{who} sends heartbeats under the vehicle's ids", (("start", 0.0, action),), (ok,))
    for who, action in (
        ("a ground station", others(type=6, **NOT_THE_AUTOPILOT)),
        ("a gimbal", others(type=26, **NOT_THE_AUTOPILOT)),
        (
            "a companion of a generic autopilot",
            others(**{**NOT_THE_AUTOPILOT, "type": 18, "autopilot": 0}),
        ),
        (
            "a camera that names the vehicle's autopilot",
            others(type=30, base_mode=0, custom_mode=0, system_status=4),
        ),
    )
)
ENDINGS = tuple(
    Scenario(
        f"PX4 is in OFFBOARD again after the landing for {why}",
        (("in control", 0.7, action),),
        (on_the_ground, left_in_a_mode_of_its_own),
        (PX4,),
    )
    for why, action in (
        ("an empty battery", actions.BATTERY_EMPTY),
        ("a lost GPS", actions.GPS_GONE),
    )
)


@flights([scenario for kind in kinds.BOTH for scenario in takeovers(kind)])
def test_the_pilot_takes_over_between_any_two_commands(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights(IN_CONTROL)
def test_something_happens_in_control(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights((*HEARTBEATS, *ENDINGS))
def test_whose_heartbeats_and_which_mode_at_the_end(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)
