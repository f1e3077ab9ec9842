"""Answers samples and forwards all messages to clients, as `companion serve` does in control."""

import sys

from companion.bench.companion_program import answer
from companion.mavlink import loop as link_loop
from companion.mavlink.settings import LinkSettings
from companion.serve.network.network import Network
from companion.vehicle.link import Link


async def fly(port: int, client_port: int) -> None:
    """Answer each sample, and pass everything to the clients, until killed."""
    link = Link(LinkSettings(endpoint=f"udpin://127.0.0.1:{port}"))
    async with link, Network(link, [f"udpin://127.0.0.1:{client_port}"]) as network:
        network.routing.intercept = lambda *_: False
        await answer(link)


if __name__ == "__main__":
    link_loop.run(fly(int(sys.argv[1]), int(sys.argv[2])))
