"""What a flight uses of the computer that it runs on; tests replace it."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter_ns

from companion.mavlink.transport.opening import OpenTransport, open_transport
from companion.recording.mcap_file.batch import SendBatch


@dataclass(frozen=True, slots=True)
class Environment:
    """What a flight uses of its computer: sockets, clock, settings of the operating system.

    The defaults are those of a real flight. `companion.testing` replaces all of them: its flights
    use no sockets and no wall clock.

    Attributes:
        open_transport: opens the link's transport.
        clock_ns: clock for latencies and for the arrival stamps of transports, ns.
        realtime: True: real time, and the section `realtime` is requested from the operating
            system. False: a virtual clock.
        stream: takes the messages that the flight records, in batches, in the recording thread;
            None: nothing does.
    """

    open_transport: OpenTransport = open_transport
    clock_ns: Callable[[], int] = perf_counter_ns
    realtime: bool = True
    stream: SendBatch | None = None


THIS_COMPUTER = Environment()
