"""A height that changes while the vehicle does not climb or sink, as by a barometer's error."""

import pytest

from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When, change_messages

_DRIFT = 0.9
"""The reported height rises so fast against the vehicle's, m/s, as a real ArduCopter's did."""


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_height_that_rises_alone_lands_the_vehicle_before_the_hold_flies_it_into_the_ground(
    autopilot,
):
    lowest_under_control, was_left = 100.0, False

    def drift():
        began = mock.time

        def lift(message):
            message.z -= _DRIFT * (mock.time - began)

        change_messages(mock, {"LOCAL_POSITION_NED"}, lift)
        mock.after_step.append(watch)

    def watch():
        nonlocal lowest_under_control, was_left
        state = mock.state()
        was_left |= state["mode"] not in ("OFFBOARD", "GUIDED")
        if not was_left:
            lowest_under_control = min(lowest_under_control, -state["position"][2])

    with mock_vehicle(autopilot=autopilot) as mock:
        flight = {"takeoff_height_m": 6.0}
        summary = fly(
            mock, None, When("maneuvers", drift), flight=flight, hover={"duration_s": 9.0}
        )
        truth = mock.state()
    assert "the barometer or the estimator is wrong" in summary.result, summary.events
    assert (truth["on_ground"], truth["crashed"]) == (True, False)
    assert lowest_under_control > 3.5
