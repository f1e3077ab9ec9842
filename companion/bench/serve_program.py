"""A program that answers samples and forwards all messages to clients, like `companion serve`."""

import sys

from companion.bench.companion_program import answer
from companion.mavlink import loop as link_loop
from companion.mavlink.settings import LinkSettings
from companion.serve.network.network import Network
from companion.vehicle.link import Link


async def fly(port: int, client_port: int) -> None:
    """Answer each attitude sample, and forward everything to the clients, until killed.

    Args:
        port: UDP port for the vehicle.
        client_port: UDP port for the clients.
    """
    link = Link(LinkSettings(endpoint=f"udpin://127.0.0.1:{port}"))
    async with link, Network(link, [f"udpin://127.0.0.1:{client_port}"]) as network:
        network.routing.intercept = lambda *_: False
        await answer(link)


if __name__ == "__main__":
    link_loop.run(fly(int(sys.argv[1]), int(sys.argv[2])))
