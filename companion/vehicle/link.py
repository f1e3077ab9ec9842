"""The link to one vehicle, through which everything is sent and received."""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any

from companion.attitude.types import BodyRates
from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.errors import LinkTimeout
from companion.mavlink.frame_filter import Notice
from companion.mavlink.outbox import Outbox
from companion.mavlink.pending import AnswerQueue
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import StampWriter
from companion.mavlink.stats import LinkStats
from companion.mavlink.transport.base import Tap
from companion.mavlink.transport.endpoint import parse_endpoint
from companion.mavlink.transport.opening import OpenTransport, open_transport
from companion.vehicle.client import VehicleClient
from companion.vehicle.clock import VehicleClock
from companion.vehicle.connection import Connection, no_beacon_message, no_heartbeat_message
from companion.vehicle.inbox import Inbox, LinkCallbacks
from companion.vehicle.lockstep_inbox import LockstepInbox
from companion.vehicle.records import Heartbeat
from companion.vehicle.timesync import TimeSync

_LOG = logging.getLogger(__name__)


class Link(VehicleClient, LinkCallbacks):
    """A MAVLink connection to one vehicle. Use it as `async with Link(settings) as link:`.

    The link sends heartbeats and TIMESYNC requests, and reopens a dropped connection. Each call of
    `send_setpoint` sends one setpoint once; the link never repeats a setpoint.

    Args:
        tap: called with every frame accepted from and sent to the vehicle, for recordings.
        notice: called once with each notice about signatures, their time stamps and the peer; by
            default it logs a warning.

    Attributes:
        stats: counters of the link.
        state: the vehicle's telemetry.
        clock: the vehicle's clock: the age of samples, and jumps or restarts of the clock.
        timesync: round trip and jitter.

    Raises:
        EndpointError: the endpoint cannot be parsed.
        LinkError: the settings demand lockstep on an event loop other than `LockstepEventLoop`.
    """

    def __init__(
        self,
        settings: LinkSettings,
        tap: Tap | None = None,
        opener: OpenTransport = open_transport,
        notice: Notice = _LOG.warning,
    ) -> None:
        endpoint = parse_endpoint(settings.endpoint)
        self._loop = asyncio.get_running_loop()
        self._tasks: list[asyncio.Task[None]] = []
        stats = LinkStats()
        dispatcher, outbox = MessageDispatcher(stats), Outbox(settings, stats, tap)
        self.clock = VehicleClock(lockstep=settings.lockstep)
        super().__init__(settings, outbox, dispatcher, stats, self._loop.time, self.clock)
        self._inbox = (LockstepInbox if settings.lockstep else Inbox)(
            settings, stats, dispatcher, self, tap, notice, self.clock, outbox
        )
        self._lockstep_inbox = self._inbox if isinstance(self._inbox, LockstepInbox) else None
        self.timesync = TimeSync(outbox, dispatcher, self._loop.time, self.clock)
        self._connection = Connection(
            endpoint, self._inbox, outbox, self.stats, self._on_dropped, opener
        )
        self._signing_stamp_writer: StampWriter | None = None
        if settings.signing is not None and settings.signing.file is not None:
            self._signing_stamp_writer = StampWriter(settings.signing, settings.signing.file)

    # --- lifetime

    async def __aenter__(self) -> "Link":
        await self._connection.open()
        try:
            if self._lockstep_inbox is not None:
                await self._wait_for_first_beacon(self._lockstep_inbox)
        except BaseException:
            await self.__aexit__()
            raise
        if self._signing_stamp_writer is not None:
            self._signing_stamp_writer.start()
        self._inbox.report_stamp_remarks()
        self._start_task(self._send_heartbeats())
        self._start_task(self.timesync.run())
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._lockstep_inbox is not None:
            self._lockstep_inbox.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._tasks.clear()
        self._registry.fail("this program closed the link")
        await self._connection.close()
        if self._signing_stamp_writer is not None:
            self._signing_stamp_writer.stop()
        self._inbox.report_stamp_remarks()

    async def wait_connected(self, timeout_s: float) -> Heartbeat:
        """Wait for the autopilot's first heartbeat; return the newest heartbeat.

        Raises:
            LinkTimeout: no heartbeat came; the message says what came instead.
            LinkLost: the connection dropped while waiting.
            UnsupportedAutopilot: this program cannot fly the autopilot.
        """
        with AnswerQueue[None](self._registry) as heartbeats:
            unsubscribe = self._dispatcher.subscribe("HEARTBEAT", lambda _: heartbeats.put(None))
            try:
                async with asyncio.timeout(timeout_s):
                    while self.state.heartbeat is None:
                        await heartbeats.next(timeout_s)
            except TimeoutError:
                raise LinkTimeout(
                    no_heartbeat_message(self.settings, self.stats, timeout_s)
                ) from None
            finally:
                unsubscribe()
        if self.state.unsupported_error is not None:
            raise self.state.unsupported_error
        assert self.state.heartbeat is not None
        return self.state.heartbeat

    @property
    def local_address(self) -> tuple[str, int] | None:
        """(host, port) to which the socket is bound, for UDP and a TCP server; else `None`."""
        return getattr(self._outbox.transport, "local", None)

    # --- control

    def forward(self, frame: bytes) -> bool:
        """Send a whole frame of another node unchanged; return False if it could not be sent."""
        return self._outbox.forward(frame)

    @property
    def on_error(self) -> Callable[[Exception], None] | None:
        """Called with an exception that a callback raised; without it such errors are logged."""
        return self._dispatcher.on_error

    @on_error.setter
    def on_error(self, callback: Callable[[Exception], None] | None) -> None:
        self._dispatcher.on_error = callback

    def send_setpoint(self, time_boot_ms: int, rates: BodyRates, thrust: float) -> bool:
        """Send body rates and thrust once, now, without blocking.

        In lockstep, a setpoint for the sample of the open step is sent when the step is closed.

        Args:
            time_boot_ms: time stamp of the sample to which the setpoint responds, ms.
            rates: rad/s about body x, y, z (FRD).
            thrust: collective thrust, 0..1.

        Returns:
            Whether the setpoint was sent, or in lockstep will be sent; False if the connection is
            down or the kernel refuses it.

        Raises:
            InvalidSetpoint: a value is out of range, or not finite; nothing was sent.
        """
        if (
            self._lockstep_inbox is not None
            and self._lockstep_inbox.open_step_time_ms == time_boot_ms
        ):
            return self._outbox.latch(time_boot_ms, rates, thrust)
        return self._outbox.send_setpoint(time_boot_ms, rates, thrust)

    # --- internal

    def _on_dropped(self, reason: str) -> None:
        self._registry.fail(reason)
        self.timesync.reset()

    def _start_task(self, coroutine: Coroutine[Any, Any, None]) -> None:
        task = self._loop.create_task(coroutine)
        task.add_done_callback(self._report_failure)
        self._tasks.append(task)

    def _report_failure(self, task: asyncio.Task[None]) -> None:
        """Report the failure of a task to `on_error`: the link needs every one of its tasks."""
        error = None if task.cancelled() else task.exception()
        if isinstance(error, Exception):
            self._dispatcher.report(error)

    async def _send_heartbeats(self) -> None:
        """Send heartbeats until cancelled. No setpoint depends on them."""
        while True:
            self._outbox.send_heartbeat()
            await asyncio.sleep(1.0 / self.settings.heartbeat_rate_hz)

    async def _wait_for_first_beacon(self, lockstep_inbox: LockstepInbox) -> None:
        # Some vehicles wait for a first message before they send (udpout, TCP).
        self._outbox.send_heartbeat()
        try:
            async with asyncio.timeout(self.settings.first_beacon_timeout_s):
                await lockstep_inbox.first_beacon
        except TimeoutError:
            raise LinkTimeout(no_beacon_message(self.settings, self.stats)) from None
