"""This program does not run for seconds, as after SIGSTOP, and looks before it has read anything.

After a stall the kernel holds thousands of datagrams; the event loop reads 32 of them before its
timers run, and a heartbeat need not be among these.
"""

import asyncio

import pytest

from tests.flight.fly import fly, mock_vehicle, run, session_for
from tests.flight.others import When


def stalled(autopilot, seconds, phase="maneuvers"):
    """A hover in which the program stands still; what is on the wire then, it reads first."""
    with mock_vehicle(autopilot=autopilot, delay_s=0.015) as mock:

        def stall():
            asyncio.get_running_loop().clock.now += seconds

        summary = fly(mock, None, When(phase, stall, after=1.0), hover={"duration_s": 9.0})
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
    assert summary.events[-1][1].endswith("disarmed in OFFBOARD: nothing is commanded")


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
