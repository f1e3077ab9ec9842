"""A UDP socket of the mock, with PX4's rule about whom it talks to."""

import contextlib
import socket

from sitl_mock.config.section import ConfigError

HOST = "127.0.0.1"
_MAX_DATAGRAM = 2048


class UdpEndpoint:
    """Sends to ``remote_port`` on this machine until somebody speaks, then there for good.

    A second sender is heard but gets nothing.

    Args:
        local_port: to bind.
        remote_port: to send to from the start; None = nobody until somebody speaks.
        option: the command-line option that changes the port, for the error message.

    Raises:
        ConfigError: the local port is in use.
    """

    def __init__(self, local_port: int, remote_port: int | None, option: str) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self.socket.bind((HOST, local_port))
        except OSError as error:
            self.socket.close()
            raise ConfigError(
                f"UDP port {local_port} on {HOST} cannot be used ({error.strerror}): is another"
                f" mock running? Choose a different {option}"
            ) from error
        self.socket.setblocking(False)
        self.where = f"UDP {HOST}:{local_port}"
        self.heard = False
        self._partner = None if remote_port is None else (HOST, remote_port)

    @property
    def connected(self) -> bool:
        """UDP cannot know, so yes."""
        return True

    @property
    def readable(self) -> list[int]:
        """The socket."""
        return [self.socket.fileno()]

    def receive(self) -> tuple[bytes, bool] | None:
        """Return the next datagram and whether the partner sent it; None if there is none."""
        try:
            datagram, sender = self.socket.recvfrom(_MAX_DATAGRAM)
        except OSError:
            return None
        if not self.heard:
            self.heard = True
            self._partner = sender
        return datagram, sender == self._partner

    def receive_from(self) -> tuple[bytes, tuple[str, int]] | None:
        """Return the next datagram and its sender, without taking anyone as partner."""
        try:
            return self.socket.recvfrom(_MAX_DATAGRAM)
        except OSError:
            return None

    def send_to(self, datagram: bytes, address: tuple[str, int]) -> None:
        """Send one datagram to an address."""
        with contextlib.suppress(OSError):
            self.socket.sendto(datagram, address)

    def send(self, datagrams: list[bytes]) -> None:
        """Send to the partner; what the network refuses is lost, as on any bad link."""
        if self._partner is None:
            return
        for datagram in datagrams:
            with contextlib.suppress(OSError):
                self.socket.sendto(datagram, self._partner)

    def close(self) -> None:
        """Close the socket."""
        self.socket.close()
