"""The fence and the safety monitors stand above every client."""

import asyncio
import math
import re
from itertools import count
from types import SimpleNamespace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.config import Config
from companion.config.files import changed
from companion.guidance.fence import FenceCentre
from companion.serve.fence_across_flights import FenceAcrossFlights
from companion.vehicle.records import LocalPosition
from tests.serve.test_control import REJECTED
from tests.serve.virtual import (
    POSITION,
    MemoryClient,
    airborne,
    begin_control,
    mock,
    served,
    stream,
)

RADIUS = 9.0
HOLD = {"px4": (176, 1, 4, 3), "ardupilot": (176, 1, 17)}
GUIDED = 176, 1, 4
HOVER = {"px4": 0.49, "ardupilot": 0.364}
NORTHWARD = math.cos(math.radians(7.5)), 0.0, -math.sin(math.radians(7.5)), 0.0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_client_that_asks_again_does_not_take_the_fence_along(autopilot):
    """It lets go 6 m from where control began, asks again, and commands a place 5 km away.

    There it is stopped in front of the fence. Then it flies on by attitudes, which are not stopped.
    """
    vehicle = mock(autopilot)

    async def scene(session):
        ground = await airborne(session, vehicle, autopilot)
        script = MemoryClient().connect(session)
        north, east, down = vehicle.state()["position"]

        def to(metres):
            return lambda _: script.local(POSITION, (north + metres, east, down))

        def distance():
            return math.dist(vehicle.state()["position"][:2], (north, east))

        sent = count()

        def hold(_):
            """A station asks for rare telemetry now and then, as MAVProxy does."""
            if next(sent) % 10 == 0:
                ground.send(dialect.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
            to(0.0)(0.0)

        await begin_control(session, script, autopilot, hold)
        assert "control was not given" not in " ".join(script.texts())
        await stream(5.0, to(6.0), 0.1)
        script.command(*HOLD[autopilot])
        await asyncio.sleep(1.5)
        assert not session.flights.in_control
        assert distance() == pytest.approx(6.0, abs=0.4)
        if autopilot == "ardupilot":
            ground.command(*GUIDED)
            await asyncio.sleep(0.5)
        await begin_control(session, script, autopilot, to(6.0))
        script.heard.clear()
        controlled, landing = [0.0], [0.0]

        def note():
            flown = landing if vehicle.state()["mode"] == "LAND" else controlled
            flown.append(distance())

        vehicle.after_step.append(note)
        await stream(5.0, to(5000.0), 0.05)
        assert session.flights.in_control
        await stream(4.0, to(5.0), 0.05)
        async with asyncio.timeout(20.0):
            while session.flights.in_control:
                await stream(0.1, lambda _: script.attitude(7, NORTHWARD, HOVER[autopilot]))
        if autopilot == "px4":
            asked = asyncio.ensure_future(script.offboard())
            await stream(0.5, to(0.0))
            assert await asked == REJECTED
        await stream(2.0, to(5000.0))
        assert vehicle.state()["mode"] == "LAND"
        said = " ".join(script.texts())
        assert re.search("stopped in front of the fence.*safety: braking: braking", said), said
        assert "control is ending and the vehicle is held" in said
        # After a run-up of 4 m; without the acceleration it was up to 1.3 m outside, and
        # without the lateness of ArduPilot's estimate up to 0.2 m.
        assert max(*controlled, *landing) < RADIUS

    served(vehicle, autopilot, scene, limits={"fence_radius_m": RADIUS})


class FakeLink:
    """What `FenceAcrossFlights` sees of a vehicle."""

    def __init__(self):
        self.state = SimpleNamespace(armed=True, height=5.0, position=None)

        self.callbacks, self.now = {}, 0.0

    def subscribe(self, name, callback):
        self.callbacks[name] = callback

    def heartbeat(self):
        self.callbacks["HEARTBEAT"](None)

    def at(self, *position):
        """A position after a second without any, in which the vehicle may have flown anywhere."""
        self.now += 1.0
        self.state.position = LocalPosition(self.now, self.now, position, (0.0, 0.0, 0.0))
        self.callbacks["LOCAL_POSITION_NED"](None)

    def jumps_to(self, *position):
        """The next position of a vehicle that does not move, after an estimator reset."""
        self.now += 0.02
        self.state.position = LocalPosition(self.now, self.now, position, (0.0, 0.0, 0.0))
        self.callbacks["LOCAL_POSITION_NED"](None)


def test_outside_the_fence_of_the_first_flight_control_is_refused_until_the_vehicle_disarms():
    config, link = changed(Config(), {"limits": {"fence_radius_m": RADIUS}}, "test"), FakeLink()
    fence = FenceAcrossFlights(config, link)
    link.at(100.0, 0.0, -5.0)
    assert fence.refusal() is None, "nobody was in control yet"
    fence.set_first_centre(FenceCentre((100.0, 0.0, -5.0), None))
    fence.set_first_centre(FenceCentre((108.0, 0.0, -5.0), None))
    link.at(108.0, 0.0, -5.0)
    assert fence.refusal() is None
    link.at(110.0, 0.0, -5.0)
    assert "10.0 m from where control began, beyond limits.fence_radius_m" in fence.refusal()
    link.heartbeat()
    assert fence.refusal() is not None
    link.state.armed = False
    link.heartbeat()
    assert fence.refusal() is None


def test_a_reset_of_the_estimator_between_flights_leaves_the_fence_over_the_same_ground():
    keys = {"limits": {"fence_radius_m": RADIUS}, "safety": {"max_reset_m": 4.0}}
    link = FakeLink()
    fence = FenceAcrossFlights(changed(Config(), keys, "test"), link)
    link.at(92.0, 0.0, -5.0)
    link.jumps_to(90.0, 0.0, -5.0)  # before the fence is kept: its centre has it already
    link.at(100.0, 0.0, -5.0)
    fence.set_first_centre(FenceCentre((100.0, 0.0, -5.0), None))
    link.at(108.0, 0.0, -5.0)
    assert fence.refusal() is None
    link.jumps_to(111.0, -1.0, -5.0)  # the vehicle is still 8 m north of the centre
    assert fence.centre.position_ned == pytest.approx((103.0, -1.0, -5.0))
    assert fence.refusal() is None
    link.at(113.0, -1.0, -5.0)
    assert "10.0 m from where control began" in fence.refusal()
    link.at(103.0, -1.0, -5.0)
    assert fence.refusal() is None
    link.jumps_to(103.0, 3.0, -5.0)  # 3 m north and 3 m east in all
    assert "moved the position by 4.2 m since the first flight" in fence.refusal()
    link.state.armed = False
    link.heartbeat()
    assert fence.refusal() is None
