"""The datagrams that one vehicle receives and sends, with the faults of its companion link.

`Exchange` has no sockets and no clock. `Server` joins it to sockets, `companion.testing` to a
program in the same process. A slot is one cycle of the autopilot, in which it can send. In each
slot both call `step` and send `take_outgoing` of each link. In lockstep they pass the datagrams
that arrived since the last slot to `step`; in real time they `deliver` each one as it arrives.
"""

from collections.abc import Callable
from math import ceil

from sitl_mock.link.endpoint import joined_datagrams
from sitl_mock.link.framing import Message, decode
from sitl_mock.link.link import Link
from sitl_mock.link.pipe import DatagramPipe
from sitl_mock.settings import MockSettings
from sitl_mock.simulation import Simulation

ReceivedDatagram = tuple[bytes, list[Message]]
"""A datagram and the messages in it."""

_ANSWER_MESSAGES = frozenset({"SET_ATTITUDE_TARGET", "SYSTEM_TIME"})
"""Messages that answer a lockstep beacon."""


def burst_time(elapsed_s: float, burst_s: float) -> float:
    """Return the time of the burst in which the step at ``elapsed_s`` runs, s.

    Args:
        elapsed_s: time of the step, s.
        burst_s: period of the bursts, s; 0 = no bursts: the step runs at its own time.
    """
    return ceil(elapsed_s / burst_s) * burst_s if burst_s > 0.0 else elapsed_s


class Exchange:
    """Passes datagrams to the autopilot, and takes those that it sends.

    Attributes:
        on_message: called with each message that arrives over the companion link after the faults,
            also if the autopilot does not accept it.
    """

    def __init__(self, settings: MockSettings, simulation: Simulation) -> None:
        self.on_message: Callable[[Message], None] | None = None
        self._simulation = simulation
        self._companion_link = simulation.companion
        self._pipe_in = DatagramPipe("from_companion", 2 * settings.seed)
        self._pipe_out = DatagramPipe("to_companion", 2 * settings.seed + 1)
        self._in_lockstep = settings.lockstep.enabled
        self._bundles_frames = settings.lockstep.enabled and settings.lockstep.bundle

    def step(self, datagrams: list[ReceivedDatagram]) -> bytes | None:
        """Handle the datagrams that arrived on the companion link, and simulate one slot.

        Returns:
            the lockstep beacon of the new slot, unsigned; None without lockstep.
        """
        self.deliver(datagrams, self._companion_link)
        self._simulation.tick()
        return self._simulation.beacon() if self._in_lockstep else None

    def deliver(self, datagrams: list[ReceivedDatagram], link: Link) -> None:
        """Pass datagrams of a link to the autopilot; the companion's go through the link faults."""
        simulation = self._simulation
        faults = simulation.faults.link_faults
        if link is self._companion_link and not self._pipe_in.passes_unchanged(faults):
            arrived_bytes = [datagram for datagram, _ in datagrams]
            passed_bytes = self._pipe_in.push(arrived_bytes, faults, simulation.time_us)
            datagrams = [(datagram, decode(datagram)) for datagram in passed_bytes]
        on_message = self.on_message if link is self._companion_link else None
        for _, messages in datagrams:
            for message in messages:
                if on_message is not None:
                    on_message(message)
                simulation.handle(message, link)

    def take_outgoing(self, link: Link, beacon: bytes | None = None) -> list[bytes]:
        """Return the datagrams that a link has queued; the beacon, if any, comes last.

        The faults of the companion link apply to all but the beacon.
        """
        frames = link.take_frames()
        faults = self._simulation.faults.link_faults
        if link is self._companion_link and not self._pipe_out.passes_unchanged(faults):
            frames = self._pipe_out.push(frames, faults, self._simulation.time_us)
        if beacon is not None:
            frames.append(link.sign(beacon))
        return joined_datagrams(frames) if self._bundles_frames else frames

    def answers_beacon(self, messages: list[Message]) -> bool:
        """Whether one of these messages answers the latest lockstep beacon."""
        now_ms = self._simulation.time_us // 1000
        return any(
            message.get_type() in _ANSWER_MESSAGES and message.time_boot_ms == now_ms
            for message in messages
        )

    def repeats_answer(self, messages: list[Message]) -> bool:
        """Whether a datagram is only a repeated answer to an earlier beacon.

        The companion answers a beacon twice if the server sent the beacon twice, which depends on
        the wall clock. The link faults draw a random number for each datagram. With the repeated
        answer, these random numbers would depend on the wall clock.
        """
        now_ms = self._simulation.time_us // 1000
        return (
            len(messages) == 1
            and messages[0].get_type() == "SYSTEM_TIME"
            and messages[0].time_boot_ms != now_ms
        )
