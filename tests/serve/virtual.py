"""`companion serve` and its clients in memory, on the mock vehicle's clock."""

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion import testing
from companion.config.files import changed, load
from companion.serve.session import ServeSession
from tests.flight.fly import QuickVehicle, attitude_rate_hz

CONFIGS = Path(__file__).parents[2] / "configs"
MAVLINK_2 = 0xFD
POSITION, VELOCITY, ALL = 0x0DF8, 0x0DC7, 0x0C00


def mock(autopilot, *, lockstep=False, **settings):
    return QuickVehicle(lockstep=lockstep, config=CONFIGS / f"mock-{autopilot}.yaml", **settings)


UNREAD = {
    dialect.MAVLINK_MSG_ID_ATTITUDE,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
}
"""No scene asks a client for these, and they are most of what it gets."""


def read(data):
    """The frames that a client decodes, of whole frames of MAVLink 2."""
    kept, at = b"", 0
    while at < len(data):
        assert data[at] == MAVLINK_2
        length = data[at + 1] + (25 if data[at + 2] & 1 else 12)  # with or without a signature
        frame = data[at : at + length]
        if int.from_bytes(frame[7:10], "little") not in UNREAD:
            kept += frame
        at += length
    return kept


class MemoryClient(testing.Program):
    """A program that says what the tests need, and reads what they look at."""

    def _flush(self):
        while self._queued_frames:
            data, _ = self._dequeue(100_000)
            self.heard += self._parser.parse_buffer(read(data)) or ()

    def texts(self):
        """What our component said; the pieces of long texts joined."""
        said = {}
        for number, each in enumerate(self.of("STATUSTEXT")):
            if each.get_srcComponent() == 191:
                key = -number if each.id == 0 else each.id
                said[key] = said.get(key, "") + each.text
        return list(said.values())

    def local(
        self,
        mask,
        position=(0, 0, 0),
        velocity=(0, 0, 0),
        acceleration=(0, 0, 0),
        *,
        frame=1,
        yaw=0.0,
        yaw_rate=0.0,
        target=(1, 1),
    ):
        self.send(
            dialect.MAVLink_set_position_target_local_ned_message(
                0, *target, frame, mask, *position, *velocity, *acceleration, yaw, yaw_rate
            )
        )

    def attitude(self, mask, q, thrust, rates=(0.0, 0.0, 0.0)):
        self.send(
            dialect.MAVLink_set_attitude_target_message(0, 1, 1, mask, list(q), *rates, thrust)
        )

    def command(self, number, *parameters):
        padded = (*parameters, *(0.0,) * 7)[:7]
        self.send(dialect.MAVLink_command_long_message(1, 1, number, 0, *padded))

    async def acknowledged(self, number, seconds=20.0):
        """The final answer to the newest command of that number."""
        begin = len(self.of("COMMAND_ACK"))
        async with asyncio.timeout(seconds):
            while True:
                for ack in self.of("COMMAND_ACK")[begin:]:
                    if ack.command == number and ack.result != 5:
                        return ack.result
                await asyncio.sleep(0.02)

    async def offboard(self):
        """Ask PX4 for OFFBOARD, as MAVSDK does; the result."""
        answer = asyncio.ensure_future(self.acknowledged(176))
        await asyncio.sleep(0)
        self.command(176, 1, 6, 0)
        return await answer


async def stream(seconds, send, period=0.02):
    """Call `send(t)` every period for a time; t counts from the beginning, s."""
    loop = asyncio.get_running_loop()
    begin = loop.time()
    number = 0
    while number * period < seconds:
        send(number * period)
        number += 1
        await asyncio.sleep(max(0.0, begin + number * period - loop.time()))


async def begin_control(session, script, autopilot, hold):
    """Stream `hold()` until the vehicle is under control."""
    await stream(0.3, hold)
    asked = asyncio.ensure_future(script.offboard()) if autopilot == "px4" else None
    async with asyncio.timeout(15.0):
        while not session.flights.in_control:
            await stream(0.2, hold)
    while asked is not None and not asked.done():
        await stream(0.1, hold)
    assert asked is None or asked.result() == 0, script.texts()
    await stream(0.5, hold)


@asynccontextmanager
async def serving(
    vehicle, autopilot, notes=None, directory=None, limits=None, **serve
) -> AsyncIterator[ServeSession]:
    """A session over the vehicle in memory."""
    config = changed(
        load(CONFIGS / f"mock-{autopilot}.yaml"),
        {
            "link": {"attitude_rate_hz": attitude_rate_hz(vehicle)},
            "limits": {"max_tilt_deg": 45.0, **(limits or {})},
            "serve": serve,
        },
        "the test",
    )
    note = (lambda _: None) if notes is None else notes.append
    async with testing.serving(config, vehicle, directory, note) as session:
        yield session


def place(session):
    """The vehicle's position as the session knows it, m NED."""
    return session.flights._vehicle.link.state.position.position_ned


def served(vehicle, autopilot, scene, **settings):
    """Run `scene(session)` in the vehicle's time."""

    async def whole():
        async with serving(vehicle, autopilot, **settings) as session:
            await scene(session)

    testing.run(vehicle, whole())


async def airborne(session, vehicle, autopilot, height=5.0):
    """Arm and take off by the autopilot's own commands, as a client would."""
    ground = MemoryClient("ground", (255, 190)).connect(session)
    async with asyncio.timeout(120.0):
        await ground.hears("HEARTBEAT")
        if autopilot == "ardupilot":
            for name, rate in (("LOCAL_POSITION_NED", 50), ("EXTENDED_SYS_STATE", 5),
                               ("SYS_STATUS", 2), ("GLOBAL_POSITION_INT", 10)):  # fmt: skip
                number = getattr(dialect, f"MAVLINK_MSG_ID_{name}")
                ground.command(511, number, 1e6 / rate)
                await asyncio.sleep(0.2)
        while True:
            if autopilot == "ardupilot":
                ground.command(176, 1, 4)
                await asyncio.sleep(0.5)
            ground.command(400, 1)
            await asyncio.sleep(1.5)
            if vehicle.state()["armed"]:
                break
        if autopilot == "px4":
            altitude = ground.of("GLOBAL_POSITION_INT")[-1].alt * 1e-3
            ground.command(22, 0, 0, 0, math.nan, math.nan, math.nan, altitude + height)
        else:
            ground.command(22, 0, 0, 0, 0, 0, 0, height)
        while True:
            true = vehicle.state()
            above = -true["position"][2]
            if (
                above > height - 0.4
                and abs(true["velocity"][2]) < 0.2
                and true["mode"] != "TAKEOFF"
            ):
                break
            await asyncio.sleep(0.2)
    return ground
