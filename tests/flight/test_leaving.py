"""Leaving at once in a turn; the autopilot keeps the last body rates for seconds."""

import asyncio
from math import asin, degrees, hypot

import pytest

from companion.config.files import load
from companion.control.guidance_loop import GuidanceLoop
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
    assert summary.result == "stopped at once by the user"
    assert state["last_setpoint"] == left["last_setpoint"]
    assert turning(left) > 0.8
    assert turning(state) < 0.02
    assert tilt_deg(state) < tilt_deg(left) + 15.0  # what the vehicle's lag takes it through
    samples = Replay(read_flight(tmp_path), load(tmp_path / "config.yaml")).run()
    assert [each for each in samples if not each.is_same] == []


def test_without_a_sample_to_answer_nothing_is_sent_in_leaving():
    with mock_vehicle(parameters={"COM_OBL_RC_ACT": 4}) as mock:

        def fall_silent():
            mock.inject({"kind": "stop_telemetry"})
            asyncio.get_running_loop().call_later(0.05, session.leave)

        session = session_for(mock, None, When("maneuvers", fall_silent, after=1.0))
        began = mock.state()["time"]
        summary = run(mock, session.fly())
        state = mock.state()
    assert summary.result == "stopped at once by the user"
    assert state["time"] - state["last_setpoint"] == pytest.approx(0.15, abs=0.03)
    assert state["last_setpoint"] > began


def broken(*_):
    raise ZeroDivisionError("a fault of ours")


def failing_exit(monkeypatch, fault, autopilot):
    """The setpoints from the moment on at which `fault` breaks guidance in a turn, in an exit."""
    with mock_vehicle(autopilot=autopilot, delay_s=0.025) as mock:

        def fail_in_a_turn():
            if turning(mock.state()) > 1.0:
                monkeypatch.setattr(GuidanceLoop, fault, broken)
                mock.setpoints.clear()
                session.interrupt("Ctrl-C")
            else:
                asyncio.get_running_loop().call_later(0.01, fail_in_a_turn)

        observer = When("maneuvers", fail_in_a_turn)
        session = session_for(mock, None, observer, flight={"maneuvers": ["steps"]})
        summary = run(mock, session.fly())
        assert not mock.state()["crashed"]
    assert "internal error: ZeroDivisionError('a fault of ours')" in [
        text for _, text in summary.events
    ]
    return mock.setpoints


@pytest.mark.parametrize("autopilot", HELD)
@pytest.mark.parametrize("fault", ["step", "hold_here"])
def test_a_fault_of_ours_in_an_exit_ends_the_stream_without_turning(monkeypatch, fault, autopilot):
    """Its command is on the way for 0.1 s, during which the autopilot keeps the last setpoint."""
    setpoints = failing_exit(monkeypatch, fault, autopilot)
    assert [each.rates for each in setpoints].count((0.0, 0.0, 0.0)) == 1
    assert setpoints[-1].rates == (0.0, 0.0, 0.0)
