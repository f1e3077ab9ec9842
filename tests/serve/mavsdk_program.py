"""A program as MAVSDK's users write it, whose only change is its address."""

import asyncio
import json
import sys

from mavsdk.asyncio.mavsdk import Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.mission_raw import MissionItem, MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync, VelocityBodyYawspeed
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import FlightMode, TelemetryAsync
from mavsdk.component_type import ComponentType
from offboard_scene import first


def items():
    found = []
    for number in range(3):
        item = MissionItem()
        item.seq, item.frame, item.command = number, 6, 16
        item.current, item.autocontinue = int(number == 0), 1
        item.param1 = item.param2 = item.param3 = item.param4 = 0.0
        item.x, item.y, item.z = 473977420 + 1000 * number, 85455940, 10.0
        item.mission_type = 0
        found.append(item)
    return found


async def main(endpoint: str) -> dict[str, object]:
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as mavsdk:
        await mavsdk.add_any_connection(endpoint)
        system = await mavsdk.first_autopilot(timeout_s=10)
        action, telemetry = ActionAsync(system), TelemetryAsync(system)
        mission, parameters = MissionRawAsync(system), ParamAsync(system)
        report: dict[str, object] = {}
        report["takeoff_altitude"] = await parameters.get_param_float("MIS_TAKEOFF_ALT")
        await mission.upload_mission(items())
        report["mission"] = len(await mission.download_mission())
        await first(telemetry.subscribe_health(), lambda health: health.is_armable)
        await action.arm()
        await first(telemetry.subscribe_armed(), bool)
        await action.takeoff()
        await first(telemetry.subscribe_position(), lambda place: place.relative_altitude_m > 2.2)
        await asyncio.sleep(2.0)
        await hover(OffboardAsync(system), telemetry, report)
        return report


async def hover(offboard, telemetry, report):
    """Hold by setpoints, 20 a second, until another station changes the mode."""
    setpoint = VelocityBodyYawspeed()
    setpoint.forward_m_s = setpoint.right_m_s = setpoint.down_m_s = setpoint.yawspeed_deg_s = 0.0
    await offboard.set_velocity_body(setpoint)
    await offboard.start()
    await first(telemetry.subscribe_flight_mode(), lambda mode: mode is FlightMode.OFFBOARD)
    print("IN CONTROL", flush=True)
    mode = await first(
        telemetry.subscribe_flight_mode(), lambda mode: mode is not FlightMode.OFFBOARD
    )
    report["lost_to"] = mode.name


if __name__ == "__main__":
    print("REPORT " + json.dumps(asyncio.run(main(sys.argv[1]))))
