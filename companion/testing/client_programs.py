"""`companion serve` in memory on the vehicle's clock, and client programs."""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

from companion.api.connection import Configuration
from companion.config.files import changed
from companion.mavlink.framing import FrameScanner
from companion.mavlink.messages import Message, dialect
from companion.serve.network.client import Client
from companion.serve.session import ServeSession
from companion.testing.flying import config_in_memory, environment
from companion.testing.vehicle import MockVehicle

_POLL_PERIOD = 0.02
"""Period of the checks while `serving` and `Program.hears` wait, s of vehicle time."""


@asynccontextmanager
async def serving(
    config: Configuration,
    vehicle: MockVehicle,
    folder: Path | None = None,
    on_event: Callable[[str], None] = lambda _: None,
) -> AsyncGenerator[ServeSession, None]:
    """Run `companion serve` between a mock vehicle and client programs, inside `testing.run`.

    `serve.clients`, `link.endpoint` and `realtime` have no effect, and `link.lockstep` is set to
    match the vehicle. Clients connect by `Program(...).connect(session)`.

    Args:
        config: configuration of the vehicle and of `serve`.
        vehicle: vehicle that was passed to `testing.run`.
        folder: gets one folder for each flight under a client's control; None: nothing is
            recorded.
        on_event: called with events as sentences.

    Raises:
        ConfigError: the configuration is wrong.
        EndpointError, LinkError, SigningError: see `ServeSession.run`.
        RuntimeError: the session ended before its network was open.
    """
    served_config = config_in_memory(config, vehicle)
    served_config = changed(served_config, {"serve": {"clients": ()}}, "the test")
    session = ServeSession(served_config, on_event, None, environment, folder)
    session_task = asyncio.ensure_future(session.run())
    try:
        while session.network is None:
            if session_task.done():
                session_task.result()
                raise RuntimeError("the session ended before its network was open")
            await asyncio.sleep(_POLL_PERIOD)
        yield session
    finally:
        session.stop()
        await session_task


class Program(Client):
    """A program that speaks MAVLink to `companion serve`, without a socket.

    Args:
        name: name in messages.
        ids: system and component of the program.
        host: IP address that the program seems to have. With an address outside loopback, the
            program may only read, unless `serve.trusted` names the address or the program signs.

    Attributes:
        heard: received messages, decoded by pymavlink, oldest first.
        packer: pymavlink's encoder, with the program's ids and sequence number.
    """

    def __init__(
        self, name: str = "program", ids: tuple[int, int] = (245, 190), host: str = "127.0.0.1"
    ) -> None:
        super().__init__(name, host=host, streaming=False)
        self.heard: list[Message] = []
        self._session: ServeSession | None = None
        self.packer, self._parser = dialect.MAVLink(None, *ids), dialect.MAVLink(None)
        self._parser.robust_parsing = True

    def connect(self, session: ServeSession) -> "Program":
        """Connect to a session; return the program."""
        assert session.network is not None
        self._session = session
        session.network.attach(self)
        return self

    def disconnect(self) -> None:
        """Break the connection, as if the program were killed."""
        if self._session is not None and self._session.network is not None:
            self._session.network.detach(self)

    def send(self, message: Message) -> None:
        """Send a message under the program's ids.

        Raises:
            RuntimeError: the program is not connected.
        """
        if self._session is None or self._session.network is None:
            raise RuntimeError("the program is not connected; call connect(session) first")
        raw = message.pack(self.packer)
        self.packer.seq = (self.packer.seq + 1) & 0xFF
        frames = FrameScanner(keep_unknown=True).feed(raw)
        self._session.network.receive_frames(self, frames)

    def of(self, name: str) -> list[Message]:
        """The received messages of one type, such as `COMMAND_ACK`."""
        return [each for each in self.heard if each.get_type() == name]

    async def hears(self, name: str, seconds: float = 30.0) -> Message:
        """Wait for the next message of a type.

        Raises:
            TimeoutError: none came within `seconds` of vehicle time.
        """
        count_before = len(self.of(name))
        async with asyncio.timeout(seconds):
            while len(self.of(name)) == count_before:  # noqa: ASYNC110  telemetry sets no events
                await asyncio.sleep(_POLL_PERIOD)
        return self.of(name)[count_before]

    def _flush(self) -> None:
        """Decode all frames that are queued for this program."""
        while self._queued_frames:
            data, _ = self._dequeue(100_000)
            self.heard += self._parser.parse_buffer(data) or ()
