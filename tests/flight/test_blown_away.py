"""A vehicle that its autopilot cannot hold against the wind is not taken over, but landed."""

import pytest

from tests.flight.fly import QuickVehicle, fly

STORM_M_S = {"px4": 14.0, "ardupilot": 22.0}
"""Wind in which hovering needs more than 50° of tilt."""


@pytest.mark.parametrize("autopilot", STORM_M_S)
def test_a_vehicle_that_is_blown_away_is_not_taken_over(autopilot):
    vehicle = QuickVehicle(autopilot, wind={"speed_m_s": STORM_M_S[autopilot]})
    summary = fly(vehicle)
    told = "not taken over: waited 5 s for the autopilot to hold the vehicle (tilt "
    assert summary.result.startswith(told)
    assert summary.phase == "offboard"
    modes = [text for _, text in summary.events if text.startswith("mode ")]
    assert "mode OFFBOARD" not in modes
    assert any("asking the autopilot to land" in text for _, text in summary.events)
    assert vehicle.state()["armed"] is False
