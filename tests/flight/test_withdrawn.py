"""A flight that ends on the ground takes back what it commanded, and nothing else."""

import pytest

from companion.flight.preflight_checks import PreflightChecks
from sitl_mock.link.framing import decode
from tests.flight.fly import fly, mock_vehicle, run, session_for
from tests.flight.others import When

ARM, TAKE_OFF, SET_MODE = 400, 22, 176
OURS = 191
HANDING_OVER = {"px4": (1, 4, 3), "ardupilot": (1, 4)}


def commands_from(mock):
    """Those of these commands that the program sends, with the first parameter, as they come."""
    found = []

    def note(datagram):
        for message in decode(datagram):
            ours = message.get_type() == "COMMAND_LONG" and message.get_srcComponent() == OURS
            if ours and message.command in (ARM, TAKE_OFF):
                found.append((message.command, message.param1))
        return [datagram]

    mock.from_companion = note
    return found


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_interrupted_before_it_lifts_off_a_vehicle_that_the_pilot_armed_stays_down(autopilot):
    """Left alone, it took off after the program had ended."""

    def arm():
        mock.command(SET_MODE, *HANDING_OVER[autopilot])
        mock.command(ARM, 1)

    with mock_vehicle(autopilot=autopilot) as mock:
        sent = commands_from(mock)
        session = session_for(mock, None, When("arm", arm, after=1.0), flight={"arm": False})
        mock.when(lambda: sent, lambda: session.interrupt("interrupted by the user"))
        summary = run(mock, session.fly())
        mock.run(8.0)
        state = mock.state()
    assert (summary.result, summary.phase) == ("interrupted by the user", "takeoff")
    assert [command for command, _ in sent] == [TAKE_OFF, ARM]
    assert (state["armed"], state["on_ground"]) == (False, True), summary.events


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_who_arms_just_before_we_would_is_not_disarmed(monkeypatch, autopilot):
    require, stages = PreflightChecks.require, []

    with mock_vehicle(autopilot=autopilot) as mock:

        async def then_somebody_arms(self, stage):
            evidence = await require(self, stage)
            stages.append(stage)
            if len(stages) == 2:  # the checks before arming
                mock.command(ARM, 1)
            return evidence

        monkeypatch.setattr(PreflightChecks, "require", then_somebody_arms)
        sent = commands_from(mock)
        summary = fly(mock)
        state = mock.state()
    assert summary.result == "the vehicle is already armed; land and disarm it first"
    assert (sent, state["armed"]) == ([], True), summary.events
