"""Requests to the vehicle: messages, commands, parameters, message rates."""

from collections.abc import Callable, Iterable, Mapping

from companion.mavlink.commands import MAV_CMD_REQUEST_MESSAGE, CommandClient
from companion.mavlink.errors import LinkTimeout, NotConnected
from companion.mavlink.messages import Message, message_id
from companion.mavlink.outbox import Outbox
from companion.mavlink.parameters import ParameterClient
from companion.mavlink.pending import Pending, PendingRegistry
from companion.mavlink.router import Router, Unsubscribe
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats
from companion.mavlink.texts import TextAssembler
from companion.vehicle.autopilot import Autopilot
from companion.vehicle.clock import VehicleClock
from companion.vehicle.registry import read_events
from companion.vehicle.state import VehicleState
from companion.vehicle.streams import StreamRate, measure, set_rates


class VehicleClient:
    """The part of a link that sends requests and subscribes to messages.

    Attributes:
        settings: Where the vehicle is and who we are.
        stats: Counters.
        state: What is known of the vehicle.

    Args:
        settings: As above.
        outbox: Sends the requests.
        router: Brings the messages received.
        stats: As above.
        clock: Event-loop time, s.
        vehicle_clock: Tells how old a position is.
    """

    def __init__(
        self,
        settings: LinkSettings,
        outbox: Outbox,
        router: Router,
        stats: LinkStats,
        clock: Callable[[], float],
        vehicle_clock: VehicleClock,
    ) -> None:
        self.settings, self.stats = settings, stats
        self._outbox, self._router = outbox, router
        self._registry = PendingRegistry()
        texts = TextAssembler()
        self.state = VehicleState(router, stats, texts, clock, vehicle_clock)
        read_events(router, texts, clock)
        self._commands = CommandClient(settings, outbox, router, self._registry, texts)
        self._parameters = ParameterClient(
            settings, outbox, router, self._registry, lambda: self.autopilot.bytewise_parameters
        )

    @property
    def autopilot(self) -> Autopilot:
        """How to speak to this autopilot. Raises `NotConnected` before its first heartbeat."""
        if self.state.autopilot is None:
            raise NotConnected("no heartbeat yet; wait_connected() comes first")
        return self.state.autopilot

    def subscribe(self, name: str, callback: Callable[[Message], None]) -> Unsubscribe:
        """Call `callback` with each message of that name; call the result to end it.

        Raises:
            UnknownMessage: The dialect has no such message.
        """
        return self._router.subscribe(name, callback)

    def send(self, message: Message) -> bool:
        """Send any pymavlink message now; false if it could not leave."""
        return self._outbox.message(message)

    async def command(
        self,
        command: int,
        *params: float,
        timeout_s: float = 1.0,
        retries: int = 3,
    ) -> None:
        """Send a MAV_CMD with up to seven parameters and wait until it is accepted.

        Raises:
            CommandRefused: With the result and the autopilot's own words.
            CommandTimeout: No answer after `retries` repetitions.
            LinkLost: The connection dropped meanwhile.
        """
        await self._commands.send(command, params, timeout_s, retries)

    async def request_message(self, name: str, *, timeout_s: float = 1.0) -> Message:
        """Ask once for a message and return it.

        Raises:
            UnknownMessage: The dialect has no such message.
            CommandRefused: The autopilot does not give it.
            LinkTimeout: It was promised but did not come.
            LinkLost: The connection dropped meanwhile.
        """
        with Pending[Message](self._registry) as answers:
            unsubscribe = self._router.subscribe(name, answers.put)
            try:
                await self.command(MAV_CMD_REQUEST_MESSAGE, float(message_id(name)))
                return await answers.next(timeout_s)
            except TimeoutError:
                raise LinkTimeout(f"{name} was promised but did not come") from None
            finally:
                unsubscribe()

    async def read_parameter(
        self, name: str, *, timeout_s: float = 1.0, retries: int = 3
    ) -> float | int:
        """Read a parameter of the autopilot.

        Raises:
            NotConnected: No heartbeat yet, so its parameter encoding is unknown.
            UnansweredParameter: It never answered; some do not answer for unknown names.
            UnknownParameter: It says that it has none of that name.
            ParameterRefused: It has it, and refuses to send it.
            LinkLost: The connection dropped meanwhile.
        """
        return await self._parameters.read(name, timeout_s, retries)

    async def write_parameter(
        self, name: str, value: float, *, timeout_s: float = 1.0, retries: int = 3
    ) -> float | int:
        """Write a parameter, in its own type, and return what the autopilot then holds.

        Raises:
            NotConnected: No heartbeat yet, so its parameter encoding is unknown.
            UnknownParameter: It has none of that name.
            ParameterRefused: It cannot hold that value, or keeps another.
            LinkLost: The connection dropped meanwhile.
        """
        return await self._parameters.write(name, value, timeout_s, retries)

    async def set_rates(
        self, rates: Mapping[str, float], *, window_s: float = 1.0
    ) -> dict[str, StreamRate]:
        """Ask for message rates in Hz (0 stops one) and count what comes for `window_s`.

        Raises:
            NotConnected: The autopilot was not heard yet.
            UnknownMessage: A name is not in the dialect; nothing was sent then.
            CommandTimeout: The autopilot did not answer a request.
            LinkLost: The connection dropped meanwhile.
        """
        step_us = self.autopilot.interval_step_us
        return await set_rates(self._commands, self.stats, rates, window_s, step_us)

    async def measure_rates(self, names: Iterable[str], window_s: float) -> dict[str, float]:
        """Rates in Hz at which messages arrive, counted over `window_s`."""
        return await measure(self.stats, names, window_s)
