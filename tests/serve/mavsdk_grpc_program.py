"""The offboard program on the package with a server, `mavsdk-grpc`, as most scripts use it."""

import asyncio
import contextlib

from mavsdk_grpc import System
from mavsdk_grpc.action import ActionError
from mavsdk_grpc.offboard import (
    AccelerationNed,
    Attitude,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk_grpc.telemetry import FlightMode
from offboard_scene import Program, first, main

from companion.mavlink.transport.free_port import free_port


class Grpc(Program):
    refusal = ActionError

    def __init__(self, system):
        super().__init__()
        self._system, self._offboard = system, system.offboard
        self._following = asyncio.ensure_future(self._follow())

    async def _follow(self):
        async for item in self._system.telemetry.position_velocity_ned():
            self.place = (item.position.north_m, item.position.east_m, item.position.down_m)
            self.speed = (item.velocity.north_m_s, item.velocity.east_m_s, item.velocity.down_m_s)

    async def armable(self):
        health = await first(self._system.telemetry.health(), lambda each: each.is_armable)
        return health.is_armable

    async def parameter(self, name):
        return await self._system.param.get_param_float(name)

    async def arm(self):
        await self._system.action.arm()

    async def take_off(self, height):
        await self._system.action.set_takeoff_altitude(height)
        await self._system.action.takeoff()

    async def climbed(self, height):
        places = self._system.telemetry.position()
        await first(places, lambda place: place.relative_altitude_m > height)

    async def start(self):
        await self._offboard.start()

    async def stop(self):
        await self._offboard.stop()
        self._following.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._following

    async def active(self):
        return await self._offboard.is_active()

    async def lost(self):
        modes = self._system.telemetry.flight_mode()
        await first(modes, lambda mode: mode != FlightMode.OFFBOARD)

    async def land(self):
        await self._system.action.land()
        await first(self._system.telemetry.armed(), lambda armed: not armed)

    async def position(self, north, east, down):
        await self._offboard.set_position_ned(PositionNedYaw(north, east, down, 0.0))

    async def velocity(self, north, east, down):
        await self._offboard.set_velocity_ned(VelocityNedYaw(north, east, down, 0.0))

    async def velocity_body(self, forward, right, down):
        await self._offboard.set_velocity_body(VelocityBodyYawspeed(forward, right, down, 0.0))

    async def position_velocity(self, place, speed):
        await self._offboard.set_position_velocity_ned(
            PositionNedYaw(*place, 0.0), VelocityNedYaw(*speed, 0.0)
        )

    async def position_velocity_acceleration(self, place, speed, change):
        await self._offboard.set_position_velocity_acceleration_ned(
            PositionNedYaw(*place, 0.0), VelocityNedYaw(*speed, 0.0), AccelerationNed(*change)
        )

    async def acceleration(self, north, east, down):
        await self._offboard.set_acceleration_ned(AccelerationNed(north, east, down))

    async def attitude(self, thrust):
        await self._offboard.set_attitude(Attitude(0.0, 0.0, 0.0, thrust))


async def run(endpoint, fly):
    system = System(port=free_port())
    await system.connect(system_address=endpoint)
    await first(system.core.connection_state(), lambda state: state.is_connected)
    return await fly(Grpc(system))


if __name__ == "__main__":
    main(run)
