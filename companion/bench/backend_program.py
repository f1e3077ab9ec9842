"""Answers attitude samples with `link.backend: mavsdk`, where MAVSDK forwards all frames."""

import sys

from companion.bench.companion_program import answer
from companion.mavlink import loop as link_loop
from companion.mavlink.settings import LinkSettings
from companion.mavsdk_link import MavsdkLink


async def fly(port: int) -> None:
    """Answer each attitude sample with a setpoint until killed; `port`: UDP port to listen on."""
    async with MavsdkLink(LinkSettings(endpoint=f"udpin://127.0.0.1:{port}")) as link:
        await answer(link)


if __name__ == "__main__":
    link_loop.run(fly(int(sys.argv[1])))
