"""A session of `companion serve`: the link, the clients, and our component between them."""

import asyncio
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from companion.config import Config
from companion.flight.assembly import open_link
from companion.flight.context import cancel
from companion.flight.observer import StateLogger
from companion.mavlink.framing import Frame
from companion.serve.component import Component
from companion.serve.network.client import Client
from companion.serve.network.network import Network
from companion.serve.network.permission import Permission
from companion.serve.network.routing import Channel
from companion.vehicle.link import Link

Note = Callable[[str], None]


class ServeSession:
    """Passes everything between the vehicle and the clients until `stop` is called.

    Args:
        config: its sections `link` and `serve`.
        note: takes events as sentences.
    """

    def __init__(self, config: Config, note: Note) -> None:
        self._config, self._note = config, note
        self._stop = asyncio.Event()

    def stop(self) -> None:
        """End the session; signal handlers may call this."""
        self._stop.set()

    async def run(self) -> dict[str, Any]:
        """Serve until `stop`; returns the counters.

        Raises:
            EndpointError: the link or an endpoint of `serve.clients` could not be opened.
            SigningError: the key cannot be used.
        """
        async with open_link(self._config, None, self._note) as link:
            state_logger = StateLogger(link.state, self._note)
            link.subscribe("HEARTBEAT", lambda _: state_logger.log_changes())
            async with Network(link, self._config.serve.clients) as network:
                component = Component(link.settings, network, link.send)
                guard = _Guard(self._config, link, component)
                network.routing.on_own = component.on_own
                network.routing.intercept = guard.intercept
                for endpoint in self._config.serve.clients:
                    self._note(f"clients at {endpoint}")
                heartbeats = asyncio.create_task(component.run())
                try:
                    await self._stop.wait()
                finally:
                    await cancel(heartbeats)
                return _counters(link, network)


class _Guard:
    """Refuses what a client may not send."""

    def __init__(self, config: Config, link: Link, component: Component) -> None:
        self._permission = Permission(config.serve.trusted, link.settings.signing)
        self._component = component

    def intercept(self, client: Channel, frame: Frame) -> bool:
        """Whether a frame is refused; its sender is told why."""
        assert isinstance(client, Client)
        refusal = self._permission.refusal(client, frame)
        if refusal is not None:
            self._component.answer(client, refusal)
        return refusal is not None


def _counters(link: Link, network: Network) -> dict[str, Any]:
    """What was passed on, for `serve --json`."""
    stats = asdict(link.stats)
    return {
        "routing": asdict(network.routing.stats),
        "uplink": {"sent": network.uplink.sent, "dropped": network.uplink.dropped},
        "overflowed": network.overflowed,
        "clients": {client.name: asdict(client.stats) for client in network.clients},
        "link": {name: value for name, value in stats.items() if isinstance(value, int)},
    }
