"""A program that answers samples through MAVSDK's asyncio interface, as MAVSDK's users write it.

MAVSDK stamps setpoints with its own clock. This program therefore returns the time stamp of the
sample in the yaw rate, as 1 °/s for each ms, modulo `STAMP_MODULUS`.
"""

import asyncio
import sys
from math import degrees

from mavsdk.asyncio.mavsdk import Configuration, Mavsdk
from mavsdk.asyncio.plugins.offboard import AttitudeRate, OffboardAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.component_type import ComponentType

from companion.attitude import Target
from companion.config import Config
from companion.control.inner_loop import planner as make_planner

STAMP_MODULUS = 8192  # below this, whole °/s survive the conversion to a float32 in rad/s
_HOVER_THRUST = 0.5
_DT = 0.004


def setpoint(roll_deg_s: float, pitch_deg_s: float, yaw_deg_s: float) -> AttitudeRate:
    """An AttitudeRate with these rates, in °/s, and hover thrust.

    AttitudeRate is a C structure without a constructor for values.
    """
    rate = AttitudeRate()
    rate.roll_deg_s, rate.pitch_deg_s, rate.yaw_deg_s = roll_deg_s, pitch_deg_s, yaw_deg_s
    rate.thrust_value = _HOVER_THRUST
    return rate


async def fly(port: int) -> None:
    """Answer each attitude sample with a setpoint until killed; `port`: UDP port to listen on."""
    planner = make_planner(Config())
    target = Target(0.1, 0.0, 0.0)
    configuration = Configuration.create_with_component_type(ComponentType.COMPANION_COMPUTER)
    async with Mavsdk(configuration) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = await mavsdk.first_autopilot(timeout_s=-1)
        offboard, telemetry = OffboardAsync(system), TelemetryAsync(system)
        await offboard.set_attitude_rate(setpoint(0.0, 0.0, 0.0))
        await offboard.start()
        async for attitude in telemetry.subscribe_attitude_quaternion():
            q = (attitude.w, attitude.x, attitude.y, attitude.z)
            rates = planner.rates(q, target, _DT)
            stamp_ms = attitude.timestamp_us // 1000
            await offboard.set_attitude_rate(
                setpoint(degrees(rates.roll), degrees(rates.pitch), stamp_ms % STAMP_MODULUS)
            )


if __name__ == "__main__":
    asyncio.run(fly(int(sys.argv[1])))
