"""The autopilot, or the vehicle itself, ends the take-off that the program commanded."""

import pytest
from pymavlink.dialects.v20 import common as dialect

from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When, change_messages


def lose_sticks(mock, lost):
    """A pilot's sticks at rest, until `lost()`: PX4 then holds for COM_FAIL_ACT_T and returns."""
    due = 0.0

    def send():
        nonlocal due
        if lost():
            mock.after_step.remove(send)
        elif mock.time >= due:
            due = mock.time + 0.2
            mock.transmit(dialect.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))

    mock.after_step.append(send)


@pytest.mark.parametrize("mode", ["TAKEOFF", "OFFBOARD"])
def test_a_failsafe_that_holds_before_it_returns_is_named_and_not_overruled(mode):
    """It was told as a stopped climb; just after the takeover its return was cancelled."""

    def lost():
        state = mock.state()
        return state["mode"] == mode and state["position"][2] < -1.0

    with mock_vehicle(parameters={"COM_FAIL_ACT_T": 1.0}) as mock:
        lose_sticks(mock, lost)
        summary = fly(mock, flight={"takeoff_height_m": 3.0})
        mock.run(1.5)
        assert mock.state()["mode"] == "RTL", summary.events
    assert summary.result == "the autopilot's failsafe took over: mode AUTO.LOITER"


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_vehicle_that_does_not_leave_the_ground_is_told_so_and_stops_its_motors(autopilot):
    """It got full thrust for flight.takeoff_timeout_s."""
    with mock_vehicle(autopilot=autopilot, airframe={"thrust_slope_m_s2": 8.0}) as mock:
        summary = fly(mock)
        truth = mock.state()
    assert summary.result.startswith("the vehicle has not left the ground 10 s after")
    assert (truth["armed"], truth["landed"]) == (False, True), summary.events


def test_motors_that_spool_up_slowly_are_waited_for():
    """They were stopped just before the vehicle lifted off."""
    with mock_vehicle(parameters={"COM_SPOOLUP_TIME": 11.0, "COM_DISARM_PRFLT": 20.0}) as mock:
        summary = fly(mock, flight={"takeoff_timeout_s": 60.0}, hover={"duration_s": 0.5})
    assert summary.result == "ok", summary.events


def lie_on_its_side(mock):
    """From here on the attitude tells a roll of 90°."""

    def roll(message):
        message.q1, message.q2, message.q3, message.q4 = 0.5**0.5, 0.5**0.5, 0.0, 0.0

    change_messages(mock, {"ATTITUDE_QUATERNION"}, roll)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_vehicle_that_tips_over_in_the_take_off_is_stopped_at_once(autopilot):
    """It was told 10 s later that it had not left the ground, with its motors at full thrust."""
    with mock_vehicle(autopilot=autopilot, airframe={"thrust_slope_m_s2": 8.0}) as mock:
        observer = When("takeoff", lambda: lie_on_its_side(mock), after=1.0)
        summary = fly(mock, None, observer)
        truth = mock.state()
    assert summary.result == (
        "the vehicle tilts by 90° on the ground: it tipped over in the take-off"
    )
    assert (truth["armed"], truth["landed"]) == (False, True), summary.events
