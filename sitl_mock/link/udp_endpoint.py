"""A UDP endpoint; it sends to the first client that it hears, as PX4 does."""

import contextlib
import socket

from sitl_mock.config.section import ConfigError

HOST = "127.0.0.1"
_MAX_DATAGRAM = 2048


class UdpEndpoint:
    """Sends to ``remote_port`` on this machine until it receives, then to the first sender only.

    It receives from other senders, but does not send to them.

    Args:
        local_port: port to bind.
        remote_port: first destination port; None = send nothing before something is received.
        option: command-line option of the port, for the error message.

    Raises:
        ConfigError: there is no such local port, or it cannot be bound, for example because it is
            in use.
    """

    def __init__(self, local_port: int, remote_port: int | None, option: str) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self.socket.bind((HOST, local_port))
        except OverflowError as error:
            self.socket.close()
            raise ConfigError(
                f"there is no UDP port {local_port}; choose a smaller {option}"
            ) from error
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
        """Always True: UDP cannot know."""
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
        """Return the next datagram and its sender; the partner stays unchanged."""
        try:
            return self.socket.recvfrom(_MAX_DATAGRAM)
        except OSError:
            return None

    def send_to(self, datagram: bytes, address: tuple[str, int]) -> None:
        """Send one datagram to an address."""
        with contextlib.suppress(OSError):
            self.socket.sendto(datagram, address)

    def send(self, datagrams: list[bytes]) -> None:
        """Send to the partner; datagrams that the kernel refuses are dropped."""
        if self._partner is None:
            return
        for datagram in datagrams:
            with contextlib.suppress(OSError):
                self.socket.sendto(datagram, self._partner)

    def close(self) -> None:
        """Close the socket."""
        self.socket.close()
