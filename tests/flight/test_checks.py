"""A flight heeds what the doctor finds: it refuses what is unsafe, unless that is accepted."""

import pytest

from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When


def test_what_is_unsafe_is_refused_before_arming_or_accepted_by_name():
    told = {}
    with mock_vehicle(parameters={"COM_OF_LOSS_T": 5.0}) as mock:
        refused = fly(mock)
        assert not mock.state()["armed"]
        accepted = fly(mock, None, flight={"accept": ["COM_OF_LOSS_T"]}, hover={"duration_s": 0.5})
    for name, summary in (("refused", refused), ("accepted", accepted)):
        told[name] = [text for _, text in summary.events]
    assert (refused.phase, accepted.phase, accepted.result) == ("checks", "disarm", "ok")
    assert refused.result.startswith("COM_OF_LOSS_T is 5: when setpoints stop")
    assert refused.result.endswith("set COM_OF_LOSS_T to 0.75")
    assert "unsafe, but accepted by flight.accept: " + refused.result in told["accepted"]
    assert (
        "preflight warnings: COM_LOW_BAT_ACT, planner.name; `companion doctor` says what to set, "
        "docs/troubleshooting.md explains each" in told["accepted"]
    )
    # The checks before arming make some of these findings again.
    assert sum(text.startswith("preflight warnings: ") for text in told["accepted"]) == 1


def flown_with_a_gap(autopilot, fault, after):
    """A flight whose telemetry is disturbed while the checks before the takeover count it."""
    with mock_vehicle(autopilot=autopilot) as mock:
        disturb = When("offboard", lambda: mock.inject({**fault, "at_s": mock.time + after}))
        summary = fly(mock, None, disturb, hover={"duration_s": 0.5})
        assert not mock.state()["armed"]
    return summary.result, [text for _, text in summary.events]


@pytest.mark.parametrize(("autopilot", "after"), [("px4", 0.1), ("ardupilot", 0.4)])
def test_a_gap_of_a_third_of_a_second_before_the_takeover_delays_the_takeover(autopilot, after):
    """The autopilot holds the vehicle; nothing has to be landed."""
    result, texts = flown_with_a_gap(autopilot, {"kind": "drop", "duration_s": 0.3}, after)
    assert result == "ok", texts
    (told,) = [text for text in texts if text.endswith("; the checks are repeated")]
    assert told.startswith("ATTITUDE_QUATERNION arrives in bursts")


def test_a_link_that_stays_disturbed_before_the_takeover_ends_the_flight():
    fault = {"kind": "stop_telemetry", "messages": ["ATTITUDE_QUATERNION"]}
    result, texts = flown_with_a_gap("ardupilot", fault, 0.1)
    assert result.startswith("ATTITUDE_QUATERNION arrives at 0 Hz"), texts
    assert "handing back: asking the autopilot to land" in texts
