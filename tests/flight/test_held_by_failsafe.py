"""PX4's failsafe holds a vehicle that holds already: between its climb and the takeover."""

from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When
from tests.flight.test_takeoff_ends import lose_sticks


def test_a_failsafe_that_holds_before_the_takeover_is_left_alone():
    """The checks refused the takeover, and our landing overruled its return."""
    lost = []
    with mock_vehicle(parameters={"COM_FAIL_ACT_T": 1.0}) as mock:
        lose_sticks(mock, lambda: lost)
        summary = fly(mock, None, When("offboard", lambda: lost.append(True)))
        mock.run(1.5)
        assert mock.state()["mode"] == "RTL", summary.events
    assert summary.result == "the autopilot's failsafe took over: mode AUTO.LOITER"
