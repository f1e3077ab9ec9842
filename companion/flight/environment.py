"""The parts of the computer that a flight uses; tests replace them."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter_ns

from companion.mavlink.transport.opening import OpenTransport, open_transport
from companion.recording.mcap_file.batch import SendBatch


@dataclass(frozen=True, slots=True)
class Environment:
    """The parts of the computer that a flight uses: sockets, clock, operating system.

    The defaults are those of a real flight. `companion.testing` replaces all of them: its flights
    use no sockets and no wall clock.
    """

    open_transport: OpenTransport = open_transport
    """Opens the link's transport."""
    clock_ns: Callable[[], int] = perf_counter_ns
    """Clock for latencies and for the arrival stamps of transports, ns."""
    realtime: bool = True
    """Whether the flight runs in real time, and requests the settings of section `realtime` from
    the operating system. False: a virtual clock."""
    send_batch: SendBatch | None = None
    """Sends recorded messages to the live stream, in the recording thread; None: no stream."""


THIS_COMPUTER = Environment()
