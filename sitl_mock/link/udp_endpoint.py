"""A UDP endpoint; it sends to the first client that it hears, as PX4 does."""

import contextlib
import socket

from sitl_mock.config.section import ConfigError

HOST = "127.0.0.1"
MAX_DATAGRAM = 2048
"""Largest datagram that is received, bytes; longer ones are truncated."""


def bound_socket(port: int, option: str) -> socket.socket:
    """Return a non-blocking socket that is bound to a port on this machine.

    Raises:
        ConfigError: there is no such port, or it cannot be bound, for example because it is in use;
            the message names the command-line option of the port.
    """
    udp_socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        udp_socket.bind((HOST, port))
    except OverflowError as error:
        udp_socket.close()
        raise ConfigError(f"there is no UDP port {port}; choose a smaller {option}") from error
    except OSError as error:
        udp_socket.close()
        raise ConfigError(
            f"UDP port {port} on {HOST} cannot be used ({error.strerror}): is another mock running?"
            f" Choose a different {option}"
        ) from error
    udp_socket.setblocking(False)
    return udp_socket


class UdpEndpoint:
    """Sends to ``remote_port`` on this machine until it receives, then to the first sender only.

    The first sender is the partner. The endpoint receives from others, but does not send to them.

    Args:
        local_port: port to bind.
        remote_port: first destination port.
        option: command-line option of the port, for the error message.

    Raises:
        ConfigError: as of `bound_socket`.
    """

    connected = True  # UDP cannot know

    def __init__(self, local_port: int, remote_port: int, option: str) -> None:
        self.socket = bound_socket(local_port, option)
        self.address = f"UDP {HOST}:{local_port}"
        self.descriptors = [self.socket.fileno()]
        self.has_received = False
        self._partner = (HOST, remote_port)

    def receive(self) -> tuple[bytes, bool] | None:
        """Return the next datagram and whether the partner sent it; None if there is none."""
        try:
            datagram, sender = self.socket.recvfrom(MAX_DATAGRAM)
        except OSError:
            return None
        if not self.has_received:
            self.has_received = True
            self._partner = sender
        return datagram, sender == self._partner

    def send(self, datagrams: list[bytes]) -> None:
        """Send to the partner; datagrams that the kernel refuses are dropped."""
        for datagram in datagrams:
            with contextlib.suppress(OSError):
                self.socket.sendto(datagram, self._partner)

    def close(self) -> None:
        """Close the socket."""
        self.socket.close()
