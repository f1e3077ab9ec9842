"""Who may do what: the user interrupts, the pilot arms and takes over, the fence holds."""

import socket

import pytest
from pymavlink.dialects.v20 import common

from companion.flight.observer import Silent
from companion.mavlink import lockstep
from tests.flight.fly import fly, mock_vehicle, session_for


class When(Silent):
    """Calls `action` once, when `phase` has been waiting for `after` seconds."""

    def __init__(self, phase, action, after=0.0):
        self.wanted, self.action, self.after, self.phases = phase, action, after, []

    def phase(self, name, waits_for):
        self.phases.append(name)
        if self.after == 0.0:
            self._act(name)

    def waiting(self, name, detail, elapsed, timeout):
        if elapsed >= self.after:
            self._act(name)

    def _act(self, name):
        if name == self.wanted and self.action is not None:
            action, self.action = self.action, None
            action()


async def accept():
    return True


def interrupted(mock, folder, phase, ask_landing=None, after=0.0):
    observer = When(phase, lambda: session.interrupt("interrupted by the user"), after)
    session = session_for(mock, folder, observer, ask_landing)
    return lockstep.run(session.fly()), observer


def test_interrupted_in_flight_and_told_to_land_it_lands(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        summary, observer = interrupted(mock, tmp_path / "log", "programme", accept, after=2.0)
        state = mock.state()
    assert summary.result == "interrupted by the user"
    assert observer.phases[-4:] == ["programme", "hand back", "land", "disarm"]
    assert (state["armed"], state["on_ground"], state["crashed"]) == (False, True, False)


def test_interrupted_and_not_told_to_land_it_holds(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        summary, observer = interrupted(mock, tmp_path / "log", "programme", after=2.0)
        state = mock.state()
    assert observer.phases[-1] == "hand back"
    assert (state["armed"], state["mode"]) == (True, "LOITER")
    assert summary.phase == "programme"


@pytest.mark.parametrize("phase", ["connect", "checks", "stream"])
def test_interrupted_on_the_ground_it_never_arms(tmp_path, phase):
    with mock_vehicle(tmp_path) as mock:
        summary, observer = interrupted(mock, tmp_path / "log", phase)
        assert not mock.state()["armed"]
    assert summary.result == "interrupted by the user"
    assert observer.phases[-1] == phase


def test_interrupted_at_arming_it_disarms(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        _, observer = interrupted(mock, tmp_path / "log", "arm")
        assert not mock.state()["armed"]
    assert observer.phases[-1] == "disarm"


def pilot_arms(mock):
    """The pilot arms by another station: a second sender, which the vehicle obeys."""
    sender = common.MAVLink(None, srcSystem=255, srcComponent=190)
    frame = common.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0).pack(sender)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.sendto(frame, ("127.0.0.1", mock.port + 40))


def test_without_being_told_to_it_waits_for_the_pilot_to_arm(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        observer = When("arm", lambda: pilot_arms(mock), after=3.0)
        summary = fly(mock, tmp_path / "log", observer, flight={"arm": False})
    assert summary.result == "ok", summary.events
    assert next(at for at, text in summary.events if text == "armed") > 5.0


def test_if_the_pilot_does_not_arm_nothing_happens(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        summary = fly(mock, tmp_path / "log", flight={"arm": False, "arming_timeout_s": 2.0})
        assert not mock.state()["armed"]
    assert summary.phase == "arm"
    assert "the pilot to arm" in summary.result


def test_a_vehicle_that_is_armed_already_is_not_touched(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        interrupted(mock, tmp_path / "first", "programme")
        before = mock.state()
        summary = fly(mock, tmp_path / "second")
        after = mock.state()
    assert summary.result == "the vehicle is already armed; land and disarm it first"
    assert (before["armed"], after["armed"], after["mode"]) == (True, True, "LOITER")
    assert after["setpoints"] == before["setpoints"]


def test_the_pilot_takes_over_during_the_takeoff(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        takeover = {"fault": {"kind": "pilot_takeover", "mode": "POSCTL"}}
        observer = When("takeoff", lambda: mock.ask(takeover), after=1.0)
        summary = fly(mock, tmp_path / "log", observer)
        state = mock.state()
    assert summary.result == "the pilot or another station took over: mode POSCTL"
    assert summary.phase == "takeoff"
    assert observer.phases[-1] == "takeoff"  # nothing is commanded any more
    assert state["mode"] == "POSCTL"


def test_leaving_the_fence_hands_back_and_lands(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        summary = fly(
            mock,
            tmp_path / "log",
            flight={"programme": ["steps"]},
            limits={"fence_radius_m": 0.8},
        )
        state = mock.state()
    assert "beyond limits.fence_radius_m" in summary.result
    assert summary.events[-1][1] == "disarmed"
    assert (state["on_ground"], state["crashed"]) == (True, False)
