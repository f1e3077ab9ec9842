"""A heading that turns while the vehicle does not, as by a disturbed compass."""

from math import cos, radians, sin

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
