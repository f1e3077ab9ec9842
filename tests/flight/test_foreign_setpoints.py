"""Another program sends setpoints to the same vehicle, as a forgotten MAVROS would."""

import asyncio

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.recording.what_to_do import what_to_do
from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When

OTHER_PROGRAM = (1, 192)
HELD = {"px4": "LOITER", "ardupilot": "BRAKE"}
HOVER_THRUST = {"px4": 0.49, "ardupilot": 0.36}
HOVER = {"flight": {"takeoff_height_m": 6.0}, "hover": {"duration_s": 12.0}}
AFTER_OURS_S = 0.003
BODY_RATES = 128
"""Type mask: body rates and thrust, no attitude."""


def flown(autopilot, thrust, rates, every):
    """A hover in which another program answers every nth step, just after our setpoint."""
    with mock_vehicle(autopilot=autopilot) as mock:
        steps, lowest = 0, 100.0
        setpoint = dialect.MAVLink_set_attitude_target_message(
            0, 1, 1, BODY_RATES, (1.0, 0.0, 0.0, 0.0), *rates, thrust
        )

        def send():
            nonlocal steps, lowest
            steps += 1
            lowest = min(lowest, -mock.state()["position"][2])
            if steps % every == 0:
                loop = asyncio.get_running_loop()
                loop.call_later(AFTER_OURS_S, mock.transmit, setpoint, OTHER_PROGRAM)

        begin = When("maneuvers", lambda: mock.after_step.append(send), after=1.0)
        summary = fly(mock, None, begin, **HOVER)
        return summary, mock.state(), lowest


@pytest.mark.parametrize("every", [1, 3, 7])
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_the_flight_is_handed_back_when_another_program_sends_too(autopilot, every):
    summary, truth, lowest = flown(autopilot, HOVER_THRUST[autopilot], (0.4, 0.0, 0.0), every)
    assert "another program sends setpoints to the vehicle" in summary.result, summary.events
    assert (truth["mode"], truth["crashed"]) == (HELD[autopilot], False)
    assert lowest > 4.0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_program_that_cuts_the_thrust_is_noticed_before_the_ground(autopilot):
    summary, truth, lowest = flown(autopilot, 0.0, (0.1, 0.0, 0.0), 1)
    assert "another program sends setpoints to the vehicle" in summary.result, summary.events
    assert not truth["crashed"]
    assert lowest > 0.5


def test_one_setpoint_in_seconds_is_told_once_and_flown_on():
    """Each turns the vehicle until our next setpoint only, but its pilot should know."""
    other = dialect.MAVLink_set_attitude_target_message(
        0, 1, 1, BODY_RATES, (1.0, 0.0, 0.0, 0.0), 0.4, 0.0, 0.0, 0.5
    )
    with mock_vehicle(autopilot="ardupilot") as mock:

        def send():
            loop = asyncio.get_running_loop()
            loop.call_later(AFTER_OURS_S, mock.transmit, other, OTHER_PROGRAM)
            mock.at(mock.time + 5.5, send)

        hover = {"duration_s": 7.5}  # two of them
        summary = fly(mock, None, When("maneuvers", send, after=1.0), hover=hover)
    assert summary.result == "ok", summary.events
    (told,) = [text for _, text in summary.events if "rare setpoint" in text]
    assert "may send setpoints to the vehicle now and then" in told


def test_a_parameter_changed_in_flight_may_look_like_another_program_and_the_advice_says_so():
    """Without the thrust bit of GUID_OPTIONS, ArduPilot reports a thrust of its own."""
    changed = dialect.MAVLink_param_set_message(1, 1, b"GUID_OPTIONS", 0.0, 9)
    with mock_vehicle(autopilot="ardupilot") as mock:
        change = When("maneuvers", lambda: mock.transmit(changed), after=1.0)
        summary = fly(mock, None, change, **HOVER)
        assert not mock.state()["crashed"]
    assert "that this program did not send" in summary.result, summary.events
    advice = what_to_do("foreign setpoints", summary.phase)
    assert "a station may have changed a parameter in flight" in advice


@pytest.mark.parametrize(
    ("autopilot", "name"), [("px4", b"COM_OF_LOSS_T"), ("ardupilot", b"GUID_TIMEOUT")]
)
def test_a_failsafe_that_a_station_makes_unsafe_in_flight_is_told(autopilot, name):
    """Read only before take-off, the rates held for 10 s were flown with without a word."""
    changed = dialect.MAVLink_param_set_message(1, 1, name, 10.0, 9)
    harmless = dialect.MAVLink_param_set_message(1, 1, name, 0.9, 9)
    with mock_vehicle(autopilot=autopilot) as mock:

        def change():
            for after, message in ((0.0, harmless), (1.0, changed), (2.0, harmless)):
                mock.at(mock.time + after, lambda message=message: mock.transmit(message))

        begin = When("maneuvers", change, after=0.5)
        summary = fly(mock, None, begin, hover={"duration_s": 4.0})
    assert summary.result == "ok", summary.events
    (told,) = [text for _, text in summary.events if "set a parameter" in text]
    assert "to an unsafe value in flight" in told
    assert f"{name.decode()} is 10: when setpoints stop, the last rates are held for 10 s" in told


def test_a_px4_that_stands_on_a_slope_shows_targets_of_its_own_and_flies():
    with mock_vehicle(sensors={"ekf": {"tilt_bias_deg": [0.0, 1.0]}}) as mock:
        summary = fly(mock)
    assert summary.result == "ok", summary.events
