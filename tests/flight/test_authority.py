"""Who may do what: the user interrupts, the pilot arms and takes over, the fence holds."""

import asyncio
from math import inf

import pytest

from companion.control.guidance_loop import GuidanceLoop
from companion.flight import control_phases, takeoff
from companion.flight.observer import SilentObserver
from companion.guidance.source import ManeuverSource
from companion.mavlink.commands import Command, CommandClient
from companion.mavlink.errors import CommandRefused
from companion.mavlink.messages import dialect
from companion.safety.actions import Exit
from companion.vehicle.link import Link
from companion.vehicle.px4.autopilot import Px4
from companion.vehicle.records import LandedState
from companion.vehicle.state import VehicleState
from tests.flight import tlog
from tests.flight.fly import fly, mock_vehicle, run, session_for
from tests.flight.others import When

SHORT = {"hover": {"duration_s": 0.5}}
HOLD_ASKED = (
    "the vehicle is disarmed in OFFBOARD, in which it cannot be armed again: asking the autopilot "
    "to hold"
)


class OnEvent(SilentObserver):
    """Calls `action` once, when an event with this text happens."""

    def __init__(self, text, action):
        self.text, self.action = text, action

    def event(self, time, text):
        if text == self.text and self.action is not None:
            action, self.action = self.action, None
            action()


async def accept():
    return True


def interrupted(mock, folder, phase, ask_landing=None, after=0.0):
    observer = When(phase, lambda: session.interrupt("interrupted by the user"), after)
    session = session_for(mock, folder, observer, ask_landing)
    return run(mock, session.fly()), observer


def test_interrupted_in_flight_and_told_to_land_it_lands():
    with mock_vehicle() as mock:
        summary, observer = interrupted(mock, None, "maneuvers", accept, after=0.5)
        state = mock.state()
    assert summary.result == "interrupted by the user"
    assert observer.phases[-4:] == ["maneuvers", "hand back", "land", "disarm"]
    assert (state["armed"], state["on_ground"], state["crashed"]) == (False, True, False)


def test_interrupted_and_not_told_to_land_it_holds():
    with mock_vehicle() as mock:
        summary, observer = interrupted(mock, None, "maneuvers", after=0.5)
        state = mock.state()
    assert observer.phases[-1] == "hand back"
    assert (state["armed"], state["mode"]) == (True, "LOITER")
    assert summary.phase == "maneuvers"


@pytest.mark.parametrize("phase", ["connect", "checks", "stream"])
def test_interrupted_on_the_ground_it_never_arms(phase):
    with mock_vehicle() as mock:
        summary, observer = interrupted(mock, None, phase)
        assert not mock.state()["armed"]
    assert summary.result == "interrupted by the user"
    assert observer.phases[-1] == phase


def commands(summary):
    """(time, command, first parameter) of each command that we sent."""
    found = tlog.messages(summary, "COMMAND_LONG")
    return [(m._timestamp, m.command, m.param1) for m in found if m.get_srcComponent() == 191]


ARM, TAKEOFF, LAND, SET_MODE = 400, 22, 21, 176


def test_interrupted_as_arming_begins_it_does_not_arm(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        summary, _ = interrupted(mock, tmp_path / "log", "arm")
        assert not mock.state()["armed"]
    assert ARM not in [command for _, command, _ in commands(summary)]


def test_interrupted_once_armed_it_disarms(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        observer = OnEvent("armed", lambda: session.interrupt("interrupted by the user"))
        session = session_for(mock, tmp_path / "log", observer)
        summary = run(mock, session.fly())
        assert not mock.state()["armed"]
    arming = [(command, value) for _, command, value in commands(summary) if command == ARM]
    assert arming == [(ARM, 1.0), (ARM, 0.0)]
    assert summary.result == "interrupted by the user"


def test_interrupted_in_an_emergency_landing_it_goes_on_landing():
    fault = {"kind": "low_battery", "remaining": 0.15, "after_offboard_s": 1.5}
    with mock_vehicle(faults=[fault]) as mock:
        summary, observer = interrupted(mock, None, "land", after=0.0)
        state = mock.state()
    assert "battery at 15 %" in summary.result
    assert observer.phases[-2:] == ["land", "disarm"]
    assert (state["armed"], state["on_ground"], state["crashed"]) == (False, True, False)


def test_an_error_of_ours_in_flight_hands_back_and_lands(monkeypatch):
    def broken(guidance_loop, maneuvers):
        raise ZeroDivisionError("a fault of ours")

    monkeypatch.setattr(GuidanceLoop, "follow", broken)
    with mock_vehicle() as mock:
        summary = fly(mock)
        state = mock.state()
    assert summary.result == "internal error: ZeroDivisionError('a fault of ours')"
    assert (state["armed"], state["on_ground"], state["crashed"]) == (False, True, False)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_guidance_that_fails_once_holds_the_vehicle_until_the_autopilot_has_it(
    monkeypatch, autopilot
):
    """A slow link: without commands the last rates would be held until the landing is accepted."""

    def broken(*_):
        raise ZeroDivisionError("a fault of ours")

    steered = [0.0]

    def look():
        state = mock.state()
        if state["armed"] and state["mode"] in ("OFFBOARD", "GUIDED"):
            steered[0] = mock.time

    with mock_vehicle(autopilot=autopilot, delay_s=0.025) as mock:
        mock.after_step.append(look)
        observer = When(
            "maneuvers", lambda: monkeypatch.setattr(ManeuverSource, "reference", broken), after=1.0
        )
        session = session_for(mock, None, observer, deadman={"target_stale_ms": 40.0})
        summary = run(mock, session.fly())
    assert summary.result == "internal error: ZeroDivisionError('a fault of ours')"
    assert steered[0] - mock.setpoints[-1].time < 0.1


def test_a_false_landing_in_control_is_not_made_true(tmp_path):
    """An autopilot that calls a flying vehicle landed must not get thrust 0 for it."""

    def claim():
        session._assembled.context.link.state.landed_state = LandedState(inf, 1)

    with mock_vehicle(tmp_path) as mock:
        observer = When("maneuvers", claim, after=2.0)
        session = session_for(mock, tmp_path / "log", observer)
        summary = run(mock, session.fly())
        assert not mock.state()["crashed"]
    assert summary.result == "the autopilot says that it has landed"
    took_over = next(at for at, text in summary.events if text == "mode OFFBOARD")
    setpoints = tlog.messages(summary, "SET_ATTITUDE_TARGET")
    assert min(m.thrust for m in setpoints if m._timestamp > took_over) > 0.3


def test_a_mode_that_is_not_told_any_more_lets_the_vehicle_go(tmp_path):
    silent = ["HEARTBEAT", "CURRENT_MODE", "ATTITUDE_TARGET"]
    fault = {"kind": "stop_telemetry", "messages": silent, "after_offboard_s": 2.0}
    takeover = {"kind": "pilot_takeover", "mode": "POSCTL", "after_offboard_s": 2.5}
    with mock_vehicle(tmp_path, faults=[fault, takeover]) as mock:
        summary = fly(mock, tmp_path / "log", hover={"duration_s": 5.0})
        assert mock.state()["mode"] == "POSCTL"
    assert "no heartbeat" in summary.result
    assert summary.events[-1][1] == (
        "the vehicle is heard again, armed in POSCTL: nothing is commanded"
    )
    took_over = next(at for at, text in summary.events if text == "mode OFFBOARD")
    assert {command for at, command, _ in commands(summary) if at > took_over + 1.0} <= {512}


def test_a_takeover_that_is_not_told_shows_in_the_setpoints_that_the_autopilot_obeys():
    """The program then requests a heartbeat, long before it would miss one."""
    silent = ["HEARTBEAT", "CURRENT_MODE"]
    fault = {"kind": "stop_telemetry", "messages": silent, "after_offboard_s": 2.0}
    takeover = {"kind": "pilot_takeover", "mode": "POSCTL", "after_offboard_s": 2.5}
    with mock_vehicle(faults=[fault, takeover]) as mock:
        summary = fly(mock, hover={"duration_s": 5.0})
        assert mock.state()["mode"] == "POSCTL"
    assert summary.result == "the pilot or another station took over: mode POSCTL"
    offboard_at = next(at for at, text in summary.events if text == "mode OFFBOARD")
    assert summary.events[-1][0] < offboard_at + 3.0


def test_without_heartbeats_no_setpoint_is_sent_though_the_mode_is_told():
    """Only they tell whether it is armed; one on request lets us ask for the hold."""
    fault = {"kind": "stop_telemetry", "messages": ["HEARTBEAT"], "after_offboard_s": 2.0}
    with mock_vehicle(faults=[fault]) as mock:
        summary = fly(mock, hover={"duration_s": 9.0})
        assert mock.state()["mode"] == "LOITER"
        assert mock.setpoints[-1].time < mock.time - 0.02
    assert "whether it is armed is not known" in summary.result
    assert Exit.LISTEN.value in [text for _, text in summary.events]


def test_a_pilot_whose_takeover_cannot_be_heard_is_not_overruled(tmp_path):
    silence = {"kind": "drop", "direction": "to_companion", "after_offboard_s": 2.0}
    takeover = {"kind": "pilot_takeover", "mode": "POSCTL", "after_offboard_s": 2.2}
    with mock_vehicle(tmp_path, faults=[silence, takeover]) as mock:
        summary = fly(mock, tmp_path / "log")
        assert mock.state()["mode"] == "POSCTL"
    assert "no attitude" in summary.result
    assert summary.as_dict()["at_the_end"]["unheard_s"] > 4.0
    took_over = next(at for at, text in summary.events if text == "mode OFFBOARD")
    assert {command for at, command, _ in commands(summary) if at > took_over + 1.0} <= {512}


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_pilot_who_took_over_unheard_is_not_overruled_once_heard(autopilot):
    silence = {
        "kind": "drop",
        "direction": "to_companion",
        "duration_s": 2.0,
        "after_offboard_s": 2.0,
    }
    takeover = {"kind": "pilot_takeover", "mode": "POSCTL", "after_offboard_s": 2.2}
    with mock_vehicle(autopilot=autopilot, faults=[silence, takeover]) as mock:
        summary = fly(mock)
        piloted = mock.state()["mode"]
    assert piloted in ("POSCTL", "LOITER")
    assert summary.events[-1][1].endswith("nothing is commanded")


def test_a_link_lost_in_the_takeoff_is_told_at_once():
    with mock_vehicle() as mock:
        cut = {"kind": "drop", "direction": "to_companion"}
        observer = When("takeoff", lambda: mock.inject(cut), after=1.0)
        summary = fly(mock, None, observer)
        assert mock.state()["armed"]
    assert (summary.phase, "no heartbeat" in summary.result) == ("takeoff", True)
    began = next(at for at, text in summary.events if "TAKEOFF" in text)
    lost = next(at for at, text in summary.events if "no heartbeat" in text)
    assert lost < began + 5.0  # 1 s of climb, three heartbeats missed


def test_a_hold_that_somebody_else_commands_in_the_climb_is_respected(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        observer = When("takeoff", lambda: mock.command(SET_MODE, 1, 4, 3), after=1.0)
        summary = fly(mock, tmp_path / "log", observer, flight={"takeoff_height_m": 20.0})
        assert mock.state()["mode"] == "LOITER"
    assert "another station stopped the climb" in summary.result
    asked = [command for _, command, _ in commands(summary)]
    assert [command for command in asked if command != dialect.MAV_CMD_REQUEST_MESSAGE][
        -1
    ] == TAKEOFF


def test_a_hold_right_after_our_take_over_is_respected(tmp_path, monkeypatch):
    """As if a pilot's switch came between our command and the next heartbeat."""
    monkeypatch.setattr(Px4, "offboard_mode", "AUTO.LOITER")
    with mock_vehicle(tmp_path) as mock:
        summary = fly(mock, tmp_path / "log")
        assert mock.state()["mode"] == "LOITER"
    assert summary.result == (
        "the autopilot accepted the change of mode, but reports a mode that we did not command: "
        "AUTO.LOITER"
    )
    assert commands(summary)[-1][1] == SET_MODE  # nothing is commanded any more


class LostAnswer:
    """The first answer to a command is lost, and then something happens."""

    def __init__(self, monkeypatch, command, then):
        heard, lost = CommandClient._on_ack, []

        def hear(client, message):
            if message.command == command and not lost:
                lost.append(message)
                then()
                return
            heard(client, message)

        monkeypatch.setattr(CommandClient, "_on_ack", hear)


def test_a_mode_that_the_autopilots_geofence_chose_is_not_told_as_the_pilots():
    """ArduPilot's HEARTBEAT reports no failsafe then; only a text tells."""
    message = dialect.MAVLink_statustext_message(5, b"Circle fence breached")
    text = bytes(message.pack(dialect.MAVLink(None, 1, 1)))

    def breach():
        mock.to_companion = lambda data: [data, text]  # after the HEARTBEAT, as the real one
        mock.command(SET_MODE, 1, 6)  # RTL

    with mock_vehicle(autopilot="ardupilot") as mock:
        summary = fly(mock, None, When("maneuvers", breach, after=1.0))
        assert mock.state()["mode"] == "RTL"
    assert summary.result == "the autopilot's failsafe took over: mode RTL"


def test_a_pilots_disarming_is_not_undone_by_repeating_our_arming(tmp_path, monkeypatch):
    def disarm_soon():
        asyncio.get_running_loop().call_later(0.5, mock.command, ARM, 0)

    with mock_vehicle(tmp_path, in_lockstep=True) as mock:
        LostAnswer(monkeypatch, ARM, disarm_soon)
        summary = fly(mock, tmp_path / "log")
        assert not mock.state()["armed"]
    assert summary.result == "the pilot disarmed again", summary.events
    assert [command for _, command, _ in commands(summary)].count(ARM) == 1


def test_a_landing_is_not_repeated_over_a_pilot(tmp_path, monkeypatch):
    def take():
        mock.take_over("POSCTL")

    with mock_vehicle(tmp_path) as mock:
        LostAnswer(monkeypatch, LAND, take)
        summary = fly(mock, tmp_path / "log", **SHORT)
        assert mock.state()["mode"] == "POSCTL"
    assert [command for _, command, _ in commands(summary)].count(LAND) == 1
    assert "took over: mode POSCTL" in summary.result


def test_a_pilot_who_keeps_it_armed_after_our_landing_is_not_disarmed(tmp_path):
    with mock_vehicle(tmp_path, parameters={"COM_DISARM_LAND": -1.0}) as mock:
        observer = When("disarm", lambda: mock.take_over("STABILIZED"), after=1.0)
        summary = fly(mock, tmp_path / "log", observer, **SHORT)
        state = mock.state()
    assert "took over: mode STABILIZED" in summary.result
    assert (state["mode"], state["armed"]) == ("STABILIZED", True)
    assert ARM not in [command for _, command, first in commands(summary) if first == 0.0]


def test_a_vehicle_that_somebody_arms_after_the_checks_is_not_taken(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        observer = When("stream", lambda: mock.command(ARM, 1))
        summary = fly(mock, tmp_path / "log", observer)
        assert mock.state()["on_ground"]
    assert "already armed" in summary.result
    assert TAKEOFF not in [command for _, command, _ in commands(summary)]


def test_a_vehicle_that_does_not_say_it_stands_is_not_armed(tmp_path):
    silent = {"kind": "stop_telemetry", "messages": ["EXTENDED_SYS_STATE"]}
    with mock_vehicle(tmp_path, faults=[silent]) as mock:
        summary = fly(mock, tmp_path / "log", flight={"arming_timeout_s": 3.0})
        assert not mock.state()["armed"]
    assert "does not report that the vehicle is on the ground" in summary.result
    assert ARM not in [command for _, command, _ in commands(summary)]


def test_a_hold_near_the_top_of_the_climb_is_respected(tmp_path, monkeypatch):
    over, held = takeoff._Climb.is_over, []

    def holding(climb):
        if climb._context.link.state.height > 3.3 and not held:
            held.append(mock.command(SET_MODE, 1, 4, 3))
        return over(climb)

    monkeypatch.setattr(takeoff._Climb, "is_over", holding)
    with mock_vehicle(tmp_path, parameters={"MPC_TKO_SPEED": 1.0}) as mock:
        summary = fly(mock, tmp_path / "log", flight={"takeoff_height_m": 5.0})
        assert mock.state()["mode"] == "LOITER"
    assert "another station stopped the climb" in summary.result
    assert LAND not in [command for _, command, _ in commands(summary)]


def test_a_pilots_mode_just_before_the_end_is_seen_before_the_hand_back(monkeypatch):
    """The newest heartbeat is a tenth of a second old, and we know better only if we ask."""
    hand_over = control_phases.hand_over_to_hold

    async def taking(context):
        mock.take_over("POSCTL")
        await asyncio.sleep(0.01)  # faults begin with the vehicle's next step
        await hand_over(context)

    monkeypatch.setattr(control_phases, "hand_over_to_hold", taking)
    with mock_vehicle() as mock:
        summary = fly(mock, **SHORT)
        assert mock.state()["mode"] == "POSCTL"
    assert "took over: mode POSCTL" in summary.result


def test_a_vehicle_whose_home_is_elsewhere_is_not_taken_off_with(tmp_path, monkeypatch):
    monkeypatch.setattr(VehicleState, "height", -12.0)
    with mock_vehicle(tmp_path) as mock:
        summary = fly(mock, tmp_path / "log")
        state = mock.state()
    assert "stands 12.0 m below home" in summary.result
    assert (state["armed"], state["on_ground"]) == (False, True)
    assert TAKEOFF not in [command for _, command, _ in commands(summary)]


def test_a_link_that_is_always_late_is_refused_before_takeoff():
    late = {"kind": "delay", "delay_ms": 300.0, "direction": "to_companion"}
    with mock_vehicle(faults=[late]) as mock:
        summary = fly(mock)
        assert not mock.state()["armed"]
    assert summary.phase == "checks"
    assert "round trip" in summary.result


def test_without_being_told_to_it_waits_for_the_pilot_to_arm():
    with mock_vehicle() as mock:
        observer = When("arm", lambda: mock.command(ARM, 1), after=3.0)
        summary = fly(mock, None, observer, flight={"arm": False}, **SHORT)
    assert summary.result == "ok", summary.events
    assert next(at for at, text in summary.events if text == "armed") > 5.0


def test_a_pilot_who_arms_in_another_mode_is_waited_for_and_not_taken_off_with(tmp_path):
    def arm_and_keep():
        mock.take_over("POSCTL")
        mock.command(ARM, 1)

    with mock_vehicle(tmp_path) as mock:
        observer = When("arm", arm_and_keep, after=1.0)
        changes = {"arm": False, "arming_timeout_s": 6.0}
        summary = fly(mock, tmp_path / "log", observer, flight=changes)
        assert mock.state()["mode"] == "POSCTL"
    assert "by switching to AUTO.LOITER" in summary.result
    assert {command for _, command, _ in commands(summary)} <= {511, 512}


def test_if_the_pilot_does_not_arm_nothing_happens():
    with mock_vehicle() as mock:
        summary = fly(mock, flight={"arm": False, "arming_timeout_s": 2.0})
        assert not mock.state()["armed"]
    assert summary.phase == "arm"
    assert "the pilot to arm" in summary.result


def test_a_vehicle_that_is_armed_already_is_not_touched(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        interrupted(mock, tmp_path / "first", "maneuvers")
        before = mock.state()
        summary = fly(mock, tmp_path / "second")
        after = mock.state()
    assert summary.result == "the vehicle is already armed; land and disarm it first"
    assert (before["armed"], after["armed"], after["mode"]) == (True, True, "LOITER")
    assert after["setpoints"] == before["setpoints"]


def test_the_pilot_takes_over_during_the_takeoff():
    with mock_vehicle() as mock:
        observer = When("takeoff", mock.take_over, after=1.0)
        summary = fly(mock, None, observer)
        state = mock.state()
    assert summary.result == "the pilot or another station took over: mode POSCTL"
    assert summary.phase == "takeoff"
    assert observer.phases[-1] == "takeoff"  # nothing is commanded any more
    assert state["mode"] == "POSCTL"


def test_leaving_the_fence_lands_and_leaves_the_vehicle_in_hold():
    """PX4 goes back to OFFBOARD when it disarms, where it never is ready to be armed again.

    In steady air it would stay inside the fence: open-loop steps know nothing of a gust.
    """
    with mock_vehicle(wind={"gust_m_s": 4.0, "gust_time_s": 3.0}) as mock:
        summary = fly(mock, None, flight={"maneuvers": ["steps"]}, limits={"fence_radius_m": 5.0})
        state = mock.state()
    assert "beyond limits.fence_radius_m" in summary.result
    beside = ("autopilot: ", "the vehicle's drag")
    said = [text for _, text in summary.events if not text.startswith(beside)]
    assert said[-3:] == ["disarmed", HOLD_ASKED, "mode AUTO.LOITER"]
    assert (state["mode"], state["on_ground"], state["crashed"]) == ("LOITER", True, False)


def test_an_autopilot_that_gives_no_heartbeat_on_demand_is_waited_for(monkeypatch):
    command = Link.command

    async def refuse(link, number, *parameters, **options):
        if number == dialect.MAV_CMD_REQUEST_MESSAGE:
            raise CommandRefused("MAV_CMD_REQUEST_MESSAGE", 3, "UNSUPPORTED", ())
        await command(link, number, *parameters, **options)

    monkeypatch.setattr(Link, "command", refuse)
    with mock_vehicle() as mock:
        summary = fly(mock, **SHORT)
        assert not mock.state()["crashed"]
    assert summary.result == "ok", summary.events


def test_a_hold_that_is_refused_becomes_a_landing(monkeypatch):
    """Interrupted, and the autopilot does not hold: it must not be left to its last rates."""
    monkeypatch.setattr(Px4, "hold", lambda _: Command(dialect.MAV_CMD_DO_SET_MODE, 1.0, 99.0))
    with mock_vehicle() as mock:
        observer = When("maneuvers", lambda: session.interrupt("Ctrl-C"), after=1.0)
        session = session_for(mock, None, observer)
        summary = run(mock, session.fly())
        state = mock.state()
    said = [text for _, text in summary.events]
    assert said.index(Exit.HOLD.value) < said.index(Exit.LAND.value)
    assert (state["armed"], state["on_ground"], state["crashed"]) == (False, True, False)


def test_a_landing_that_nobody_answers_is_asked_for_until_it_is():
    """ArduPilot stays in GUIDED and drifts: the program must not give up while it may land it."""
    outage = {"kind": "drop", "direction": "from_companion", "duration_s": 14.0}
    with mock_vehicle(autopilot="ardupilot") as mock:
        observer = When("maneuvers", lambda: mock.inject(outage), after=1.0)
        summary = run(mock, session_for(mock, None, observer, hover={"duration_s": 1.5}).fly())
        state = mock.state()
    assert "no answer to 4 tries; does the uplink work?" in summary.result
    assert (state["armed"], state["on_ground"], state["crashed"]) == (False, True, False)


def test_an_error_at_every_sample_does_not_stop_the_landing(monkeypatch):
    """Guidance and the sample's path are broken for good: the autopilot still is asked to land."""

    def broken(*_):
        raise ZeroDivisionError("a fault of ours")

    def breaks():
        monkeypatch.setattr(GuidanceLoop, "hold_here", broken)
        monkeypatch.setattr(GuidanceLoop, "note_attitude", broken)

    with mock_vehicle() as mock:
        observer = When("maneuvers", breaks, after=1.0)
        session = session_for(mock, None, observer)
        summary = run(mock, session.fly())
        state = mock.state()
    assert summary.result == "internal error: ZeroDivisionError('a fault of ours')"
    assert (state["armed"], state["on_ground"], state["crashed"]) == (False, True, False)


def test_the_vehicle_is_armed_in_a_mode_of_ours():
    """With the sticks in POSCTL before the checks, as a transmitter leaves it."""
    with mock_vehicle(faults=[{"kind": "pilot_takeover", "at_s": 0.1}]) as mock:
        summary = fly(mock, **SHORT)
    assert summary.result == "ok", summary.events
