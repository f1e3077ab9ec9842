"""What a flight gets from the computer that it runs on; tests give it something else."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter_ns

from companion.mavlink.transport.opening import OpenTransport, open_transport


@dataclass(frozen=True, slots=True)
class Environment:
    """The surroundings of a flight. The defaults are the real ones.

    `companion.testing` replaces all of them: its flights use no sockets and no wall clock.

    Attributes:
        open_transport: opens the link's transport.
        clock_ns: measures latencies; transports stamp arrivals by the same clock, ns.
        realtime: whether the section `realtime` is requested from the operating system.
    """

    open_transport: OpenTransport = open_transport
    clock_ns: Callable[[], int] = perf_counter_ns
    realtime: bool = True


THIS_COMPUTER = Environment()
