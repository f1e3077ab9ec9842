"""COMMAND_ACK lies, or does not come; what a vehicle does with a take-off."""

from itertools import pairwise

from tests.hostile import actions
from tests.hostile import personality as kinds
from tests.hostile.actions import acks, sets, tells
from tests.hostile.endings import failed, never_took_off, never_took_over, ok, on_the_ground
from tests.hostile.judge import setpoints
from tests.hostile.personality import BOTH, PX4
from tests.hostile.scenario import Scenario, flights, in_turn

DONE = ("does it and never answers", "answers twice", "does it and answers somebody else")
NOT_DONE = (
    "accepts it and does nothing",
    "refuses it",
    "never hears it",
    "is in progress for ever",
)
COMMANDS = {
    # command: (from when, its number, what holds where it is not done)
    "arming": ("start", kinds.ARM, (never_took_off, on_the_ground)),
    "a take-off": ("start", kinds.TAKEOFF, (never_took_over, on_the_ground)),
    "the landing": ("holding", None, (failed,)),
}


def answered(kind):
    """Each command of a flight, with each way of answering it."""
    for what, (mark, number, demands) in COMMANDS.items():
        landing = kinds.SET_MODE if kind.enters_by_setpoint else kinds.LAND
        command = number or landing
        for how in NOT_DONE:
            yield row(f"the vehicle, asked for {what}, {how}", mark, command, how, demands, kind)
        for how in DONE:
            yield row(f"the vehicle, asked for {what}, {how}", mark, command, how, (ok,), kind)
        how = "refuses it and does it"
        yield row(f"the vehicle, asked for {what}, {how}", mark, command, how, (), kind)


def row(name, mark, command, how, demands, kind):
    return Scenario(name, ((mark, 0.0, acks(command, how)),), demands, (kind,))


OFFBOARD = tuple(
    row(f"PX4, asked for OFFBOARD, {how}", "armed", kinds.SET_MODE, how, demands, PX4)
    for how, demands in (
        *((how, (never_took_over,)) for how in NOT_DONE),
        *((how, (ok,)) for how in DONE),
        ("refuses it and does it", (on_the_ground,)),
    )
)


def asked_to_hold(kind):
    """ArduPilot is asked to land by SET_MODE, too; it would drift without us, so we go on."""
    pilot = (("in control", 20.0, actions.takes("PILOT")),) if kind.enters_by_setpoint else ()
    for how in (*NOT_DONE, *DONE, "refuses it and does it"):
        name = f"the vehicle, asked to hold, {how}"
        scenario = row(name, "in control", kinds.SET_MODE, how, (), kind)
        yield scenario._replace(script=(*scenario.script, *(pilot if how in NOT_DONE else ())))


def mode_told_late(autopilot):
    """HEARTBEAT tells the mode of a second ago."""
    before = {
        name: value
        for name, value in autopilot.telemetry.heartbeat().items()
        if name in ("base_mode", "custom_mode")
    }
    tells("HEARTBEAT", before, seconds=1.5)(autopilot)


TAKE_OFFS = (
    Scenario(
        "the vehicle climbs past the height by 6 m",
        (("start", 0.0, sets(climbs_to=8.0)),),
        (never_took_over, on_the_ground),
    ),
    Scenario(
        "the vehicle climbs on and on",
        (("start", 0.0, sets(climbs_to=100.0)),),
        (never_took_over,),
    ),
    Scenario(
        "the vehicle takes off by itself before we arm",
        (("reading", 0.8, actions.takes_off_by_itself),),
        (failed,),
    ),
    Scenario("the vehicle is armed already", (("start", 0.0, actions.arms),), (never_took_off,)),
    Scenario(
        "the vehicle disarms as soon as it is armed",
        (("armed", 0.04, actions.disarms),),
        (never_took_off,),
    ),
    Scenario(
        "the vehicle disarms in the climb",
        (("in air", 0.3, actions.disarms),),
        (never_took_over,),
        rules={"may_fall": True},
    ),
    Scenario(
        "OFFBOARD is told 1.5 s late",
        (("SET_MODE RATES", 0.0, mode_told_late),),
        (),
        (PX4,),
    ),
    Scenario("PX4 was left in OFFBOARD", (), (ok,), (PX4,), mode="RATES"),
)


def left_holding(flown):
    assert flown.autopilot.vehicle.mode == "HOLD", flown.events


def not_left_to_our_rates(flown):
    assert flown.autopilot.vehicle.mode != "RATES", flown.events


def endings(kind):
    """Commands of an exit that have no effect for a while, or for ever."""
    landing = kinds.SET_MODE if kind.enters_by_setpoint else kinds.LAND
    patient = {"flight": {"landing_timeout_s": 15.0}}
    empty = actions.BATTERY_EMPTY
    for how, demand in (
        ("refuses it", on_the_ground),
        ("accepts it and does nothing", not_left_to_our_rates),
        ("never hears it", on_the_ground),
    ):
        yield Scenario(
            f"the battery is empty, and for 3 s the vehicle, asked to land, {how}",
            (
                ("in control", 0.7, actions.together(empty, acks(landing, how))),
                ("in control", 3.7, acks(landing, "honest")),
            ),
            (failed, demand),
            (kind,),
            changes=patient,
        )
    yield Scenario(
        "the vehicle, asked to land after its hold, refuses it for 2 s",
        (
            ("holding", 0.0, acks(landing, "refuses it")),
            ("holding", 2.0, acks(landing, "honest")),
        ),
        (ok,),
        (kind,),
        changes=patient,
    )
    yield Scenario(
        "the vehicle, asked to hold, accepts it, and does so when asked again",
        (
            ("in control", 0.7, acks(kinds.SET_MODE, "accepts it and does nothing")),
            ("in control", 5.0, acks(kinds.SET_MODE, "honest")),
        ),
        (ok,),
        (kind,),
    )


def holds_in_between(kind):
    """A pilot who switches to hold is not overruled by the next request to land."""
    empty, landing = (
        actions.BATTERY_EMPTY,
        kinds.SET_MODE if kind.enters_by_setpoint else kinds.LAND,
    )
    refusals = [acks(command, "refuses it") for command in {landing, kinds.SET_MODE}]
    yield Scenario(
        "the vehicle refuses to land and to hold, and the pilot switches to hold",
        (
            ("in control", 0.7, actions.together(empty, *refusals)),
            ("in control", 3.2, actions.takes("HOLD")),
        ),
        (failed, left_holding),
        (kind,),
        changes={"flight": {"landing_timeout_s": 15.0}},
    )


def held_until_the_pilot_has_it(flown):
    """Past the 5 s of `landing_timeout_s` it is steered, and its pilot is warned."""
    taken = flown.autopilot.marks["taken"]
    steered = [sent.t for sent in setpoints(flown) if taken - 15.0 < sent.t < taken]
    gaps = [later - sooner for sooner, later in pairwise(steered)]
    assert max(gaps) < 0.1, gaps
    assert flown.autopilot.vehicle.mode == "PILOT"
    texts = [sent for sent in flown.autopilot.sent if sent.name == "STATUSTEXT"]
    assert len(texts) >= 2, flown.events
    assert "switch its mode by transmitter" in flown.events


def for_ever(kind):
    """PX4's own failsafe acts once we stop; ArduPilot would drift."""
    commands = {kinds.LAND, kinds.SET_MODE} if kind.enters_by_setpoint else {kinds.LAND}
    refusals = [acks(command, "refuses it") for command in commands]
    pilot = (("in control", 30.0, actions.takes("PILOT")),) if kind.enters_by_setpoint else ()
    demand = held_until_the_pilot_has_it if kind.enters_by_setpoint else left_holding
    yield Scenario(
        "the battery is empty, and the vehicle refuses to land for ever",
        (("in control", 0.7, actions.together(actions.BATTERY_EMPTY, *refusals)), *pilot),
        (failed, demand),
        (kind,),
    )


FOR_EVER = tuple(row for kind in BOTH for row in for_ever(kind))


@flights((*in_turn(endings), *in_turn(holds_in_between), *FOR_EVER))
def test_a_command_of_an_exit_has_no_effect(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights(in_turn(answered))
def test_a_command_is_not_answered_as_it_is_done(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights((*OFFBOARD, *in_turn(asked_to_hold)))
def test_a_mode_is_not_answered_as_it_is_entered(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights(TAKE_OFFS)
def test_the_vehicle_does_something_else(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)
