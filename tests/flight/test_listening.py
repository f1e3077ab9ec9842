"""A vehicle that was silent is heard again while it still obeys us: it holds, or it lands."""

from math import isnan, nan

import pytest
from pymavlink.dialects.v20 import common as dialect

from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When

SET_MODE, DO_REPOSITION, FAILED = 176, 192, 4
HOME = (47.3977433, 8.5455942, 489.4)
RATE_HOLD = {"px4": "COM_OF_LOSS_T", "ardupilot": "GUID_TIMEOUT"}
HOLD_MODE = {"px4": 4.0, "ardupilot": 17.0}
"""Second parameter of the command that asks for the hold."""


class Refusal:
    """Refuses to hold, instead of the mock vehicle."""

    def __init__(self, mock, then=lambda: None):
        self._mode, self._then = HOLD_MODE[mock.autopilot], then
        self._parser, self._packer = dialect.MAVLink(None), dialect.MAVLink(None, 1, 1)
        self._acks = []
        mock.from_companion, mock.to_companion = self._to_vehicle, self._to_companion

    def _to_vehicle(self, data):
        for message in self._parser.parse_buffer(data) or ():
            is_mode = message.get_type() == "COMMAND_LONG" and message.command == SET_MODE
            if is_mode and message.param2 == self._mode:
                self._acks.append(dialect.MAVLink_command_ack_message(SET_MODE, FAILED))
                self._then()
                return []
        return [data]

    def _to_companion(self, data):
        acks, self._acks = self._acks, []
        return [data, *(bytes(ack.pack(self._packer)) for ack in acks)]


def flown(mock, then=lambda: None):
    """A hover; the link is silent for a second, and a hold is refused from then on."""

    def begin():
        mock.inject({"kind": "drop", "direction": "to_companion", "duration_s": 1.0})
        Refusal(mock, then)

    accepted = {"accept": [RATE_HOLD[mock.autopilot]]}
    observer = When("maneuvers", begin, after=1.0)
    return fly(mock, None, observer, flight=accepted, hover={"duration_s": 9.0})


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_vehicle_that_refuses_to_hold_once_heard_again_is_landed(autopilot):
    """ArduPilot would drift at its height without end."""
    with mock_vehicle(autopilot=autopilot, parameters={RATE_HOLD[autopilot]: 5.0}) as mock:
        summary = flown(mock)
        truth = mock.state()
    assert summary.result.startswith("no attitude from the vehicle"), summary.events
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False)
    texts = [text for _, text in summary.events]
    assert "handing back: asking the autopilot to land" in texts


def test_a_pilot_who_holds_it_meanwhile_is_not_overruled_by_the_landing():
    with mock_vehicle(parameters={"COM_OF_LOSS_T": 5.0}) as mock:

        def hold():
            mock.from_companion = None  # the ground station's command is not refused
            mock.command(SET_MODE, 1, 4, 3)

        summary = flown(mock, then=hold)
        mock.run(1.0)
        truth = mock.state()
    assert (truth["mode"], truth["armed"]) == ("LOITER", True), summary.events
    assert summary.events[-1][1] == "the pilot or another station took over: mode AUTO.LOITER"


def test_a_vehicle_heard_late_has_its_own_time_to_hold():
    """It is listened for until 10.5 s after the loss, and hears us only 1.6 s after we hear it."""
    with mock_vehicle(autopilot="ardupilot") as mock:

        def lose():
            for direction, seconds in (("to_companion", 10.4), ("from_companion", 12.0)):
                mock.inject({"kind": "drop", "direction": direction, "duration_s": seconds})

        observer = When("maneuvers", lose, after=1.0)
        summary = fly(mock, None, observer, hover={"duration_s": 9.0})
        assert mock.state()["mode"] == "BRAKE", summary.events
    assert "asking it to hold" in summary.events[-2][1]


def test_a_vehicle_that_hears_no_hold_is_asked_to_land():
    """The way back heals later: until then it may be asked for `flight.landing_timeout_s`."""

    def lose():
        for direction, seconds in (("to_companion", 1.0), ("from_companion", 15.0)):
            mock.inject({"kind": "drop", "direction": direction, "duration_s": seconds})

    with mock_vehicle(autopilot="ardupilot") as mock:
        observer = When("maneuvers", lose, after=1.0)
        summary = fly(mock, None, observer, hover={"duration_s": 9.0})
        truth = mock.state()
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False), (
        summary.events
    )


def test_a_vehicle_lost_as_it_was_to_land_is_asked_to_land_again():
    """A battery that is empty does not allow a hold."""

    def lose():
        mock.inject({"kind": "low_battery", "remaining": 0.15})
        for direction, after in (("from_companion", 0.0), ("to_companion", 1.0)):
            begin = {"at_s": mock.time + after, "duration_s": 6.0}
            mock.inject({"kind": "drop", "direction": direction, **begin})

    with mock_vehicle(autopilot="ardupilot") as mock:
        observer = When("maneuvers", lose, after=1.0)
        summary = fly(mock, None, observer, hover={"duration_s": 9.0})
        truth = mock.state()
    assert "battery at 15 %" in summary.result
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_vehicle_lost_in_its_take_off_is_landed_once_heard_again(autopilot):
    """It flies by itself then, and would hover at its height with nobody to land it."""
    with mock_vehicle(autopilot=autopilot) as mock:
        lose = {"kind": "drop", "direction": "both", "duration_s": 5.0}
        summary = fly(mock, None, When("takeoff", lambda: mock.inject(lose), after=1.0))
        truth = mock.state()
    assert "no heartbeat" in summary.result, summary.events
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_pilot_who_stopped_the_climb_unheard_keeps_the_vehicle(autopilot):
    def stop():
        mock.inject({"kind": "drop", "direction": "to_companion", "duration_s": 5.0})
        mock.command(SET_MODE, 1, HOLD_MODE[autopilot], {"px4": 3.0}.get(autopilot, 0.0))

    with mock_vehicle(autopilot=autopilot) as mock:
        after = {"px4": 1.0, "ardupilot": 4.0}[autopilot]
        high = {"takeoff_height_m": 20.0}
        summary = fly(mock, None, When("takeoff", stop, after=after), flight=high)
        assert mock.state()["armed"], summary.events
    assert summary.events[-1][1].endswith("nothing is commanded")


@pytest.mark.parametrize(("north", "up"), [(9.0, nan), (nan, 9.0)])
def test_a_pilot_who_flew_it_elsewhere_unheard_keeps_it(north, up):
    """There it holds in the mode in which it would hold after its take-off, too."""

    def fly_there():
        mock.inject({"kind": "drop", "direction": "to_companion", "duration_s": 9.0})
        east = nan if isnan(north) else HOME[1]
        mock.command(DO_REPOSITION, -1, 1, 0, nan, HOME[0] + north / 111_195.0, east, HOME[2] + up)

    with mock_vehicle() as mock:
        observer = When("takeoff", fly_there, after=2.0)
        summary = fly(mock, None, observer, flight={"takeoff_height_m": 3.0})
        truth = mock.state()
    assert (truth["mode"], truth["armed"]) == ("LOITER", True), summary.events
    assert summary.events[-1][1].endswith("nothing is commanded")


def test_a_vehicle_heard_again_after_its_take_off_without_a_position_is_told_to_be_left():
    """It may have been flown elsewhere; only "waited 10 s … a fresh position" was told."""

    def lose():
        mock.inject({"kind": "drop", "direction": "both", "duration_s": 4.0})
        mock.inject({"kind": "stop_telemetry", "messages": ["LOCAL_POSITION_NED"]})

    with mock_vehicle() as mock:
        summary = fly(mock, None, When("takeoff", lose, after=1.0))
        assert mock.state()["armed"]
    assert summary.events[-1][1] == (
        "the vehicle is heard again, armed in AUTO.LOITER, after 10 s without a fresh position: "
        "nothing is commanded"
    )


@pytest.mark.parametrize(("phase", "arm"), [("arm", False), ("maneuvers", True)])
def test_a_vehicle_that_comes_back_under_another_system_id_is_named(phase, arm):
    """The wait was said to be for its pilot, who had armed it, or for any frame."""
    beat = dialect.MAVLink_heartbeat_message(2, 12, 29, 0x03040000, 3, 3)
    packer = dialect.MAVLink(None, 2, 1)
    with mock_vehicle() as mock:

        def come_back():
            mock.to_companion = lambda _: [bytes(beat.pack(packer))]

        change = When(phase, come_back, after=1.0)
        flight = {"arm": arm, "arming_timeout_s": 8.0}
        summary = fly(mock, None, change, flight=flight, hover={"duration_s": 9.0})
    texts = [text for _, text in summary.events]
    assert any(
        text.endswith("; system 2 is heard, but link.target_system is 1") for text in texts
    ), texts
    assert not any("the pilot to arm" in text for text in texts)
