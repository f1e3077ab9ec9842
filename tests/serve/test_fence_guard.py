"""A client's motion stops in front of the fence, and the client stays in control."""

import math

import pytest

from companion.config import Config
from companion.config.files import changed
from companion.guidance.fence import FenceCentre
from companion.guidance.reference import Reference, VehicleMotion
from companion.serve.fence_guard import FenceGuard
from companion.serve.setpoints.request import AxisDemand, MotionRequest
from tests.serve.virtual import (
    POSITION,
    VELOCITY,
    MemoryClient,
    airborne,
    begin_control,
    mock,
    place,
    served,
    stream,
)

RADIUS = 16.0
STOP = AxisDemand(None, (0.0, 0.0), None), AxisDemand(None, (0.0,), None)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_client_that_flies_to_the_fence_is_stopped_and_stays_in_control(autopilot):
    vehicle, farthest, seen = mock(autopilot), [0.0], {}

    async def scene(session):
        await airborne(session, vehicle, autopilot)
        script = MemoryClient().connect(session)
        home = place(session)
        await begin_control(session, script, autopilot, lambda _=0.0: script.local(POSITION, home))

        def look():
            place = vehicle.state()["position"]
            farthest[0] = max(farthest[0], math.dist(place[:2], home[:2]))

        vehicle.after_step.append(look)
        inside = (home[0] + RADIUS - 1.0, *home[1:])
        await stream(8.0, lambda _: script.local(POSITION, inside), 0.05)
        seen["inside"] = math.dist(vehicle.state()["position"][:2], inside[:2])
        await stream(5.0, lambda _: script.local(POSITION, home), 0.05)
        await stream(6.0, lambda _: script.local(VELOCITY, velocity=(8.0, 3.0, 1.0)), 0.05)
        seen["height"] = -vehicle.state()["position"][2]
        await stream(4.0, lambda _: script.local(VELOCITY, velocity=(-3.0, 0.0, -1.0)), 0.05)
        seen["back"] = math.dist(vehicle.state()["position"][:2], home[:2])
        seen["in control"] = session.flights.in_control
        seen["texts"] = " ".join(script.texts())

    served(vehicle, autopilot, scene, limits={"fence_radius_m": RADIUS})
    assert seen["in control"], seen["texts"]
    assert "safety:" not in seen["texts"]
    assert "stopped in front of the fence" in seen["texts"]
    assert seen["inside"] < 0.3, "a place inside the fence is reached"
    assert seen["height"] == pytest.approx(1.5, abs=0.2), "the floor is 1 m"
    assert farthest[0] < RADIUS - 0.4
    assert seen["back"] < 10.0


def guard(told=None, height=5.0, wind=(0.0, 0.0), **safety):
    config = changed(Config(), {"safety": safety}, "the test")
    centre = FenceCentre((0.0, 0.0, -5.0), None)
    tell = (lambda _: None) if told is None else told.append
    return FenceGuard(config, lambda: centre, lambda: height, lambda: wind, tell)


def asked(guard, velocity, position=(0.0, 0.0, -5.0), flown=(0.0, 0.0, 0.0), now=0.0):
    """What becomes of a commanded velocity, when the vehicle flies `flown`."""
    request = MotionRequest(
        AxisDemand(None, velocity[:2], None), AxisDemand(None, velocity[2:], None), None, None
    )
    motion = VehicleMotion(position, flown)
    return request, guard.keep_inside(request, Reference(*motion), motion, now)


def test_low_after_a_take_off_the_vehicle_may_climb_and_fly_but_not_sink():
    low = guard(height=1.2)
    request, allowed = asked(low, (2.0, 0.0, -1.0), flown=(2.0, 0.0, -1.0))
    assert allowed == request
    request, allowed = asked(low, (2.0, 0.0, 0.5))
    assert allowed == request._replace(vertical=STOP[1])


def test_a_polygon_stops_the_horizontal_motion_alone():
    square = guard(fence_polygon_m=[[20, 20], [20, -20], [-20, -20], [-20, 20]])
    fast = {"position": (15.0, 0.0, -5.0), "flown": (4.0, 0.0, 0.0)}
    request, allowed = asked(square, (4.0, 0.0, -1.0), **fast)
    assert allowed == request._replace(horizontal=STOP[0])
    request, allowed = asked(square, (-4.0, 0.0, -1.0), **fast)
    assert allowed.vertical == request.vertical


def test_a_stop_that_leads_outward_is_completed_and_told_once():
    told = []
    wall = guard(told)
    asked(wall, (6.0, 0.0, 0.0), (42.0, 0.0, -5.0), (6.0, 0.0, 0.0))
    _, allowed = asked(wall, (6.0, 0.0, 0.0), (42.5, 0.0, -5.0), (1.0, 0.0, 0.0), now=1.0)
    assert allowed.horizontal == STOP[0]
    request, allowed = asked(wall, (6.0, 0.0, 0.0), (43.0, 0.0, -5.0), (0.1, 0.0, 0.0), now=1.5)
    assert allowed == request, "from rest it may go on"
    assert len(told) == 1
