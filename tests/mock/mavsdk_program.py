"""A program as MAVSDK's users write it: connect, arm, take off, fly by rates, land."""

import asyncio
import json
import sys

from mavsdk.asyncio.mavsdk import Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.offboard import AttitudeRate, OffboardAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.component_type import ComponentType

HOVER = 0.4903


def rate(*, yaw_deg_s: float = 0.0) -> AttitudeRate:
    setpoint = AttitudeRate()
    setpoint.roll_deg_s = setpoint.pitch_deg_s = 0.0
    setpoint.yaw_deg_s = yaw_deg_s
    setpoint.thrust_value = HOVER
    return setpoint


async def first(stream, condition):
    """Return the first item of a telemetry stream that meets a condition."""
    async for item in stream:
        if condition(item):
            return item
    raise RuntimeError("the stream ended")


async def fly(port: int) -> dict[str, object]:
    report: dict[str, object] = {}
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = await mavsdk.first_autopilot(timeout_s=10)
        action, offboard, telemetry = (
            ActionAsync(system), OffboardAsync(system), TelemetryAsync(system),
        )  # fmt: skip
        await first(telemetry.subscribe_health(), lambda health: health.is_armable)
        await first(telemetry.subscribe_health_all_ok(), bool)
        await action.set_takeoff_altitude(3.0)
        report["takeoff_altitude"] = await action.get_takeoff_altitude()
        await action.arm()
        await action.takeoff()
        await first(telemetry.subscribe_position(), lambda place: place.relative_altitude_m > 2.7)
        before = await first(telemetry.subscribe_attitude_euler(), lambda _: True)
        await offboard.set_attitude_rate(rate(yaw_deg_s=15.0))
        await offboard.start()
        report["offboard"] = await offboard.is_active()
        await first(
            telemetry.subscribe_attitude_euler(),
            lambda now: 20.0 < (now.yaw_deg - before.yaw_deg) % 360.0 < 180.0,
        )
        report["turned"] = True
        await offboard.stop()
        await action.land()
        await first(telemetry.subscribe_armed(), lambda armed: not armed)
        report["disarmed"] = True
    return report


if __name__ == "__main__":
    print("REPORT " + json.dumps(asyncio.run(fly(int(sys.argv[1])))))
