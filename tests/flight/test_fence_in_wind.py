"""A flight that the fence ends stays inside it, in wind that pushes outward as well."""

from dataclasses import replace
from math import hypot

import pytest

from companion import testing
from companion.api import FlightEnded
from companion.config import Config
from companion.flight.hold_inside import only_upwind_is_inside
from companion.safety.table import fence_of
from tests.flight.fly import QuickVehicle, quick_flight

RADIUS = 8.0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_the_landing_does_not_drift_out_of_the_fence(autopilot):
    """PX4 begins its landing level: it drifted out by 1.1 m where the hold did not move upwind."""
    vehicle = QuickVehicle(autopilot, wind={"speed_m_s": 3.0, "from_deg": 180.0})
    config = quick_flight(
        autopilot, {"limits": {"fence_radius_m": RADIUS}, "flight": {"takeoff_height_m": 5.0}}
    )
    distance = {"OFFBOARD": [0.0], "GUIDED": [0.0], "LAND": [0.0]}

    async def flown():
        async with testing.connect(config, vehicle) as connected:
            await connected.take_off()
            centre = vehicle.state()["position"]

            def note():
                north, east, _ = vehicle.state()["position"]
                away = hypot(north - centre[0], east - centre[1])
                distance.setdefault(vehicle.state()["mode"], []).append(away)

            vehicle.after_step.append(note)
            async with connected.control() as control:
                async for state in control.states(seconds=30.0):
                    north, east, down = state.velocity_ned
                    control.accelerate((2.0 * (1.0 - north), -2.0 * east, -2.0 * down))

    with pytest.raises(FlightEnded, match="braking now would end"):
        testing.run(vehicle, flown())
    assert vehicle.state()["on_ground"]
    assert RADIUS - 1.5 < max(distance["LAND"]) < RADIUS
    assert RADIUS - 1.5 < max(distance["OFFBOARD"] + distance["GUIDED"]) < RADIUS


@pytest.mark.parametrize(
    ("stop", "wind", "moves"),
    [
        ((7.8, 0.0, -2.0), (3.0, 0.0), True),
        ((7.8, 0.0, -2.0), (-3.0, 0.0), False),  # upwind is out there
        ((4.0, 0.0, -2.0), (3.0, 0.0), False),  # far from the fence
        ((0.0, -7.8, -2.0), (0.0, -3.0), True),
        ((4.0, 0.0, -100.0), (3.0, 0.0), False),  # above the ceiling, which no move mends
        ((7.8, 0.0, -100.0), (3.0, 0.0), True),
    ],
)
def test_a_hold_ends_upwind_only_if_that_keeps_the_landing_inside(stop, wind, moves):
    fence = replace(fence_of(Config()), radius=RADIUS)
    assert only_upwind_is_inside(fence, None, stop, wind) is moves


def test_between_two_walls_that_both_are_near_the_hold_stays_where_it_is():
    narrow = ((-50.0, -0.5), (-50.0, 0.5), (50.0, 0.5), (50.0, -0.5))
    fence = replace(fence_of(Config()), polygon=narrow)
    assert not only_upwind_is_inside(fence, None, (0.0, 0.0, -2.0), (0.0, 3.0))
