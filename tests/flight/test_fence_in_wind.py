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


def farthest_downwind(autopilot, wind, max_tilt, **safety):
    """A program flies downwind until the fence ends it; the largest distance in each mode, m."""
    vehicle = QuickVehicle(autopilot, wind={"speed_m_s": wind, "from_deg": 180.0})
    limits = {"fence_radius_m": RADIUS, "max_tilt_deg": max_tilt}
    changes = {"limits": limits, "flight": {"takeoff_height_m": 5.0}, "safety": safety}
    config = quick_flight(autopilot, changes)
    distance = {"LAND": [0.0]}

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
    return {mode: max(distances) for mode, distances in distance.items()}


@pytest.mark.parametrize(("autopilot", "control"), [("px4", "OFFBOARD"), ("ardupilot", "GUIDED")])
def test_the_landing_does_not_drift_out_of_the_fence(autopilot, control):
    """PX4 begins its landing level: it drifted out by 1.1 m where the hold did not move upwind."""
    farthest = farthest_downwind(autopilot, 3.0, 35.0)
    assert RADIUS - 1.5 < farthest["LAND"] < RADIUS
    assert RADIUS - 1.5 < farthest[control] < RADIUS


@pytest.mark.parametrize(("wind", "max_tilt"), [(6.0, 35.0), (3.0, 20.0)])
def test_a_wind_that_needs_most_of_the_tilt_does_not_blow_it_out_of_the_fence(wind, max_tilt):
    """The vehicle left it by 0.9 m, braking as if all of the tilt were free."""
    assert max(farthest_downwind("px4", wind, max_tilt).values()) < RADIUS


def test_a_hold_that_has_time_ends_only_where_the_vehicle_has_come_upwind():
    """Only 0.4 m/s² were left against the wind: 1 m behind the hold, it was landed and left."""
    assert max(farthest_downwind("px4", 6.5, 35.0, hold_s=10.0).values()) < RADIUS - 0.5


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
