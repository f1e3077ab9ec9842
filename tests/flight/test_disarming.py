"""Disarming is asked for on the ground only, however late or lost the answers are."""

import pytest

from sitl_mock.link.framing import decode
from tests.flight.fly import QuickVehicle, fly, mock_vehicle, run, session_for
from tests.flight.others import When

ARM = 400
EVEN_IN_THE_AIR = 21196.0
LOST_S = 6.0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_vehicle_that_took_off_meanwhile_is_landed_and_not_asked_to_disarm_again(autopilot):
    """Ctrl-C comes just after the take-off was accepted, and the uplink loses what we ask for."""
    mock = QuickVehicle(autopilot, lockstep=False)
    asked, lost_until = [], []

    def uplink(datagram):
        if any(disarms(message) for message in decode(datagram)):
            asked.append(-mock.state()["position"][2])
            if mock.time < lost_until[0]:
                return ()
        return (datagram,)

    def interrupt():
        mock.from_companion = uplink
        lost_until.append(mock.time + LOST_S)
        session.interrupt("Ctrl-C")

    session = session_for(mock, flight={"takeoff_height_m": 10.0})
    mock.when(lambda: mock.state()["mode"] == "TAKEOFF" or climbing(mock), interrupt)
    summary = run(mock, session.fly())
    state = mock.state()
    assert asked, summary.events
    assert max(asked) < 0.5, f"asked to disarm at these heights: {asked}; {summary.events}"
    assert (state["armed"], state["on_ground"], state["crashed"]) == (False, True, False)


def disarms(message):
    is_command = message.get_type() == "COMMAND_LONG"
    return is_command and (message.command, message.param1) == (ARM, 0.0)


def climbing(mock):
    """Whether an ArduPilot vehicle, which stays in GUIDED, has accepted the take-off."""
    return mock.autopilot == "ardupilot" and mock.state()["velocity"][2] < -0.01


def test_a_landing_in_which_the_vehicle_crashed_is_not_called_good():
    """PX4 with motors this slow swings up in its own landing, and its failure detector disarms."""
    mock = QuickVehicle("px4", lockstep=False, airframe={"rotor_lag_ms": 300.0})
    summary = run(mock, session_for(mock, hover={"duration_s": 10.0}).fly())
    assert mock.state()["crashed"]
    assert summary.result.startswith("the vehicle lies tilted by "), summary.events
    assert summary.result.endswith("after the landing: it tipped over or crashed")
    assert summary.as_dict()["at_the_end"]["tilt_deg"] > 45.0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    ("phase", "result"),
    [
        ("maneuvers", "the vehicle disarmed in flight"),
        (
            "land",
            "the pilot, the autopilot or another station disarmed the vehicle in the air during "
            "the landing, and it fell",
        ),
    ],
)
def test_motors_that_somebody_stops_in_the_air_end_no_good_flight(autopilot, phase, result):
    """In the landing the fall was called a touchdown, and on ArduPilot a takeover in GUIDED."""
    with mock_vehicle(autopilot=autopilot) as mock:
        kill = When(phase, lambda: mock.command(ARM, 0.0, EVEN_IN_THE_AIR), 1.0)
        summary = fly(mock, None, kill, flight={"takeoff_height_m": 6.0})
        height = -mock.state()["position"][2]
    assert summary.result == result, summary.events
    assert height > 1.0


def test_a_vehicle_that_another_program_armed_first_is_not_said_to_be_disarmed_by_us():
    """Two programs that were started within a second; the other one flies on."""
    with mock_vehicle() as mock:
        rival = When("arm", lambda: mock.command(ARM, 1.0))
        summary = fly(mock, None, rival)
        assert mock.state()["armed"]
    assert summary.result == "the vehicle is already armed; land and disarm it first"
    texts = [text for _, text in summary.events]
    assert "disarming" not in texts
    assert texts[-1] == "leaving the vehicle as it is"
