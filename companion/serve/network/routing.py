"""Decides where a frame goes, by targets and learned addresses (MAVLink guide, "Routing").

Nothing here sends: frames are only queued at the channels. Time comes only from the given clock.
"""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from companion.mavlink.framing import Frame
from companion.serve.network.addresses import EVERYBODY, Address, source_of, target_of
from companion.serve.network.client import Client
from companion.serve.network.uplink import UplinkQueue

_REPETITION_TIME = 0.2
"""Time within which a frame identical to a forwarded one is a repetition, s."""
_MAX_REMEMBERED_FRAMES = 4096
"""Largest number of remembered frames; in a flood, only the newest are remembered."""
_MAX_ADDRESSES = 1024
"""Largest number of addresses that are learned on one channel; all are searched for each frame."""

Intercept = Callable[[Client, Frame], bool]
"""Called with a client's frame before forwarding; returns True if it must not be forwarded."""


@dataclass
class RoutingStats:
    """Counters of forwarded and dropped frames."""

    to_clients: int = 0
    """Frames of the vehicle that were queued for clients; a frame for two clients counts twice."""
    to_vehicle: int = 0
    """Clients' frames that were queued for the vehicle."""
    between_clients: int = 0
    """Clients' frames that were queued for other clients."""
    looped: int = 0
    """Frames of clients and of other components that were dropped, because they were repetitions,
    came from a client that had gone, or named our component or the autopilot as their sender."""
    no_route: int = 0
    """Frames dropped because their target was never heard."""


class Routing:
    """Forwards each frame, byte for byte, to the channels that should hear it.

    - A frame without a target, or for everybody, goes to all channels except the one it came from.
    - A targeted frame goes to the channels on which its target was heard. A client's frame for a
      never-heard component of the vehicle's system goes to the vehicle.
    - A frame for our own component is not forwarded.
    - A message of unknown id, whose target is unknown, goes to all channels except the one it came
      from.

    Several nodes may be behind one channel, also behind the channel to the vehicle.

    Attributes:
        stats: counters of frames.
        clients: the clients, in the order of `attach`.
        intercept: see `Intercept`. Until it is set, no frame of a client is forwarded.
        on_our_ids_used: called with a client whose frame names our component as its sender.
        on_own_frame: called with each client's frame for our component; None: it is dropped.
    """

    def __init__(
        self,
        vehicle: UplinkQueue,
        autopilot: Address,
        our_address: Address,
        clock: Callable[[], float],
    ) -> None:
        self.stats = RoutingStats()
        self.intercept: Intercept = lambda *_: True
        self.on_our_ids_used: Callable[[Client], None] = lambda _: None
        self.on_own_frame: Callable[[Client, Frame], None] | None = None
        self._vehicle, self._autopilot, self._our_address = vehicle, autopilot, our_address
        self._heard_addresses: dict[Client | UplinkQueue, set[Address]] = {vehicle: {autopilot}}
        self.clients: tuple[Client, ...] = ()
        self._repeat_detector = _RepeatDetector(clock)

    def attach(self, client: Client) -> None:
        """Add a client; frames are forwarded to it from now on."""
        self._heard_addresses[client] = set()
        self.clients = (*self.clients, client)

    def detach(self, client: Client) -> None:
        """Remove a client and the addresses heard on its channel."""
        self._heard_addresses.pop(client, None)
        self.clients = tuple(each for each in self.clients if each is not client)

    def is_at_client(self, target: Address, origin: Client) -> bool:
        """Whether a target was heard on the channel of a client other than `origin`."""
        return any(self._reaches(each, target) for each in self.clients if each is not origin)

    def forward_from_vehicle(self, frame: Frame) -> None:
        """Forward a frame that came over the link to the vehicle."""
        source = source_of(frame)
        if source != self._autopilot:  # another component, or a station behind the autopilot
            if source == self._our_address or self._repeat_detector.is_repeat(frame.raw):
                self.stats.looped += 1
                return
            self._learn(self._vehicle, source)
        target = target_of(frame)
        if target == EVERYBODY:
            receivers = self.clients
        elif target == self._our_address:
            return
        else:
            receivers = tuple(each for each in self.clients if self._reaches(each, target))
            self.stats.no_route += not receivers
        self.stats.to_clients += len(receivers)
        for client in receivers:
            client.put(frame.raw)

    def forward_from_client(self, client: Client, frame: Frame) -> None:
        """Forward a client's frame, unless it is looped, for our component, or intercepted.

        A looped frame (`RoutingStats`) is dropped. A frame for our component goes to
        `on_own_frame`.
        """
        source = source_of(frame)
        if (
            source in (self._autopilot, self._our_address)
            or client not in self._heard_addresses
            or self._repeat_detector.is_repeat(frame.raw)
        ):
            self.stats.looped += 1
            # A client that only sends our own frame back does not use our ids itself.
            if source == self._our_address and not self._repeat_detector.is_repeat(frame.raw):
                self.on_our_ids_used(client)
            return
        if source.system != 0:
            self._learn(client, source)
        target = target_of(frame)
        if target == self._our_address:
            if self.on_own_frame is not None:
                self.on_own_frame(client, frame)
            return
        if self.intercept(client, frame):
            return
        self._forward(client, frame.raw, target)

    def send_to_clients(self, frame: bytes) -> None:
        """Send a frame of our own component to every client."""
        for client in self.clients:
            self.send_to_client(client, frame)

    def send_to_client(self, client: Client, frame: bytes) -> None:
        """Send a frame of our own component to one client."""
        self._repeat_detector.is_repeat(frame)  # remembers the frame, so that its echo is dropped
        client.put(frame)

    def _learn(self, channel: Client | UplinkQueue, source: Address) -> None:
        if len(self._heard_addresses[channel]) < _MAX_ADDRESSES:
            self._heard_addresses[channel].add(source)

    def _forward(self, origin: Client, raw: bytes, target: Address) -> None:
        other_clients = [each for each in self.clients if each is not origin]
        if target != EVERYBODY:
            other_clients = [each for each in other_clients if self._reaches(each, target)]
        if self._is_behind_vehicle(target, known_to_client=bool(other_clients)):
            self.stats.to_vehicle += 1
            self._vehicle.put(raw, origin)
        elif not other_clients:
            self.stats.no_route += 1
        self.stats.between_clients += len(other_clients)
        for each in other_clients:
            each.put(raw)

    def _is_behind_vehicle(self, target: Address, *, known_to_client: bool) -> bool:
        if target.system in (0, self._autopilot.system) and target.component == 0:
            return True
        if self._reaches(self._vehicle, target):
            return True
        return target.system == self._autopilot.system and not known_to_client

    def _reaches(self, channel: Client | UplinkQueue, target: Address) -> bool:
        addresses = self._heard_addresses.get(channel, ())
        if target.system == 0:
            return True
        if target.component == 0:
            return any(each.system == target.system for each in addresses)
        return target in addresses


class _RepeatDetector:
    """Detects frames that have come before, on any channel.

    Sequence number and checksum distinguish a frame from its sender's next 255 frames. If a sender
    never increases its sequence number, equal frames are forwarded only once in 0.2 s.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._forwarded_at: OrderedDict[bytes, float] = OrderedDict()

    def is_repeat(self, raw: bytes) -> bool:
        """Whether the frame `raw` was forwarded within `_REPETITION_TIME`; if not, remember it."""
        now, forwarded_at = self._clock(), self._forwarded_at
        previous = forwarded_at.pop(raw, None)
        if previous is not None and now - previous <= _REPETITION_TIME:
            forwarded_at[raw] = previous
            return True
        forwarded_at[raw] = now
        while len(forwarded_at) > _MAX_REMEMBERED_FRAMES:
            forwarded_at.popitem(last=False)
        return False
