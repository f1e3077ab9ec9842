"""A MAVSDK offboard program: every kind of setpoint, and a circle of 5 m at 5 m/s."""

import asyncio
import json
import math
import sys
import time

from mavsdk.asyncio.mavsdk import Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync, ActionError
from mavsdk.asyncio.plugins.offboard import (
    AccelerationNed,
    Attitude,
    OffboardAsync,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.component_type import ComponentType


def made(kind, **values):
    setpoint = kind()
    for name, value in values.items():
        setattr(setpoint, name, value)
    return setpoint


def position(north, east, down, yaw=0.0):
    return made(PositionNedYaw, north_m=north, east_m=east, down_m=down, yaw_deg=yaw)


def velocity(north, east, down, yaw=0.0):
    return made(VelocityNedYaw, north_m_s=north, east_m_s=east, down_m_s=down, yaw_deg=yaw)


async def first(stream, condition):
    async for item in stream:
        if condition(item):
            return item
    raise RuntimeError("the stream ended")


class Newest:
    """Keeps the newest position and velocity."""

    def __init__(self, telemetry):
        self.place = self.speed = None
        self._task = asyncio.ensure_future(self._follow(telemetry))

    async def _follow(self, telemetry):
        async for item in telemetry.subscribe_position_velocity_ned():
            self.place = (item.position.north_m, item.position.east_m, item.position.down_m)
            self.speed = (item.velocity.north_m_s, item.velocity.east_m_s, item.velocity.down_m_s)

    def close(self):
        self._task.cancel()


async def circle(offboard, newest, start, seconds, radius=5.0, speed=5.0, ramp=3.0):
    """Stream position, velocity and acceleration at 50 Hz; RMS of the position at full speed, m."""
    began, errors, rate = time.monotonic(), [], speed / radius
    while (now := time.monotonic() - began) < seconds:
        if now < ramp:
            angle, turning, change = 0.5 * rate * now**2 / ramp, rate * now / ramp, rate / ramp
        else:
            angle, turning, change = rate * (now - 0.5 * ramp), rate, 0.0
        c, s = math.cos(angle), math.sin(angle)
        place = position(start[0] - radius + radius * c, start[1] + radius * s, start[2])
        await offboard.set_position_velocity_acceleration_ned(
            place,
            velocity(-radius * turning * s, radius * turning * c, 0.0),
            made(
                AccelerationNed,
                north_m_s2=-radius * (turning**2 * c + change * s),
                east_m_s2=radius * (change * c - turning**2 * s),
                down_m_s2=0.0,
            ),
        )
        if now > ramp + 2.0:
            wanted = (place.north_m, place.east_m, place.down_m)
            errors.append(math.dist(newest.place, wanted))
        await asyncio.sleep(max(0.0, 0.02 - (time.monotonic() - began - now)))
    return math.sqrt(sum(error**2 for error in errors) / len(errors))


async def take_off(action):
    """Arm and take off, as soon as the autopilot lets us: ArduPilot takes 40 s to be ready."""
    async with asyncio.timeout(70.0):
        while True:
            try:
                await action.arm()
                await action.takeoff()
            except ActionError:
                await asyncio.sleep(1.0)
            else:
                return


async def fly(endpoint: str, hover: float) -> dict[str, object]:
    report: dict[str, object] = {}
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as mavsdk:
        await mavsdk.add_any_connection(endpoint)
        system = await mavsdk.first_autopilot(timeout_s=15)
        action, offboard, telemetry = (
            ActionAsync(system), OffboardAsync(system), TelemetryAsync(system),
        )  # fmt: skip
        await first(telemetry.subscribe_health(), lambda health: health.is_armable)
        await action.set_takeoff_altitude(5.0)
        await take_off(action)
        await first(telemetry.subscribe_position(), lambda place: place.relative_altitude_m > 4.6)
        await asyncio.sleep(3.0)
        newest = Newest(telemetry)
        while newest.place is None:  # noqa: ASYNC110
            await asyncio.sleep(0.05)
        start = newest.place
        await offboard.set_position_ned(position(*start))
        await offboard.start()
        report["active"] = await offboard.is_active()
        await offboard.set_position_ned(position(start[0] + 3.0, start[1], start[2], 30.0))
        await asyncio.sleep(5.0)
        report["position"] = math.dist(newest.place, (start[0] + 3.0, start[1], start[2]))
        await offboard.set_velocity_ned(velocity(-1.5, 0.0, 0.0))
        await asyncio.sleep(2.5)
        report["velocity"] = newest.speed[0]
        await offboard.set_velocity_body(
            made(
                VelocityBodyYawspeed,
                forward_m_s=0.0,
                right_m_s=0.0,
                down_m_s=0.0,
                yawspeed_deg_s=0.0,
            )
        )
        await asyncio.sleep(2.0)
        await offboard.set_acceleration_ned(
            made(AccelerationNed, north_m_s2=0.5, east_m_s2=0.0, down_m_s2=0.0)
        )
        await asyncio.sleep(2.0)
        report["acceleration"] = newest.speed[0]
        await offboard.set_attitude(
            made(Attitude, roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, thrust_value=hover)
        )
        await asyncio.sleep(1.0)
        await offboard.set_position_ned(position(*start))
        await asyncio.sleep(4.0)
        report["circle_rms_m"] = await circle(offboard, newest, start, 12.0)
        await offboard.set_position_ned(position(*newest.place))
        report["still_active"] = await offboard.is_active()
        await offboard.stop()
        await asyncio.sleep(1.0)
        newest.close()
        await action.land()
        await first(telemetry.subscribe_armed(), lambda armed: not armed)
        report["disarmed"] = True
    return report


if __name__ == "__main__":
    print("REPORT " + json.dumps(asyncio.run(fly(sys.argv[1], float(sys.argv[2])))))
