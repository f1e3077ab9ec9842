"""A session of `companion serve`: the link, the clients, and our component between them."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion import realtime
from companion.config import Config
from companion.flight.changes import Changes
from companion.flight.context import cancel
from companion.flight.environment import THIS_COMPUTER, Environment
from companion.flight.observer import Observer, SilentObserver
from companion.flight.opening import make_link, realtime_settings
from companion.flight.wiring import StateLogger
from companion.mavlink.errors import LinkError
from companion.mavlink.framing import Frame
from companion.mavlink.peer import HEARTBEAT
from companion.serve.component import Component
from companion.serve.flight_records import FlightRecords
from companion.serve.network.addresses import target_of
from companion.serve.network.client import Client
from companion.serve.network.network import Network
from companion.serve.network.permission import Permission
from companion.serve.network.routing import Routing
from companion.serve.setpoints.decoding import SETPOINT_IDS
from companion.serve.vehicle_pose import PoseTracker
from companion.vehicle.link import Link

if TYPE_CHECKING:
    from companion.serve.control import ServedControl
    from companion.serve.flights import ServedFlights


class ServeSession:
    """Forwards frames between the vehicle and the clients, and flies the clients' setpoints.

    Signal handlers of the event loop may call `stop` and `leave`.

    Args:
        note: called with each event, as a sentence for the user.
        observer: receives phases and events of each flight under a client's control.
        environment: clocks and transports of this computer, or their replacement in tests.
        directory: folder for the folders of flights under a client's control; None: nothing is
            recorded.

    Attributes:
        changes: applies changes of configuration values in flight, for the next flights too.
        network: network of the clients, once it is open.
        flights: flights under a client's control, once the link is open, if `serve.control` is
            true.
        records: records of the flights under a client's control.
    """

    def __init__(
        self,
        config: Config,
        note: Callable[[str], None],
        observer: Observer | None = None,
        environment: Environment = THIS_COMPUTER,
        directory: Path | None = None,
    ) -> None:
        self._config, self._note = config, note
        self.records = FlightRecords(directory, environment, note)
        self._observer, self._environment = observer or SilentObserver(), environment
        self.changes = Changes(config)
        self.changes.note = note
        self._stop = asyncio.Event()
        self.network: Network | None = None
        self.flights: ServedFlights | None = None

    def stop(self) -> None:
        """End the session; a vehicle under control is handed back first."""
        self._stop.set()

    def leave(self) -> None:
        """Stop sending setpoints at once, and end the session."""
        if self.flights is not None:
            self.flights.leave()
        self._stop.set()

    async def run(self) -> dict[str, Any]:
        """Serve until `stop`; return the counters.

        Raises:
            EndpointError: the link or an endpoint of `serve.clients` could not be opened.
            LinkError: the link cannot do what the configuration demands.
            RealtimeError: the system refused a required `realtime` setting.
            SigningError: the key cannot be used.
        """
        config, opener = self._config, self._environment.open_transport
        settings = realtime_settings(config, self._environment)
        with realtime.request_settings(settings) as realtime_results:
            self.records.realtime_results = realtime_results
            for result in realtime_results:
                self._note(str(result))
            async with make_link(config, self.records, self._note, opener) as link:
                self._log_state(link)
                link.clock.on_event = self._note
                async with Network(link, config.serve.clients, self._note) as network:
                    return await self._serve(link, network)

    def _log_state(self, link: Link) -> None:
        """Note changes of the vehicle's state, except in a flight, which notes them itself."""

        def note(text: str) -> None:
            if link.on_attitude is None:
                self._note(text)

        state_logger = StateLogger(link.state, note)
        for name in ("HEARTBEAT", "CURRENT_MODE", "STATUSTEXT"):  # the same as in a flight
            link.subscribe(name, lambda _: state_logger.log_changes())

    async def _serve(self, link: Link, network: Network) -> dict[str, Any]:
        component = Component(link.settings, network, link.send)
        permission = Permission(self._config.serve.trusted, link.settings.signing)
        background: list[Coroutine[Any, Any, None]] = [component.run(), self._tell_silence(link)]
        control = None
        if self._config.serve.control:
            pose_tracker = PoseTracker(link, network)
            control = self._make_control(link, component, pose_tracker)
            network.setpoint_ids = SETPOINT_IDS
            background.append(pose_tracker.keep_telemetry(self._config))
        interceptor = _FrameInterceptor(
            permission, component, control, network.routing, link.settings.target_system
        )
        network.routing.on_own_frame = interceptor.on_own_frame
        network.routing.intercept = interceptor.intercept
        for endpoint in self._config.serve.clients:
            self._note(f"clients at {endpoint}")
        self.network = network
        tasks = [asyncio.create_task(each) for each in background]
        try:
            await self._stop.wait()
        finally:
            if self.flights is not None:
                await self.flights.close("companion serve is stopped")
            for task in tasks:
                await cancel(task)
        return _counters(link, network)

    def _make_control(
        self, link: Link, component: Component, pose_tracker: PoseTracker
    ) -> "ServedControl":
        """Make the handlers of setpoints and commands; set `flights`."""
        from companion.serve.control import ServedControl  # noqa: PLC0415  needs the extra
        from companion.serve.flights import ServedFlights  # noqa: PLC0415  the same
        from companion.serve.served_flight import ServedVehicle  # noqa: PLC0415  the same

        vehicle = ServedVehicle(
            self._config,
            link,
            component,
            self._observer,
            self._environment,
            self.records,
            self.changes,
        )
        self.flights = ServedFlights(vehicle)
        return ServedControl(self._config, link, component, pose_tracker, self.flights)

    async def _tell_silence(self, link: Link) -> None:
        """Say once that no vehicle is heard; clients are served nevertheless."""
        try:
            await link.wait_connected(self._config.flight.connect_timeout_s)
        except LinkError as error:
            self._note(f"{error} (still waiting for the vehicle; clients are served)")


@dataclass(eq=False)
class _FrameInterceptor:
    """Refuses frames that a client may not send, and passes setpoints to `ServedControl`."""

    _permission: Permission
    _component: Component
    _control: "ServedControl | None"
    _routing: Routing
    _system: int

    def intercept(self, client: Client, frame: Frame) -> bool:
        """Whether a frame was refused or handled here, and so must not be forwarded."""
        refusal = self._permission.refusal(client, frame)
        if refusal is not None:
            if frame.message_id != HEARTBEAT:  # every client sends heartbeats; no answer is due
                self._component.answer(client, refusal)
            return True
        if self._control is None:
            return False
        target = target_of(frame)
        for_another_system = target.system not in (0, self._system)
        target_is_client = self._routing.is_at_client(target, client)
        # A setpoint for another system would reach the vehicle, which may obey it.
        if for_another_system and (target_is_client or frame.message_id not in SETPOINT_IDS):
            return False
        return self._control.intercept(client, frame)

    def on_own_frame(self, client: Client, frame: Frame) -> None:
        """Take a frame addressed only to our component: fly a setpoint, refuse a command."""
        if frame.message_id not in SETPOINT_IDS or not self.intercept(client, frame):
            self._component.on_own_frame(client, frame)


def _counters(link: Link, network: Network) -> dict[str, Any]:
    """The counters for `serve --json`."""
    stats = asdict(link.stats)
    return {
        "routing": asdict(network.routing.stats),
        "uplink": {"sent": network.uplink.sent, "dropped": network.uplink.dropped},
        "overflowed": network.overflowed,
        "clients": {client.name: asdict(client.stats) for client in network.clients},
        "link": {name: value for name, value in stats.items() if isinstance(value, int)},
    }
