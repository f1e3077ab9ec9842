"""A vehicle that somebody else armed and flew is taken over in the air, flown, and handed back."""

import asyncio
from math import dist

import pytest

from companion.config import Config
from companion.config.files import changed
from companion.flight.assembly import assemble
from companion.flight.changes import Changes
from companion.flight.observer import EventRecorder, SilentObserver
from companion.flight.opening import link_settings
from companion.flight.plan import TakeoverPlan
from companion.flight.wiring import connected
from companion.guidance import Reference
from companion.guidance.source import CommandedSource
from companion.testing import environment, open_wire, run
from companion.vehicle.link import Link
from tests.flight.airborne import HEIGHT, in_the_air, ready_to_arm
from tests.flight.fly import OTHER_VEHICLES, QUICK_FLIGHT, merged

BOTH = pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])


def taken_over(mock, source, program=None):
    """Take the vehicle over for `source`; returns the results of all flights."""
    config = changed(Config(), merged(QUICK_FLIGHT, OTHER_VEHICLES.get(mock.autopilot, {})), "test")
    config = changed(config, {"link": {"lockstep": True}}, "test")

    async def main():
        async with Link(link_settings(config), opener=open_wire) as link:
            recorder = EventRecorder(
                SilentObserver(), asyncio.get_running_loop().time, lambda _: None
            )
            assembled = assemble(
                config,
                link,
                recorder,
                None,
                None,
                TakeoverPlan(source),
                environment,
                Changes(config),
            )
            async with connected(assembled):
                flight = asyncio.ensure_future(assembled.flight.run())
                if program is not None:
                    await asyncio.wait_for(program(assembled.context), 60.0)
                return await flight, [text for _, text in assembled.flight.events]

    return run(mock, main())


class Streamed(CommandedSource):
    """Flies 3 m north in 4 s, then lets go."""

    def __init__(self):
        super().__init__("a client", 0.5, 1.0)
        self.flown_to = None

    async def stream(self, context):
        while self.pose is None:  # noqa: ASYNC110
            await asyncio.sleep(0.02)
        north, east, down = self.pose.position_ned
        clock = asyncio.get_running_loop().time
        began = clock()
        while (elapsed := clock() - began) < 5.0:
            way = min(elapsed, 4.0) / 4.0
            place = north + 3.0 * way * way * (3.0 - 2.0 * way), east, down
            self.give(Reference(place, heading=self.pose.heading), clock())
            await asyncio.sleep(0.02)
        self.flown_to = dist(context.guidance_loop.motion_now().position_ned, place)
        self.end()


@BOTH
def test_it_flies_what_the_source_tells_and_hands_back(autopilot):
    mock, source = in_the_air(autopilot), Streamed()
    result, events = taken_over(mock, source, source.stream)
    assert result == "ok", events
    assert source.flown_to < 0.3
    assert mock.state()["mode"] in ("LOITER", "BRAKE")
    assert mock.state()["position"][2] < -HEIGHT + 0.5


@BOTH
def test_a_source_that_falls_silent_is_held_and_handed_back(autopilot):
    mock = in_the_air(autopilot)
    result, events = taken_over(mock, CommandedSource("a client", 0.5, 1.0))
    assert result == "a client gave no new command for 1 s", events
    assert mock.state()["mode"] in ("LOITER", "BRAKE")
    assert not mock.state()["crashed"]


@BOTH
def test_a_vehicle_on_the_ground_is_not_taken_over(autopilot):
    mock = ready_to_arm(autopilot)
    before = mock.state()["mode"]
    result, _ = taken_over(mock, CommandedSource("a client", 0.5, 1.0))
    assert result in ("the vehicle does not fly: take off first",)
    assert (mock.state()["armed"], mock.state()["mode"]) == (False, before)
    assert not mock.setpoints


def test_a_mode_of_the_pilot_is_not_taken_from_him():
    mock = in_the_air("px4")
    mock.take_over("POSCTL")
    mock.run(0.5)
    result, _ = taken_over(mock, CommandedSource("a client", 0.5, 1.0))
    assert result == "the pilot or another station took over: mode POSCTL"
    assert mock.state()["mode"] == "POSCTL"
    assert not mock.setpoints
