"""A port of this computer that no program uses."""

import itertools
import os
import socket

from companion.mavlink.errors import LinkError

_FIRST_PORT, _PORT_COUNT = 20_000, 12_000
"""First port that is tried, and number of ports. All are below 32768, because from there on Linux
assigns ports to sockets that ask for any.
"""

_PORTS_PER_PROCESS = 50
"""Processes with neighboring process ids start this many ports apart."""

_counter = itertools.count()


def free_port(*offsets: int) -> int:
    """Find a port for UDP and TCP that is free on 127.0.0.1.

    The port numbers larger by each of the `offsets` are free, too.

    Another program could open the port before the caller does. So a process gets the same port
    again only after all others, and processes with neighboring process ids begin 50 ports apart.

    Raises:
        LinkError: all ports are in use.
    """
    for number in itertools.islice(_counter, _PORT_COUNT):
        port = _FIRST_PORT + (os.getpid() * _PORTS_PER_PROCESS + number) % _PORT_COUNT
        if all(_is_free(port + offset) for offset in (0, *offsets)):
            return port
    raise LinkError(f"all ports from {_FIRST_PORT} to {_FIRST_PORT + _PORT_COUNT - 1} are in use")


def _is_free(port: int) -> bool:
    for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM):
        with socket.socket(socket.AF_INET, kind) as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                return False
    return True
