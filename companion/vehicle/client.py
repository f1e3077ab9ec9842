"""Requests to the vehicle: messages, commands, parameters, message rates."""

from collections.abc import Callable, Iterable, Mapping

from companion.mavlink.commands import CommandClient
from companion.mavlink.dispatcher import MessageDispatcher, Unsubscribe
from companion.mavlink.errors import LinkTimeout, NotConnected
from companion.mavlink.messages import Message, dialect, message_id
from companion.mavlink.outbox import Outbox
from companion.mavlink.parameters import ParameterClient
from companion.mavlink.pending import AnswerQueue, AnswerQueueRegistry
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats
from companion.mavlink.texts import TextAssembler
from companion.vehicle.autopilot import Autopilot
from companion.vehicle.clock import VehicleClock
from companion.vehicle.registry import read_events
from companion.vehicle.state import VehicleState
from companion.vehicle.streams import StreamRate, measure_rates, set_rates


class VehicleClient:
    """The part of a link that sends requests and subscribes to messages.

    Args:
        clock: returns the event-loop time, s.
        vehicle_clock: converts the time stamps of positions.

    Attributes:
        settings: settings of the link.
        stats: counters of the link.
        state: the vehicle's telemetry.
    """

    def __init__(
        self,
        settings: LinkSettings,
        outbox: Outbox,
        dispatcher: MessageDispatcher,
        stats: LinkStats,
        clock: Callable[[], float],
        vehicle_clock: VehicleClock,
    ) -> None:
        self.settings, self.stats = settings, stats
        self._outbox, self._dispatcher = outbox, dispatcher
        self._registry = AnswerQueueRegistry()
        texts = TextAssembler()
        self.state = VehicleState(dispatcher, stats, texts, clock, vehicle_clock)
        read_events(dispatcher, texts, clock)
        self._commands = CommandClient(settings, outbox, dispatcher, self._registry, texts)
        self._parameters = ParameterClient(
            settings, outbox, dispatcher, self._registry, lambda: self.autopilot.bytewise_parameters
        )

    @property
    def autopilot(self) -> Autopilot:
        """The vehicle's autopilot.

        Raises:
            NotConnected: no heartbeat of an autopilot that this program flies has come yet.
        """
        if self.state.autopilot is None:
            raise NotConnected("no heartbeat yet; call wait_connected() first")
        return self.state.autopilot

    def subscribe(self, name: str, callback: Callable[[Message], None]) -> Unsubscribe:
        """Call `callback` with each message of that name; return a function to unsubscribe.

        Raises:
            UnknownMessage: the dialect has no such message.
        """
        return self._dispatcher.subscribe(name, callback)

    def send(self, message: Message) -> bool:
        """Send a pymavlink message now; return False if it could not be sent."""
        return self._outbox.send(message)

    async def command(
        self, command: int, *params: float, timeout_s: float = 1.0, retries: int = 3
    ) -> None:
        """Send a MAV_CMD with up to seven parameters and wait until it is accepted.

        Raises:
            CommandRefused: the autopilot refused; the error has the MAV_RESULT and the texts.
            CommandTimeout: no answer came after `retries` repetitions.
            LinkLost: the connection dropped while waiting.
        """
        await self._commands.send(command, params, timeout_s, retries)

    async def request_message(self, name: str, *, timeout_s: float = 1.0) -> Message:
        """Request one message and return it.

        Raises:
            UnknownMessage: the dialect has no such message.
            CommandRefused: the autopilot refused the request.
            CommandTimeout: the autopilot did not answer the request.
            LinkTimeout: the autopilot accepted the request, but the message did not come.
            LinkLost: the connection dropped while waiting.
        """
        with AnswerQueue[Message](self._registry) as answers:
            unsubscribe = self._dispatcher.subscribe(name, answers.put)
            try:
                await self.command(dialect.MAV_CMD_REQUEST_MESSAGE, float(message_id(name)))
                return await answers.next(timeout_s)
            except TimeoutError:
                raise LinkTimeout(
                    f"{name} did not come within {timeout_s:g} s, although the autopilot accepted "
                    "the request"
                ) from None
            finally:
                unsubscribe()

    async def read_parameter(
        self, name: str, *, timeout_s: float = 1.0, retries: int = 3
    ) -> float | int:
        """Read a parameter of the autopilot.

        Raises:
            NotConnected: no heartbeat has come yet, so the encoding of parameters is unknown.
            UnansweredParameter: no answer came; some autopilots do not answer for unknown names.
            UnknownParameter: the autopilot answered that it has no such parameter, or the name is
                not 1 to 16 ASCII characters.
            ParameterRefused: the autopilot answered with another error.
            LinkLost: the connection dropped while waiting.
        """
        return await self._parameters.read(name, timeout_s, retries)

    def subscribe_parameters(self, callback: Callable[[str, float | int], None]) -> Unsubscribe:
        """Call `callback` with name and value of each parameter that the autopilot reports.

        The autopilot also reports parameters that another station reads or changes.
        """

        def on_payload(payload: bytes) -> None:
            if self.state.autopilot is not None:  # else the encoding is unknown
                callback(*self._parameters.value_in(payload))

        return self._dispatcher.subscribe_raw("PARAM_VALUE", on_payload)

    async def write_parameter(
        self, name: str, value: float, *, timeout_s: float = 1.0, retries: int = 3
    ) -> float | int:
        """Write a parameter in its own type, and return the value that it then has.

        Raises:
            NotConnected: no heartbeat has come yet, so the encoding of parameters is unknown.
            UnansweredParameter, UnknownParameter: as for `read_parameter`.
            ParameterRefused: the value does not fit the type, or the autopilot keeps another value
                or answered with an error.
            LinkLost: the connection dropped while waiting.
        """
        return await self._parameters.write(name, value, timeout_s, retries)

    async def set_rates(
        self, rates: Mapping[str, float], *, window_s: float = 1.0
    ) -> dict[str, StreamRate]:
        """Request message rates in Hz (0 stops a message), then count arrivals for `window_s`.

        Raises:
            NotConnected: no heartbeat has come yet.
            UnknownMessage: a name is not in the dialect; nothing was sent.
            CommandTimeout: the autopilot did not answer a request.
            LinkLost: the connection dropped while waiting.
        """
        interval_step_us = self.autopilot.interval_step_us
        return await set_rates(self._commands, self.stats, rates, window_s, interval_step_us)

    async def measure_rates(self, names: Iterable[str], window_s: float) -> dict[str, float]:
        """Rates in Hz at which messages arrive, counted over `window_s`.

        Raises:
            UnknownMessage: a name is not in the dialect.
        """
        return await measure_rates(self.stats, names, window_s)
