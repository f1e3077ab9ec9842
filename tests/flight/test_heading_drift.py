"""A heading that turns while the vehicle does not, as by a disturbed compass."""

from math import cos, hypot, radians, sin

import pytest

from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When, change_messages

_RATE = radians(8.0)


def turn_heading(mock):
    """From here on the attitude tells a heading that turns by `_RATE`."""
    began = mock.time

    def turn(message):
        half = 0.5 * _RATE * (mock.time - began)
        c, s = cos(half), sin(half)
        w, x, y, z = message.q1, message.q2, message.q3, message.q4
        message.q1, message.q2 = c * w - s * z, c * x - s * y
        message.q3, message.q4 = c * y + s * x, c * z + s * w

    change_messages(mock, {"ATTITUDE_QUATERNION"}, turn)


def test_a_heading_that_turns_alone_lands_the_vehicle_before_it_flies_away():
    """It was noticed only by `tracking`, 10 to 60 m away, with the advice to fly in less wind."""
    with mock_vehicle(wind={"speed_m_s": 3.0}) as mock:
        observer = When("maneuvers", lambda: turn_heading(mock))
        summary = fly(mock, None, observer, hover={"duration_s": 12.0})
        truth = mock.state()
    assert "the compass or the estimator is wrong" in summary.result, summary.events
    assert truth["on_ground"]
    assert not truth["crashed"]
    assert summary.tracking()["position_max_m"] < 0.5


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("height", [0.3, 1.5])
def test_a_heading_that_jumps_in_the_climb_lands_the_vehicle_before_it_flies_away(
    autopilot, height
):
    """PX4 was taken over and carried 40 m away; ArduPilot's own hold carried it 68 m away."""
    farthest = 0.0

    def watch():
        nonlocal farthest
        farthest = max(farthest, hypot(*mock.state()["position"][:2]))

    with mock_vehicle(autopilot=autopilot, wind={"gust_m_s": 0.7}) as mock:
        jump = {"kind": "estimator_reset", "yaw_deg": 170.0}
        mock.when(lambda: mock.state()["position"][2] < -height, lambda: mock.inject(jump))
        mock.after_step.append(watch)
        summary = fly(mock)
        truth = mock.state()
    assert summary.result.startswith(
        "not taken over: the estimated heading jumped by 170° in the take-off"
    ), summary.events
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False)
    assert farthest < 2.0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_heading_that_jumps_before_the_vehicle_lifts_off_disarms_it(autopilot):
    """On the ground a jump was accepted as it is, and ArduPilot's own hold flew 113 m away."""
    with mock_vehicle(autopilot=autopilot) as mock:
        jump = {"kind": "estimator_reset", "yaw_deg": 170.0}
        summary = fly(mock, None, When("takeoff", lambda: mock.inject(jump), after=0.0))
        truth = mock.state()
    assert "the estimated heading jumped by 170° in the take-off" in summary.result, summary.events
    assert (truth["armed"], truth["crashed"]) == (False, False)
    assert -truth["position"][2] < 0.3
