"""What a client can do wrong, one fault after the other in one flight on each mock vehicle.

The states are those of the table in docs/serve.md. Every setpoint is judged on its way.
"""

import asyncio
import inspect
import math
import random
import re

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion import testing
from companion.batch import can_compile
from companion.files import bounded_yaml
from tests.flight.fly import LOOP_HZ, merged
from tests.serve.setpoint_judge import AT_ONCE, HAND_BACK, HOLD, TIMEOUT, SetpointJudge
from tests.serve.virtual import (
    ALL,
    CONFIGS,
    POSITION,
    VELOCITY,
    MemoryClient,
    airborne,
    begin_control,
    served,
    stream,
)

HANDED_BACK = "held, then handed back"
FLOWN = "flown"
REFUSED = "refused"
NOT_IN_CONTROL = "not in control"
AUTOPILOT_HOLDS = {"px4": "LOITER", "ardupilot": "BRAKE"}
STATION_HOLDS = {"px4": (176, 1, 4, 3), "ardupilot": (176, 1, 5)}
REJECTED = dialect.MAV_RESULT_TEMPORARILY_REJECTED
NAN = math.nan


class Scene:
    """An airborne vehicle, `serve`, a script that is in control, and a ground station."""

    def __init__(self, vehicle, session, autopilot, ground, judge):
        self.vehicle, self.session, self.autopilot = vehicle, session, autopilot
        self.ground, self.judge, self.flights = ground, judge, session.flights
        self.script = MemoryClient().connect(session)
        self.home = self.place

    @property
    def place(self):
        return self.flights._vehicle.link.state.position.position_ned

    @property
    def speed(self):
        return math.hypot(*self.flights._vehicle.link.state.position.velocity_ned)

    @property
    def mode(self):
        return self.vehicle.state()["mode"]

    def local(self, *arguments, client=None, **keys):
        """A setpoint that is to be flown."""
        self.judge.commanded()
        (client or self.script).local(*arguments, **keys)

    def hover(self, _=0.0):
        self.local(ALL, self.home)

    async def recover(self):
        """The script is in control, and the vehicle is at home."""
        if not self.flights.in_control:
            if self.autopilot == "ardupilot":
                self.ground.command(176, 1, 4)
                await asyncio.sleep(AT_ONCE)
            await begin_control(self.session, self.script, self.autopilot, self.hover)
        async with asyncio.timeout(30.0):
            while math.dist(self.place, self.home) > 0.3 or self.speed > 0.2:
                await stream(0.2, lambda _: self.local(POSITION, self.home))
        self.script.heard.clear()

    async def is_handed_back(self):
        """Nobody commands any more: held first, then the autopilot holds."""
        await asyncio.sleep(TIMEOUT + 0.7 * HOLD)
        assert self.flights.in_control
        await asyncio.sleep(0.3 * HOLD + HAND_BACK + 0.5)
        assert self.mode == AUTOPILOT_HOLDS[self.autopilot]
        assert not self.flights.in_control
        assert self.speed < 0.5
        return HANDED_BACK

    async def is_flown(self, seconds=TIMEOUT + 0.2):
        """The script's own setpoints are still flown."""
        await stream(seconds, self.hover)
        assert self.flights.in_control
        assert self.flights.ownership.owner.client is self.script
        assert math.dist(self.place, self.home) < 0.4
        return FLOWN

    async def is_refused(self, send, *words):
        """What `send` sends between good setpoints changes nothing, and is answered by `words`."""

        def both(_):
            self.hover()
            send()

        await stream(0.5, both, 0.05)
        for each in words:
            self.is_said(each)
        await self.is_flown()
        return REFUSED

    def is_said(self, words, client=None):
        said = " ".join((client or self.script).texts())
        assert words in said, said


async def silent(scene):
    """sends no more"""
    await stream(1.5, lambda _: scene.local(VELOCITY, velocity=(1.5, 0.0, 0.0)))
    state = await scene.is_handed_back()
    scene.is_said("it sends no valid setpoint, and the vehicle is held")
    scene.is_said("has ended")
    return state


async def frozen_motion(scene):
    """hangs while MAVSDK repeats a position, velocity and acceleration"""
    start, moving = scene.place, (2.0, 0.0, 0.0)
    await stream(1.5, lambda t: scene.local(ALL, (start[0] + 2.0 * t, *start[1:]), moving))
    last = (start[0] + 3.0, *start[1:])
    await stream(3.0, lambda _: scene.local(ALL, last, moving), 0.05)
    assert math.dist(scene.place, last) < 0.5
    assert scene.speed < 0.3
    return "stopped at the position"


async def frozen_velocity(scene):
    """hangs while MAVSDK repeats a velocity"""
    await stream(2.0, lambda _: scene.local(VELOCITY, velocity=(-1.5, 0.0, 0.0)), 0.05)
    assert scene.speed == pytest.approx(1.5, abs=0.3)
    assert scene.flights.in_control
    return "flown on, up to the fence"


async def killed(scene):
    """is killed, or its connection breaks"""
    await stream(0.5, scene.hover)
    scene.session.network.detach(scene.script)
    state = await scene.is_handed_back()
    scene.script = MemoryClient("next script").connect(scene.session)
    return state


async def reconnects(scene):
    """comes back by another connection while the vehicle is held"""
    await stream(0.5, scene.hover)
    scene.session.network.detach(scene.script)
    await asyncio.sleep(TIMEOUT + 0.3 * HOLD)
    scene.script = MemoryClient("script again").connect(scene.session)
    return await scene.is_flown()


async def reconnects_all_the_time(scene):
    """connects anew for each few setpoints"""
    for number in range(8):
        scene.session.network.detach(scene.script)
        scene.script = MemoryClient(f"script {number}").connect(scene.session)
        await stream(0.2, scene.hover)
        assert scene.flights.in_control
    await asyncio.sleep(0.1)
    return await scene.is_flown()


async def flood(scene):
    """floods us with 2000 setpoints a second"""
    before, began = scene.judge.count, scene.vehicle.time

    def many(_):
        for _ in range(20):
            scene.hover()

    await stream(0.7, many, 0.01)
    assert scene.judge.count - before < 260 * (scene.vehicle.time - began), "one for each sample"
    return await scene.is_flown(0.2)


async def not_finite(scene):
    """sends NaN or infinity in any field, between good setpoints"""
    bad = [(NAN, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0, -math.inf)]

    def send():
        for values in bad:
            scene.script.local(POSITION, values)
            scene.script.local(VELOCITY, velocity=values)
            scene.script.local(ALL, scene.home, (0.0, 0.0, 0.0), values)
        scene.script.local(POSITION & ~1024, scene.home, yaw=NAN)
        scene.script.local(VELOCITY & ~2048, yaw_rate=math.inf)
        scene.script.attitude(7, (NAN, 0.0, 0.0, 0.0), 0.5)
        scene.script.attitude(7, (1.0, 0.0, 0.0, 0.0), NAN)
        scene.script.attitude(128, (1.0, 0.0, 0.0, 0.0), 0.5, (NAN, 0.0, 0.0))

    return await scene.is_refused(send, "not finite")


async def only_not_finite(scene):
    """sends NaN only"""
    scene.hover()
    sending = asyncio.ensure_future(
        stream(4.0, lambda _: scene.script.local(POSITION, (NAN, NAN, NAN)), 0.05)
    )
    state = await scene.is_handed_back()
    await sending
    return state


async def contradictions(scene):
    """sends masks that contradict themselves, between good setpoints"""
    away = (scene.home[0] + 20.0, *scene.home[1:])

    def send():
        scene.script.local(POSITION & ~(64 | 128 | 256), away)  # no velocity
        scene.script.local(POSITION | 1, away)  # x without y
        scene.script.local(0xFFFF, away)  # unknown bits
        scene.script.local(0x0FFF, away)  # nothing
        scene.script.local(POSITION, away, frame=10)  # terrain
        scene.script.attitude(0, (1.0, 0.0, 0.0, 0.0), 0.5)  # attitude and rates
        scene.script.attitude(7 | 128, (1.0, 0.0, 0.0, 0.0), 0.5)  # neither
        scene.script.attitude(7 | 64, (1.0, 0.0, 0.0, 0.0), 0.5)  # no thrust

    return await scene.is_refused(send, "also needs a velocity")


async def no_place(scene):
    """sends a global position at latitude and longitude 0, or at a height that is no number"""

    def send():
        for place in ((0, 0, 5.0), (473977420, 85455940, NAN)):
            scene.script.send(
                dialect.MAVLink_set_position_target_global_int_message(
                    0, 1, 1, 6, POSITION, *place, *[0.0] * 8
                )
            )

    return await scene.is_refused(send, "the position is more than", "position is not finite")


async def clock_jumps(scene):
    """stamps its setpoints with a clock that jumps"""
    rng = random.Random(1)

    def send(_):
        scene.judge.commanded()
        scene.script.send(
            dialect.MAVLink_set_position_target_local_ned_message(
                rng.choice((0, 1, 2**31, 2**32 - 1)), 1, 1, 1, ALL, *scene.home, *[0.0] * 8
            )
        )

    await stream(0.5, send)
    return await scene.is_flown()


async def another_id(scene):
    """changes its component id"""
    await stream(2.5, scene.hover)  # until the same sentence may be told again
    scene.script.packer.srcComponent = 191 - scene.script.packer.srcComponent
    await stream(TIMEOUT - 0.1, lambda _: scene.script.local(ALL, scene.home))
    scene.is_said("is in control")
    return await scene.is_flown(2.0)


async def all_kinds(scene):
    """changes the kind of setpoint every time"""
    level, hover = (1.0, 0.0, 0.0, 0.0), {"px4": 0.49, "ardupilot": 0.364}[scene.autopilot]
    kinds = (
        scene.hover,
        lambda: scene.local(VELOCITY, velocity=(1.0, -1.0, 0.0)),
        lambda: scene.script.attitude(7, level, hover),
        lambda: scene.local(POSITION & ~2048, scene.home, yaw_rate=0.5),
        lambda: scene.script.attitude(128, level, hover, (0.2, -0.2, 0.1)),
        lambda: scene.local(0x0C3F, acceleration=(0.5, 0.0, -0.2)),
        lambda: scene.local(VELOCITY, velocity=(0.5, 0.0, 0.0), frame=8),
    )
    await stream(1.5, lambda time: kinds[round(time / 0.02) % len(kinds)]())
    assert scene.flights.in_control
    assert math.dist(scene.place, scene.home) < 3.0
    await scene.recover()
    return await scene.is_flown()


async def upside_down(scene):
    """commands an attitude beyond 90° of tilt"""
    side = math.sqrt(0.5)

    def send():
        scene.script.attitude(7, (0.0, 1.0, 0.0, 0.0), 0.5)
        scene.script.attitude(7, (side - 0.01, side, 0.0, 0.0), 0.5)

    return await scene.is_refused(send, "90 degrees of tilt")


async def beyond_limits(scene):
    """commands more than the limits allow"""
    half = math.radians(40.0)
    q = (math.cos(half), math.sin(half), 0.0, 0.0)

    def tilt(_):
        scene.judge.commanded()
        scene.script.attitude(7, q, 1.0)

    await stream(0.5, tilt)
    assert 2.0 * math.asin(math.hypot(*scene.vehicle.state()["q"][1:3])) < math.radians(47.0)
    await scene.recover()

    def spin(_):
        scene.judge.commanded()
        scene.script.attitude(128, (1.0, 0.0, 0.0, 0.0), 0.0, (50.0, -50.0, 50.0))

    await stream(0.2, spin)
    return "flown within the limits"


async def two_at_once(scene):
    """sends setpoints while another client is in control"""
    rival = MemoryClient("rival", (246, 190)).connect(scene.session)
    stranger = MemoryClient("stranger", (250, 1), host="192.0.2.7").connect(scene.session)
    away = (scene.home[0] + 20.0, *scene.home[1:])
    forwarded = scene.flights._vehicle.link.stats.forwarded

    def both(_):
        scene.hover()
        rival.local(ALL, away)
        stranger.local(ALL, away)

    await stream(0.5, both)
    scene.is_said("is in control", rival)
    scene.is_said("read-only", stranger)
    await scene.is_flown()
    assert scene.flights._vehicle.link.stats.forwarded == forwarded, "no setpoint is forwarded"
    scene.session.network.detach(rival)
    scene.session.network.detach(stranger)
    return REFUSED


async def two_at_once_asking(scene):
    """asks for control while another client is in control"""
    rival = MemoryClient("rival", (246, 190)).connect(scene.session)

    def both(_):
        scene.hover()
        rival.local(ALL, scene.home)

    await stream(0.2, both)
    if scene.autopilot == "px4":
        asked = asyncio.ensure_future(rival.offboard())
        while not asked.done():
            await stream(0.1, both)
        assert asked.result() == REJECTED
    scene.is_said("is in control", rival)
    await scene.is_flown()
    scene.session.network.detach(rival)
    return REFUSED


async def wrong_ids(scene):
    """addresses another vehicle or component, or sends under the ids of the autopilot or ours"""
    away = (scene.home[0] + 20.0, *scene.home[1:])
    thieves = [
        MemoryClient(f"thief {ids}", ids).connect(scene.session) for ids in ((1, 1), (1, 191))
    ]

    def send():
        for target in ((2, 1), (1, 7), (7, 0)):
            scene.script.local(ALL, away, target=target)
        for thief in thieves:
            thief.local(ALL, away)

    state = await scene.is_refused(send, "target_system is 2", "target_component is 7")
    for thief in thieves:
        scene.session.network.detach(thief)
    return state


async def damaged(scene):
    """sends damaged frames and noise"""
    message = dialect.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, 1, ALL, 20.0, 0.0, -5.0, 0, 0, 0, 0, 0, 0, 0, 0
    )
    raw = bytearray(message.pack(scene.script.packer))
    raw[20] ^= 0x55

    def send(_):
        scene.hover()
        for data in (bytes(raw), bytes(raw[:17]), bytes(range(256))):
            scene.session.network.receive_frames(scene.script, scene.script.scan(data))

    await stream(0.5, send)
    return await scene.is_flown()


async def mode_fight(scene):
    """streams on, and asks for control again, after a station has changed the mode"""
    for _ in range(2):
        scene.ground.command(*STATION_HOLDS[scene.autopilot])
        scene.judge.ended()
        await stream(1.5, lambda _: scene.script.local(ALL, scene.home))
        assert not scene.flights.in_control
        assert scene.mode == "LOITER"
        scene.is_said("took over")
        if scene.autopilot == "px4":  # ArduPilot's GUIDED is the station's to command
            await scene.recover()
            scene.ground.heard.clear()
    return NOT_IN_CONTROL


async def other_system(scene):
    """asks for another system's OFFBOARD"""
    scene.ground.command(*STATION_HOLDS[scene.autopilot])
    scene.judge.ended()
    await asyncio.sleep(1.0)
    send = scene.script.send
    for _ in range(3):
        scene.script.local(ALL, scene.home)
        send(dialect.MAVLink_command_long_message(2, 1, 176, 0, 1, 6, 0, 0, 0, 0, 0))
        send(dialect.MAVLink_command_long_message(7, 0, 176, 0, 1, 6, 0, 0, 0, 0, 0))
        await asyncio.sleep(0.2)
    await asyncio.sleep(2.0)
    assert not scene.flights.in_control
    assert scene.mode == "LOITER"
    return NOT_IN_CONTROL


CELLS = [
    each
    for each in tuple(globals().values())
    if inspect.iscoroutinefunction(each) and each.__module__ == __name__
]
"""Every coroutine of this file, in their order."""

ONE_VEHICLE = (
    flood,
    reconnects_all_the_time,
    not_finite,
    contradictions,
    no_place,
    clock_jumps,
    upside_down,
    two_at_once,
    wrong_ids,
    damaged,
)
"""What is decided without the autopilot: PX4 alone flies them."""


def documented():
    """State by fault, from the table of the page."""
    page = (CONFIGS.parent / "docs/serve.md").read_text("utf-8")
    table = page.split("| a client that … |")[1].split("\n\n")[0]
    return dict(re.findall(r"^\| (.+?) \| (.+?) \|", table, re.MULTILINE))


def slow_loop(config):
    """The shipped vehicle with a loop of 100 Hz."""
    mock = bounded_yaml.parse(config.read_text("utf-8"))["mock"]
    autopilot = mock["autopilot"]
    loop = {"inner_loop_hz": LOOP_HZ}
    if autopilot == "ardupilot":
        loop = {"parameters": {"SCHED_LOOP_RATE": float(LOOP_HZ)}}
    return merged(mock, loop)


@pytest.mark.timeout(300)
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_every_fault_of_a_client_ends_in_its_documented_state(autopilot):
    # The limits of these scenes were measured after the take-off of the shipped vehicle.
    config = CONFIGS / f"mock-{autopilot}.yaml"
    vehicle = testing.MockVehicle(lockstep=False, compiled=can_compile(), **slow_loop(config))
    cells = [cell for cell in CELLS if autopilot == "px4" or cell not in ONE_VEHICLE]
    seen = {}

    async def whole(session):
        ground = await airborne(session, vehicle, autopilot)
        scene = Scene(vehicle, session, autopilot, ground, SetpointJudge(vehicle, autopilot))
        for cell in cells:
            await scene.recover()
            seen[cell.__doc__] = await cell(scene)
        scene.judge.ended()

    served(vehicle, autopilot, whole, hold_s=HOLD)
    expected = documented()
    if autopilot == "px4":
        assert seen == expected
    assert seen == {cell.__doc__: expected[cell.__doc__] for cell in cells}
    assert not vehicle.state()["crashed"]
