"""The vehicle that was checked goes, and one with the same ids comes; strangers speak."""

import time

from pymavlink.dialects.v20 import common

from tests.hostile import personality as kinds
from tests.hostile.actions import arms, boots_again, restarts, switches
from tests.hostile.endings import failed, never_says, never_took_over, ok, says, stops_within
from tests.hostile.flying import fly_over_sockets
from tests.hostile.judge import commands, judge
from tests.hostile.personality import ARDUPILOT, PX4
from tests.hostile.scenario import Scenario, flights

PILOT_ARMS = {"flight": {"arm": False, "arming_timeout_s": 15.0}}
LATER = (("checked", 10.0, arms), ("checked", 10.6, switches("READY")))
MODES = {PX4.name: "PILOT", ARDUPILOT.name: "STABILIZE"}
ANEW = r"restart|anew|another|booted|rebooted|different"
RESTARTED = {"clock_restarts": True, "ages_hidden": True}


def checked_again(flown):
    """B is fit to fly, so it takes off, with its own parameters and rates read before."""
    came = flown.autopilot.acted[0]
    took_off = [sent.t for sent in commands(flown, kinds.TAKEOFF)]
    assert took_off, "B was not checked anew"
    asked = [sent.name for sent in flown.autopilot.sent if came < sent.t < took_off[0]]
    assert asked.count("PARAM_REQUEST_READ") >= 10, "B was flown by the checks of A"


def on_the_ground(kind):
    arrivals = {
        "A falls silent for 4.5 s, B comes up with a boot time near 0": boots_again(),
        "A falls silent for 2.5 s, B comes up with a boot time near 0": boots_again(2.5),
        "A falls silent for 2 s, B comes from another port": boots_again(2.0, port=True),
        "A falls silent for 4.5 s, B has another uid": boots_again(uid=8),
        "boot time starts anew without a silence": boots_again(0.0),
    }
    for name, action in arrivals.items():
        script = (("checked", 0.3, action), *LATER)
        demands = (checked_again, says(ANEW))
        yield Scenario(
            name,
            script,
            demands,
            (kind,),
            mode=MODES[kind.name],
            rules=RESTARTED,
            changes=PILOT_ARMS,
            over_sockets="port" in name,
        )


IN_FLIGHT = (
    Scenario(
        "the autopilot restarts in the climb",
        (("in air", 0.4, boots_again(1.5)),),
        (never_took_over,),
        rules=RESTARTED,
    ),
    Scenario(
        "the autopilot restarts in control, silent for 1.5 s",
        (("in control", 0.5, boots_again(1.5)),),
        (stops_within(1.6),),
        rules=RESTARTED,
    ),
    Scenario(
        "the autopilot restarts in control in no time",
        (("in control", 0.5, boots_again(0.0)),),
        (stops_within(1.6),),
        rules=RESTARTED,
    ),
)


SILENT = (
    ("in air", 0.4, 0.0),
    ("in control", 0.5, 0.0),
    ("in control", 0.5, 0.3),
    ("in control", 0.5, 1.5),
    ("landing", 0.3, 0.3),
)
TOLD_AS_A_RESTART = [
    Scenario(
        f"it restarts {delay} s after it is {mark}, silent for {silence} s, and sends heartbeats",
        ((mark, delay, restarts(silence)),),
        (failed, says("the autopilot restarted"), never_says("the pilot or another")),
        (ARDUPILOT,),
        rules=RESTARTED,
    )
    for mark, delay, silence in SILENT
]


@flights([scenario for kind in kinds.BOTH for scenario in on_the_ground(kind)])
def test_a_vehicle_that_was_not_checked_is_not_flown(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights(IN_FLIGHT)
def test_a_restart_in_flight_ends_it(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights(TOLD_AS_A_RESTART)
def test_an_autopilot_that_restarts_disarmed_is_told_as_a_restart_not_as_its_pilot(
    scenario, kind, tmp_path
):
    """ArduPilot sends no attitude until somebody requests it: TIMESYNC shows the new clock."""
    flown = scenario.fly(kind, tmp_path)
    assert not flown.result.startswith("the vehicle disarmed")


def test_datagrams_of_a_stranger_before_the_vehicle_speaks(tmp_path):
    """They are queued at the port before the vehicle; in real time, for half a second."""
    sender = common.MAVLink(None, srcSystem=9, srcComponent=1)
    theirs = common.MAVLink_heartbeat_message(2, 12, 29, 0x03040000, 3, 3).pack(sender)

    def interfere(wire):
        for _ in range(50):
            wire.send_from_stranger(theirs)
            wire.send_from_stranger(b"\xfd\x00 no frame at all")
            time.sleep(0.01)

    flown = fly_over_sockets(PX4, (), tmp_path, late_by=interfere)
    judge(flown)
    ok(flown)
