"""The offboard program on the native package, `mavsdk` 4."""

import asyncio

from mavsdk.asyncio.mavsdk import Configuration, Mavsdk
from mavsdk.asyncio.plugins import offboard
from mavsdk.asyncio.plugins.action import ActionAsync, ActionError
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import FlightMode, TelemetryAsync
from mavsdk.component_type import ComponentType
from offboard_scene import Program, first, main


def made(kind, **values):
    setpoint = kind()
    for name, value in values.items():
        setattr(setpoint, name, value)
    return setpoint


def position(north, east, down, yaw=0.0):
    return made(offboard.PositionNedYaw, north_m=north, east_m=east, down_m=down, yaw_deg=yaw)


def velocity(north, east, down, yaw=0.0):
    return made(offboard.VelocityNedYaw, north_m_s=north, east_m_s=east, down_m_s=down, yaw_deg=yaw)


def acceleration(north, east, down):
    return made(offboard.AccelerationNed, north_m_s2=north, east_m_s2=east, down_m_s2=down)


class Native(Program):
    refusal = ActionError

    def __init__(self, system):
        super().__init__()
        self._action, self._offboard = ActionAsync(system), offboard.OffboardAsync(system)
        self._telemetry, self._param = TelemetryAsync(system), ParamAsync(system)
        self._following = asyncio.ensure_future(self._follow())

    async def _follow(self):
        async for item in self._telemetry.subscribe_position_velocity_ned():
            self.place = (item.position.north_m, item.position.east_m, item.position.down_m)
            self.speed = (item.velocity.north_m_s, item.velocity.east_m_s, item.velocity.down_m_s)

    async def armable(self):
        health = await first(self._telemetry.subscribe_health(), lambda each: each.is_armable)
        return health.is_armable

    async def parameter(self, name):
        return await self._param.get_param_float(name)

    async def arm(self):
        await self._action.arm()

    async def take_off(self, height):
        await self._action.set_takeoff_altitude(height)
        await self._action.takeoff()

    async def climbed(self, height):
        places = self._telemetry.subscribe_position()
        await first(places, lambda place: place.relative_altitude_m > height)

    async def start(self):
        await self._offboard.start()

    async def stop(self):
        await self._offboard.stop()
        self._following.cancel()

    async def active(self):
        return await self._offboard.is_active()

    async def lost(self):
        modes = self._telemetry.subscribe_flight_mode()
        await first(modes, lambda mode: mode is not FlightMode.OFFBOARD)

    async def land(self):
        await self._action.land()
        await first(self._telemetry.subscribe_armed(), lambda armed: not armed)

    async def position(self, north, east, down):
        await self._offboard.set_position_ned(position(north, east, down))

    async def velocity(self, north, east, down):
        await self._offboard.set_velocity_ned(velocity(north, east, down))

    async def velocity_body(self, forward, right, down):
        await self._offboard.set_velocity_body(
            made(
                offboard.VelocityBodyYawspeed,
                forward_m_s=forward,
                right_m_s=right,
                down_m_s=down,
                yawspeed_deg_s=0.0,
            )
        )

    async def position_velocity(self, place, speed):
        await self._offboard.set_position_velocity_ned(position(*place), velocity(*speed))

    async def position_velocity_acceleration(self, place, speed, change):
        await self._offboard.set_position_velocity_acceleration_ned(
            position(*place), velocity(*speed), acceleration(*change)
        )

    async def acceleration(self, north, east, down):
        await self._offboard.set_acceleration_ned(acceleration(north, east, down))

    async def attitude(self, thrust):
        level = made(
            offboard.Attitude, roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, thrust_value=thrust
        )
        await self._offboard.set_attitude(level)


async def run(endpoint, fly):
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as mavsdk:
        await mavsdk.add_any_connection(endpoint)
        return await fly(Native(await mavsdk.first_autopilot(timeout_s=15)))


if __name__ == "__main__":
    main(run)
