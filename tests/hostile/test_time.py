"""Attitude comes too seldom, too late, or with stamps of a clock that is not right."""

from tests.hostile import personality as kinds
from tests.hostile.actions import (
    arms,
    clock,
    clock_from_now,
    late,
    silent,
    streams,
    switches,
    tells,
    timesync,
    together,
)
from tests.hostile.endings import (
    failed,
    gives_back,
    never_took_off,
    ok,
    on_the_ground,
    says,
    stops_within,
)
from tests.hostile.personality import ARDUPILOT, PX4
from tests.hostile.scenario import Scenario, flights

ATTITUDE = "ATTITUDE_QUATERNION"
UNIX_S = 1.79e9
WRAP_S = 2**32 / 1000.0
LONG = {"hover": {"duration_s": 12.0}}
NO_TIMESYNC = ("start", 0.0, timesync(None))
HIDDEN = {"ages_hidden": True}
RESTARTED = {"clock_restarts": True}


def asked_again(flown):
    """SET_MESSAGE_INTERVAL of the attitude was sent once more after its rate fell."""
    fell = flown.autopilot.acted[-1]
    sent = [
        each.t
        for each in flown.autopilot.sent
        if each.name == "COMMAND_LONG"
        and each.message.command == kinds.SET_MESSAGE_INTERVAL
        and each.message.param1 == 31
        and each.t > fell
    ]
    assert 1 <= len(sent) <= 4, f"asked again at {sent}"


def gaps(autopilot):
    """120 ms without attitude in every 400 ms."""
    began = autopilot.vehicle.t

    def change(fields):
        return None if (autopilot.vehicle.t - began) % 0.4 < 0.12 else fields

    tells(ATTITUDE, change)(autopilot)


def one_stamp_ahead(autopilot):
    """One sample is stamped 1000 s ahead."""
    ahead = 1_000_000
    change = {"time_boot_ms": autopilot.telemetry.stamp_ms + ahead}
    tells(ATTITUDE, change, seconds=0.03)(autopilot)


RATES = (
    *(
        Scenario(
            f"attitude lowered to {hz:g} Hz for good",
            (("in control", 0.6, streams(ATTITUDE, hz, fixed=True)),),
            (gives_back(3.0), asked_again),
            changes={"hover": {"duration_s": 5.0}},
        )
        for hz in (5.0, 12.0, 25.0)
    ),
    Scenario(
        "attitude lowered to 5 Hz by a station, granted anew when asked for",
        (("in control", 0.6, streams(ATTITUDE, 5.0)),),
        (asked_again, on_the_ground),
    ),
    Scenario(
        "gaps of 120 ms in the attitude again and again",
        (("in control", 0.6, gaps),),
        (gives_back(5.0),),
        changes=LONG,
    ),
    Scenario(
        "silence of 4 s in control",
        (("in control", 0.6, silent(4.0)),),
        (stops_within(0.6),),
    ),
)
LATE = (
    Scenario(
        "telemetry 400 ms late from the start, TIMESYNC prompt",
        (("start", 0.0, late(0.4)),),
        (never_took_off, says(r"\blate|\bold|\bage")),
    ),
    Scenario(
        "telemetry 400 ms late from the start, no TIMESYNC",
        (NO_TIMESYNC, ("start", 0.0, late(0.4))),
        (says(r"not known|unknown"),),
        rules=HIDDEN,
    ),
    Scenario(
        "telemetry 400 ms late from the take-off on",
        (("TAKEOFF", 0.3, late(0.4)),),
        (failed, on_the_ground),
    ),
    Scenario(
        "telemetry 400 ms late in control", (("in control", 0.6, late(0.4)),), (gives_back(2.0),)
    ),
    Scenario(
        "telemetry later by 50 ms every second, TIMESYNC prompt",
        (("in control", 0.0, lambda autopilot: grows_late(autopilot, 0.05)),),
        (gives_back(6.0),),
        changes=LONG,
    ),
    Scenario("TIMESYNC is never answered", (NO_TIMESYNC,), (ok, says(r"not known|unknown"))),
    Scenario(
        "TIMESYNC is answered by UNIX time",
        (("start", 0.0, timesync(lambda t: UNIX_S + t)),),
        (ok,),
    ),
    Scenario(
        "TIMESYNC is answered by a clock that stands",
        (("start", 0.0, timesync(lambda t: 5.0)),),
        (on_the_ground,),
    ),
)


def grows_late(autopilot, share):
    began = autopilot.vehicle.t
    late(lambda t: share * (t - began))(autopilot)


def runs_at(rate):
    return together(clock(lambda t: rate * t), timesync(lambda t: rate * t))


def runs_from(boot):
    """Stamps count from `boot`, s, as a uint32 of ms does; TIMESYNC does not wrap."""
    return together(clock(lambda t: boot + t), timesync(lambda t: boot + t))


RUNNING = tuple(
    Scenario(
        f"the vehicle's clock runs at {rate:g} of ours{told}",
        (("start", 0.0, runs_at(rate)), *more),
        (ok,),
        slow_on=slow,
        changes=LONG,
    )
    for rate in (0.99, 0.994, 1.01)
    for told, more, slow in (("", (), PX4), (", no TIMESYNC", (NO_TIMESYNC,), ARDUPILOT))
)
LEAPING = tuple(
    Scenario(f"the vehicle's clock {what} in control", (("in control", 0.6, action),), demands)
    for what, action, demands in (
        ("jumps ahead by 1 s", clock_from_now(lambda at, t: at + t + 1.0), (gives_back(2.0),)),
        ("jumps back by 1 s", clock_from_now(lambda at, t: at + t - 1.0), (gives_back(2.0),)),
        ("stops", clock_from_now(lambda at, t: at), (gives_back(2.0),)),
        ("runs at half speed", clock_from_now(lambda at, t: at + t / 2), (gives_back(3.0),)),
        ("stamps one sample 1000 s ahead", one_stamp_ahead, (on_the_ground,)),
    )
)
WRAPPING = (
    Scenario(
        "the vehicle's time since boot wraps in control",
        (("start", 0.0, runs_from(WRAP_S - 11.0)),),
        (says("wrapped"),),
        rules=RESTARTED,
        changes=LONG,
    ),
    Scenario(
        "the vehicle's time since boot wraps in the checks",
        (("start", 0.0, runs_from(WRAP_S - 1.9)),),
        (says("wrapped"),),
        rules=RESTARTED,
    ),
    *(
        Scenario(
            "the vehicle's time since boot wraps before the pilot arms",
            (
                ("start", 0.0, runs_from(WRAP_S - 3.3)),
                ("checked", 2.0, arms),
                ("checked", 2.6, switches("READY")),
            ),
            (ok, says("wrapped")),
            (kind,),
            mode=mode,
            rules=RESTARTED,
            changes={"flight": {"arm": False}},
        )
        for kind, mode in ((PX4, "PILOT"), (ARDUPILOT, "STABILIZE"))
    ),
)
ON_THE_GROUND = tuple(
    Scenario(f"on the ground the vehicle's clock {what}", (("reading", 0.4, action),), demands)
    for what, action, demands in (
        ("stamps one sample 1000 s ahead", one_stamp_ahead, (ok,)),
        ("jumps ahead by 1 s", clock_from_now(lambda at, t: at + t + 1.0), (on_the_ground,)),
        ("jumps back by 1 s", clock_from_now(lambda at, t: at + t - 1.0), (on_the_ground,)),
        ("stops", clock_from_now(lambda at, t: at), (never_took_off,)),
    )
)


@flights(RATES)
def test_attitude_comes_too_seldom(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights(LATE)
def test_telemetry_comes_late(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights((*RUNNING, *LEAPING, *WRAPPING))
def test_the_clock_is_wrong_in_flight(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)


@flights(ON_THE_GROUND)
def test_the_clock_is_wrong_on_the_ground(scenario, kind, tmp_path):
    scenario.fly(kind, tmp_path)
