"""A program that sends setpoints with the link, control loop and planner of `companion fly`.

`python -m companion.bench.companion_program PORT [mavsdk | CLIENT_PORT]` listens on UDP port PORT.
With `mavsdk`, MAVSDK forwards all frames (`link.backend: mavsdk`). With CLIENT_PORT, all messages
are also forwarded to clients at this UDP port, like `companion serve`.
"""

import asyncio
import sys
from contextlib import AsyncExitStack
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
from companion.serve.network.network import Network
from companion.vehicle.link import Link

_GUIDANCE_PERIOD_S = 0.02


async def fly(port: str, forwarding: str = "") -> None:
    """Answer each attitude sample with a setpoint until killed; arguments: see the module."""
    settings = LinkSettings(endpoint=f"udpin://127.0.0.1:{port}")
    async with AsyncExitStack() as stack:
        link = await stack.enter_async_context(_link(settings, by_mavsdk=forwarding == "mavsdk"))
        if forwarding.isdigit():
            network = Network(link, [f"udpin://127.0.0.1:{forwarding}"])
            network = await stack.enter_async_context(network)
            network.routing.intercept = lambda *_: False
        await _answer(link)


def _link(settings: LinkSettings, *, by_mavsdk: bool) -> Link:
    if not by_mavsdk:
        return Link(settings)
    from companion.mavsdk_link import MavsdkLink  # noqa: PLC0415  an extra

    return MavsdkLink(settings)


async def _answer(link: Link) -> NoReturn:
    """Run a `ControlLoop` on the samples, with a new guidance command 50 times a second."""
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
    link_loop.run(fly(*sys.argv[1:]))
