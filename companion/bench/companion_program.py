"""A program that answers samples with link, control loop, planner and thrust of `companion fly`."""

import asyncio
import sys
from typing import NoReturn

from companion.attitude import Target
from companion.config import Config
from companion.control.control_loop import ControlLoop
from companion.control.guidance_command import GuidanceCommand
from companion.control.inner_loop import hover_thrust, planner, rate_limits
from companion.control.loop_record import Deadlines
from companion.mavlink import loop as link_loop
from companion.mavlink.settings import LinkSettings
from companion.recording.trace import FlightTrace
from companion.vehicle.link import Link

_GUIDANCE_PERIOD_S = 0.02


async def fly(port: int) -> None:
    """Answer each attitude sample with a setpoint until killed; `port`: UDP port to listen on."""
    async with Link(LinkSettings(endpoint=f"udpin://127.0.0.1:{port}")) as link:
        await answer(link)


async def answer(link: Link) -> NoReturn:
    """Answer samples by a `ControlLoop`, which gets a new guidance command 50 times a second."""
    config = Config()
    now = asyncio.get_running_loop().time
    loop = ControlLoop(
        planner(config),
        hover_thrust(config),
        link.send_setpoint,
        Deadlines(telemetry_stale=1.0, target_stale=1.0, deadline=1.0),
        FlightTrace(),
        rate_limits(config),
        now,
    )
    loop.on = True
    link.on_attitude = loop.on_sample
    while True:
        loop.command = GuidanceCommand(Target(0.1, 0.0, 0.0), 0.0, now())
        await asyncio.sleep(_GUIDANCE_PERIOD_S)


if __name__ == "__main__":
    link_loop.run(fly(int(sys.argv[1])))
