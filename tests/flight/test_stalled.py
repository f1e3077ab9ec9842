"""This program does not run for seconds, as after SIGSTOP, and looks before it has read anything.

After a stall the kernel holds thousands of datagrams; the event loop reads 32 of them before its
timers run, and a heartbeat need not be among these.
"""

import asyncio
from math import hypot

import pytest

from tests.flight.fly import fly, mock_vehicle, run, session_for
from tests.flight.others import When

SHORT = {"hover": {"duration_s": 0.5}}


def stalled(autopilot, seconds, phase="maneuvers"):
    """A hover in which the program stands still; what is on the wire then, it reads first."""
    with mock_vehicle(autopilot=autopilot, delay_s=0.015) as mock:

        def stall():
            asyncio.get_running_loop().clock.now += seconds

        hover = {"duration_s": 9.0 if phase == "maneuvers" else 0.5}
        summary = fly(mock, None, When(phase, stall, after=1.0), hover=hover)
        return summary, mock.state()


@pytest.mark.parametrize("seconds", [1.5, 5.0])
def test_ardupilot_that_still_obeys_after_a_stall_is_asked_to_hold(seconds):
    """It levels and drifts in the wind until somebody commands it."""
    summary, truth = stalled("ardupilot", seconds)
    assert summary.result.startswith("this program did not run for"), summary.events
    assert (truth["mode"], truth["armed"]) == ("BRAKE", True), summary.events


def test_px4_that_its_failsafe_has_taken_and_landed_in_a_stall_is_not_taken_back():
    summary, truth = stalled("px4", 5.0)
    assert summary.result.startswith("this program did not run for"), summary.events
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False)
    assert truth["mode"] == "OFFBOARD", "nothing was commanded since"
    assert summary.events[-1][1] == "the autopilot's failsafe took over: mode AUTO.RTL"


def test_px4_that_landed_while_the_full_buffer_dropped_its_reports_is_not_told_as_falling():
    """The kernel keeps the oldest datagrams: of the landing the program reads only the end."""
    with mock_vehicle(delay_s=0.015, parameters={"COM_OBL_RC_ACT": 4}) as mock:

        def lose_reports():
            mock.inject({"kind": "drop", "direction": "to_companion", "duration_s": 19.95})

        summary = stalled_at(
            mock, "maneuvers", 20.0, 1.0, then=lose_reports, hover={"duration_s": 9.0}
        )
        truth = mock.state()
    texts = [text for _, text in summary.events]
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False), texts
    assert texts[-1] == "the vehicle stands on the ground, disarmed: it landed or fell unwatched"
    accusations = ("does not answer TIMESYNC", "comes too rarely")
    assert not any(words in text for text in texts for words in accusations), texts


@pytest.mark.parametrize("phase", ["takeoff", "offboard", "hand back"])
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_stall_longer_than_the_time_of_a_phase_is_not_told_as_a_fault_of_the_vehicle(
    autopilot, phase
):
    """It has climbed, waits to be taken over, or holds: so the flight goes on."""
    parameters = {"px4": {"COM_OF_LOSS_T": 30.0}, "ardupilot": {}}[autopilot]
    accepted = {"flight": {"accept": ["COM_OF_LOSS_T"]}, "hover": {"duration_s": 0.5}}
    with mock_vehicle(autopilot=autopilot, delay_s=0.015, parameters=parameters) as mock:

        def lose_reports():
            mock.inject({"kind": "drop", "direction": "to_companion", "duration_s": 19.95})

        after = 0.05 if phase == "hand back" else 1.0
        summary = stalled_at(mock, phase, 20.0, after, then=lose_reports, **accepted)
        truth = mock.state()
    assert summary.result == "ok", summary.events
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False)


def test_a_stall_during_the_take_off_does_not_leave_the_vehicle_in_the_air():
    """The heartbeats of the stall are read after it: the vehicle was not silent, we were."""
    summary, truth = stalled("ardupilot", 1.5, "takeoff")
    assert summary.result == "ok", summary.events
    assert (truth["armed"], truth["landed"]) == (False, True)


def test_ardupilot_that_obeyed_the_first_setpoint_before_a_stall_is_asked_to_hold():
    """Its heartbeat had not told yet that it obeys us."""
    with mock_vehicle(autopilot="ardupilot", delay_s=0.015) as mock:
        session = session_for(mock, hover={"duration_s": 9.0})

        async def flown():
            loop = asyncio.get_running_loop()

            def stall():
                loop.clock.now += 3.0

            mock.when(lambda: mock.setpoints, lambda: loop.call_soon(stall))
            return await session.fly()

        summary = run(mock, flown())
        truth = mock.state()
    assert summary.result != "ok"
    assert (truth["mode"], truth["armed"]) == ("BRAKE", True), summary.events


def stalled_at(mock, phase, seconds, after, *, then=lambda: None, **changes):
    """A hover that stalls `after` s into a phase; `then` is called as the stall begins."""

    def stall():
        then()
        asyncio.get_running_loop().clock.now += seconds

    def stall_soon():
        if after == 0.0:
            stall()  # before the phase has asked for anything
        else:
            asyncio.get_running_loop().call_later(after, stall)

    return fly(mock, None, When(phase, stall_soon), **changes)


@pytest.mark.parametrize("after", [0.02, 0.05])
@pytest.mark.parametrize(("autopilot", "piloted"), [("px4", "POSCTL"), ("ardupilot", "LOITER")])
def test_a_pilot_who_takes_over_in_a_stall_of_the_hand_back_is_not_overruled(
    autopilot, piloted, after
):
    """The heartbeat that the program waited for is queued, and older than the takeover."""
    with mock_vehicle(autopilot=autopilot, delay_s=0.015) as mock:

        def take_over_soon():
            takeover = {"kind": "pilot_takeover", "mode": "POSCTL", "at_s": mock.time + 0.8}
            mock.inject(takeover)

        summary = stalled_at(mock, "hand back", 1.5, after, then=take_over_soon, **SHORT)
        mock.run(1.0)  # a command may be on its way
        truth = mock.state()
    assert truth["mode"] == piloted, summary.events
    assert summary.result == f"the pilot or another station took over: mode {piloted}"


def test_an_empty_battery_is_landed_though_the_program_stalls_as_it_asks_for_the_landing():
    """The heartbeats of the stall are read after it, so nothing was silent but the program."""
    with mock_vehicle(autopilot="ardupilot", delay_s=0.015) as mock:
        mock.inject({"kind": "low_battery", "remaining": 0.1, "after_offboard_s": 2.0})
        summary = stalled_at(mock, "land", 1.5, 0.0)
        truth = mock.state()
    assert summary.result.startswith("battery at 10 %"), summary.events
    assert (truth["mode"], truth["armed"], truth["landed"]) == ("LAND", False, True)


def test_a_vehicle_that_drifted_in_a_stall_of_the_hand_back_is_not_flown_back():
    """It drifts half a metre, and is held where it is then."""
    with mock_vehicle(autopilot="ardupilot", delay_s=0.015) as mock:
        summary = stalled_at(mock, "hand back", 5.0, 0.0, then=mock.setpoints.clear, **SHORT)
    assert summary.result == "ok", summary.events
    resumed = [each for each in mock.setpoints if each.time > mock.setpoints[0].time + 1.0]
    assert len(resumed) > 3
    assert max(hypot(*each.rates) for each in resumed) < 1.1, "as if it had to fly back"
