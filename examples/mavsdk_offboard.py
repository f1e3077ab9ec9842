"""Fly by MAVSDK through `companion serve`; on the autopilot itself only the address differs.

First, each in a terminal: `python -m sitl_mock`, `companion serve --config configs/mock-px4.yaml`.

Run: python examples/mavsdk_offboard.py [udpout://127.0.0.1:14551]
"""

import asyncio
import sys

from mavsdk_grpc import System
from mavsdk_grpc.offboard import PositionNedYaw, VelocityNedYaw


async def main(address: str) -> None:
    drone = System()
    await drone.connect(system_address=address)
    async for health in drone.telemetry.health():
        if health.is_armable:
            break
    await drone.action.arm()
    await drone.action.takeoff()
    async for position in drone.telemetry.position():
        if position.relative_altitude_m > 2.2:
            break
    await asyncio.sleep(3.0)
    await drone.offboard.set_velocity_ned(VelocityNedYaw(0.0, 0.0, 0.0, 0.0))
    await drone.offboard.start()
    await drone.offboard.set_velocity_ned(VelocityNedYaw(1.5, 0.0, 0.0, 0.0))
    await asyncio.sleep(4.0)
    await drone.offboard.set_position_ned(PositionNedYaw(2.0, 3.0, -3.0, 90.0))
    await asyncio.sleep(8.0)
    async for now in drone.telemetry.position_velocity_ned():
        print(f"north {now.position.north_m:.2f} m, east {now.position.east_m:.2f} m")
        break
    await drone.offboard.stop()
    await drone.action.land()


asyncio.run(main(sys.argv[1] if len(sys.argv) > 1 else "udpout://127.0.0.1:14551"))
