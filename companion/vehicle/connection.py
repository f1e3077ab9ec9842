"""Keeps the transport to the vehicle open, and says why nothing comes over it."""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass, field

from companion.mavlink.errors import EndpointError
from companion.mavlink.outbox import Outbox
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats
from companion.mavlink.transport.endpoint import Endpoint, UdpIn, UdpOut
from companion.mavlink.transport.opening import OpenTransport
from companion.vehicle.inbox import Inbox

_LOG = logging.getLogger(__name__)

_BACKOFF_FIRST_S, _BACKOFF_MAX_S = 0.2, 3.0


@dataclass(eq=False)
class Connection:
    """A connection that is opened again when it drops, with growing pauses.

    A drop discards unsent frames and an incomplete received frame, and calls `on_dropped`.
    """

    _endpoint: Endpoint
    _inbox: Inbox
    """Takes the bytes that arrive."""
    _outbox: Outbox
    """Sends over the open transport; drops frames while none is open."""
    _stats: LinkStats
    _on_dropped: Callable[[str], None]
    """Called with the reason when the connection drops."""
    _opener: OpenTransport
    _reopen_task: asyncio.Task[None] | None = field(default=None, init=False)
    _early_loss_reason: str | None = field(default=None, init=False)

    async def open(self) -> None:
        """Open the transport.

        Raises:
            EndpointError: the transport cannot be opened; the message says why and what to do.
        """
        # First, because bytes may arrive before this coroutine resumes.
        self._inbox.start_connection(streaming=not isinstance(self._endpoint, UdpIn | UdpOut))
        self._early_loss_reason = None
        transport = await self._opener(self._endpoint, self._inbox, self._on_lost)
        if self._early_loss_reason is not None:
            transport.close()
            raise EndpointError(f"the connection was dropped at once: {self._early_loss_reason}")
        self._outbox.transport = transport

    async def close(self) -> None:
        """Close the transport and stop reconnecting."""
        if self._reopen_task is not None:
            self._reopen_task.cancel()
            await asyncio.gather(self._reopen_task, return_exceptions=True)
        self._drop_transport()

    def _drop_transport(self) -> None:
        transport, self._outbox.transport = self._outbox.transport, None
        if transport is not None:
            transport.close()

    def _on_lost(self, reason: str) -> None:
        _LOG.warning("link lost: %s", reason)
        transport = self._outbox.transport
        if transport is None:
            self._early_loss_reason = reason
            return
        if transport.reconnects:
            self._drop_transport()
            self._reopen_task = asyncio.get_running_loop().create_task(self._reopen())
        else:  # a TCP server goes on listening
            self._inbox.start_connection(streaming=True)
            self._stats.reconnects += 1
        self._on_dropped(reason)

    async def _reopen(self) -> None:
        pause_s = _BACKOFF_FIRST_S
        while self._outbox.transport is None:
            await asyncio.sleep(pause_s)
            try:
                await self.open()
            except Exception as error:  # after any failure the next try may succeed
                _LOG.info("reconnecting failed, the next try follows: %s", error)
                pause_s = min(2.0 * pause_s, _BACKOFF_MAX_S)
        self._stats.reconnects += 1
        _LOG.info("link is back")


def no_heartbeat_message(settings: LinkSettings, stats: LinkStats, timeout_s: float) -> str:
    """The error message if no heartbeat of the autopilot came within `timeout_s`."""
    opening = f"no heartbeat from system {settings.target_system} within {timeout_s:g} s"
    refusal_message = _refusal_message(opening, stats)
    if refusal_message is not None:
        return refusal_message
    if stats.bad_crc:
        return (
            f"{opening}, but {stats.bad_crc} damaged frames; is the baud rate right? "
            "(link.endpoint)"
        )
    if settings.endpoint.startswith("serial:"):
        return (
            f"{opening} on {settings.endpoint}; is the vehicle running, does its port send "
            "MAVLink at this baud rate, and are TX and RX crossed?"
        )
    return f"{opening} on {settings.endpoint}; is the vehicle running and sending to this address?"


def no_beacon_message(settings: LinkSettings, stats: LinkStats) -> str:
    """The error message if no lockstep beacon came within `first_beacon_timeout_s`."""
    opening = f"no lockstep beacon within {settings.first_beacon_timeout_s:g} s"
    timeout_message = f"{opening} on {settings.endpoint}; is the vehicle running, and in lockstep?"
    return _refusal_message(opening, stats) or timeout_message


def _refusal_message(opening: str, stats: LinkStats) -> str | None:
    """The error message if frames were refused for their sender or signature; else None.

    `opening`: the beginning of the message.
    """
    if stats.unclaimed:
        return (
            f"{opening}, but {stats.unclaimed} other frames with the vehicle's ids; let the "
            "autopilot send HEARTBEAT on this link, because only its sender counts as the vehicle; "
            "if it is the mock vehicle in lockstep, set link.lockstep: true"
        )
    if stats.ignored_foreign:
        source = "/".join(map(str, min(stats.foreign_sources)))
        return (
            f"{opening}, but {stats.ignored_foreign} frames from others, such as system/component "
            f"{source}; is link.target_system right?"
        )
    if stats.bad_signature:
        return (
            f"{opening}, but {stats.bad_signature} frames that are not signed with the key in "
            "link.signing_key_file, or whose time stamp is refused; give both sides the same key, "
            "and set this computer's clock"
        )
    return None
