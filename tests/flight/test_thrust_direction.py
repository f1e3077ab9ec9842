"""A vehicle that does not accelerate where its thrust points: its heading was always wrong."""

from math import cos, hypot, radians, sin

import pytest
from pymavlink.dialects.v20 import common as dialect

from tests.flight.fly import fly, mock_vehicle

WIND = {"speed_m_s": 3.0, "gust_m_s": 1.0}
GUSTS = {"speed_m_s": 3.0, "gust_m_s": 3.0, "gust_time_s": 1.0}


class Turned:
    """Turns each attitude that the vehicle sends about the vertical, clockwise by `angle`, rad."""

    def __init__(self, mock, angle):
        self._half = 0.5 * angle
        self._parser, self._packer = dialect.MAVLink(None), dialect.MAVLink(None, 1, 1)
        mock.to_companion = self._datagram

    def _datagram(self, data):
        sent = b""
        for message in self._parser.parse_buffer(data) or ():
            if message.get_type() != "ATTITUDE_QUATERNION":
                sent += message.get_msgbuf()
                continue
            w, x, y, z = message.q1, message.q2, message.q3, message.q4
            c, s = cos(self._half), sin(self._half)
            message.q1, message.q2 = c * w - s * z, c * x - s * y
            message.q3, message.q4 = c * y + s * x, c * z + s * w
            self._packer.seq = message.get_seq()
            sent += message.pack(self._packer)
        return [bytes(sent)] if sent else []


class Heard:
    """Passes on what the vehicle receives, and keeps the texts."""

    def __init__(self, mock):
        self.texts, self._parser = [], dialect.MAVLink(None)
        mock.from_companion = self._datagram

    def _datagram(self, data):
        for message in self._parser.parse_buffer(data) or ():
            if message.get_type() == "STATUSTEXT":
                self.texts.append(message.text)
        return [data]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("turn", [90, 180])
def test_a_vehicle_with_a_wrong_heading_is_not_flown_by_it(autopilot, turn):
    """It spiralled at its tilt limit, 7 to 14 m away, until the tracking error ended it."""
    places = []

    def look():
        if mock.state()["mode"] in ("OFFBOARD", "GUIDED") and not mock.state()["on_ground"]:
            places.append(mock.state()["position"][:2])

    with mock_vehicle(autopilot=autopilot, wind=WIND) as mock:
        Turned(mock, radians(turn))
        heard = Heard(mock)
        mock.after_step.append(look)
        summary = fly(mock, flight={"takeoff_height_m": 6.0}, hover={"duration_s": 10.0})
        truth = mock.state()
    assert "of where the reported attitude points the thrust" in summary.result
    assert (truth["landed"], truth["crashed"]) == (True, False)
    assert max(hypot(*place) for place in places) < 8.0
    assert heard.texts == ["Companion: wrong heading or speed. Fly by hand!"]


@pytest.mark.parametrize(
    ("autopilot", "flight"),
    [
        ("px4", {"hover": {"duration_s": 12.0}}),
        ("ardupilot", {"hover": {"duration_s": 12.0}}),
        ("px4", {"flight": {"maneuvers": ["circle"]}, "guidance": {"drag_per_s": 3.0}}),
        ("ardupilot", {"flight": {"maneuvers": ["circle"]}, "guidance": {"drag_per_s": 3.0}}),
    ],
)
def test_gusts_and_a_wrong_drag_are_no_wrong_heading(autopilot, flight):
    """The thrust balances the gusts, so the vehicle accelerates little."""
    with mock_vehicle(autopilot=autopilot, wind=GUSTS) as mock:
        summary = fly(mock, **flight)
    assert summary.result == "ok", summary.events
