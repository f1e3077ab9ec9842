"""A pilot's choice in the second in which the answer to our command is lost."""

import pytest
from pymavlink.dialects.v20 import common as dialect

from tests.flight.fly import fly, mock_vehicle

SET_MODE, TAKEOFF, LAND, ARM = 176, 22, 21, 400
LOST_FOR, LATER = 1.2, 0.1
HOLD = SET_MODE, 1, 4, 3
KILL = ARM, 0, 21196


class LostAnswers:
    """Loses every message of one kind for a while from the first command that `begins` it.

    `LATER` s after that command, `then` happens.
    """

    def __init__(self, mock, begins, then, *, lost="COMMAND_ACK", seconds=LOST_FOR):
        self.mock, self.begins, self.then = mock, begins, then
        self.lost, self.seconds = lost, seconds
        self.up, self.down = dialect.MAVLink(None), dialect.MAVLink(None)
        self.began, self.sent_later = None, []
        mock.from_companion = self.from_companion
        mock.to_companion = self.to_companion

    @property
    def is_losing(self):
        return self.began is not None and self.mock.time < self.began + self.seconds

    def from_companion(self, data):
        for message in self.up.parse_buffer(data) or ():
            if message.get_srcSystem() == 255 or message.get_type() != "COMMAND_LONG":
                continue
            if self.began is None and self.begins(message):
                self.began = self.mock.time
                self.mock.at(self.began + LATER, self.then)
            elif self.began is not None and message.command in (SET_MODE, TAKEOFF, LAND):
                self.sent_later.append(message.command)
            if self.is_losing and self.lost == "COMMAND_LONG":
                return []
        return [data]

    def to_companion(self, data):
        kinds = [message.get_type() for message in self.down.parse_buffer(data) or ()]
        return [] if self.is_losing and self.lost in kinds else [data]


@pytest.mark.parametrize(
    "begins",
    [
        lambda sent: sent.command == TAKEOFF,
        lambda sent: (sent.command, sent.param2) == (SET_MODE, 6),
        lambda sent: sent.command == LAND,
    ],
    ids=["take-off", "takeover", "landing"],
)
def test_a_pilot_who_holds_before_the_answer_comes_is_obeyed(begins):
    with mock_vehicle() as mock:
        lost = LostAnswers(mock, begins, lambda: mock.command(*HOLD))
        summary = fly(mock, hover={"duration_s": 0.5})
        assert mock.state()["mode"] == "LOITER"
    # The climb may have begun before the pilot holds.
    assert summary.result.startswith(
        (
            "the pilot or another station took over: mode AUTO.LOITER",
            "the pilot, the autopilot or another station stopped the climb at ",
        )
    )
    assert lost.sent_later == []


@pytest.mark.parametrize("begins", [6, 4], ids=["takeover", "hand-back"])
def test_a_vehicle_killed_in_the_air_is_commanded_no_more(begins):
    """The monitors watch only while it obeys us, and an ended flight would be called good."""
    with mock_vehicle() as mock:

        def is_begin(sent):
            in_air = mock.state()["position"][2] < -1.0
            return in_air and (sent.command, sent.param2) == (SET_MODE, begins)

        lost = LostAnswers(mock, is_begin, lambda: mock.command(*KILL), lost="COMMAND_LONG")
        summary = fly(mock, hover={"duration_s": 0.5})
        assert mock.state()["crashed"]
    assert summary.result == "the vehicle disarmed in flight"
    assert lost.sent_later == []


def test_a_pilot_who_disarms_before_a_heartbeat_shows_the_arming_is_told_soon():
    """The phase waited for the armed flag until its timeout, a minute."""
    with mock_vehicle() as mock:

        def disarm():
            mock.command(ARM, 0)

        LostAnswers(mock, lambda sent: sent.command == ARM, disarm, lost="HEARTBEAT")
        summary = fly(mock)
        assert mock.state()["armed"] is False
    assert summary.result == "the autopilot accepted arming, but reports that it is disarmed"
    assert summary.events[-1][0] < 20.0


def test_a_vehicle_of_which_no_heartbeat_shows_the_arming_is_soon_disarmed():
    """It stood armed for a minute."""
    with mock_vehicle() as mock:
        arming = lambda sent: (sent.command, sent.param1) == (ARM, 1)  # noqa: E731
        LostAnswers(mock, arming, lambda: None, lost="HEARTBEAT", seconds=8.0)
        summary = fly(mock)
        assert mock.state()["armed"] is False
    assert summary.result.startswith("no heartbeat from the vehicle, so whether it is armed")
    assert summary.phase == "arm"


IN_THE_AIR = "the pilot, the autopilot or another station disarmed the vehicle in the air"
HARD = "the vehicle hit the ground hard: it fell in its landing or crashed"


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    ("lost", "told"),
    [("COMMAND_ACK", f"{IN_THE_AIR} during the landing, and it fell"), ("HEARTBEAT", HARD)],
    ids=["answers", "heartbeats"],
)
def test_a_vehicle_killed_as_its_landing_begins_did_not_land_well(autopilot, lost, told):
    """The fall was over before it was looked for, and the flight was called good."""
    with mock_vehicle(autopilot=autopilot) as mock:

        def is_landing(sent):
            return sent.command == LAND or (sent.command, sent.param2) == (SET_MODE, 9)

        LostAnswers(mock, is_landing, lambda: mock.command(*KILL), lost=lost)
        summary = fly(mock, hover={"duration_s": 0.5})
    assert summary.result == told, summary.events
