"""Leaving at once in a turn; the autopilot keeps the last body rates for seconds."""

import asyncio
from math import asin, degrees, hypot

import pytest

from companion.config.files import load
from companion.recording.flight_record import read_flight
from companion.replay.replay import Replay
from tests.flight.fly import mock_vehicle, run, session_for
from tests.flight.others import When

HELD = {"px4": "COM_OF_LOSS_T", "ardupilot": "GUID_TIMEOUT"}


def turning(state):
    """rad/s."""
    return hypot(*state["rates"])


def tilt_deg(state):
    return degrees(2.0 * asin(hypot(*state["q"][1:3])))


@pytest.mark.parametrize("autopilot", HELD)
def test_who_leaves_in_a_turn_leaves_a_vehicle_that_turns_no_further(tmp_path, autopilot):
    with mock_vehicle(autopilot=autopilot, parameters={HELD[autopilot]: 3.0}) as mock:

        def leave_in_a_turn():
            if turning(mock.state()) > 1.0:
                session.leave()
            else:
                asyncio.get_running_loop().call_later(0.01, leave_in_a_turn)

        observer = When("maneuvers", leave_in_a_turn)
        flight = {"maneuvers": ["steps"], "accept": [HELD[autopilot]]}
        session = session_for(mock, tmp_path, observer, flight=flight)
        summary = run(mock, session.fly())
        left = mock.state()
        mock.run(1.0)  # less than the autopilot keeps the last setpoint
        state = mock.state()
    assert summary.result == "left at once by the user"
    assert state["last_setpoint"] == left["last_setpoint"]
    assert turning(left) > 0.8
    assert turning(state) < 0.02
    assert tilt_deg(state) < tilt_deg(left) + 15.0  # what the vehicle's lag takes it through
    samples = Replay(read_flight(tmp_path), load(tmp_path / "config.yaml")).run()
    assert [each for each in samples if not each.same] == []


def test_without_a_sample_to_answer_nothing_is_sent_in_leaving():
    with mock_vehicle(parameters={"COM_OBL_RC_ACT": 4}) as mock:

        def fall_silent():
            mock.inject({"kind": "stop_telemetry"})
            asyncio.get_running_loop().call_later(0.05, session.leave)

        session = session_for(mock, None, When("maneuvers", fall_silent, after=1.0))
        began = mock.state()["time"]
        summary = run(mock, session.fly())
        state = mock.state()
    assert summary.result == "left at once by the user"
    assert state["time"] - state["last_setpoint"] == pytest.approx(0.15, abs=0.03)
    assert state["last_setpoint"] > began
