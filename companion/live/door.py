"""Where the live page is served: address, port and token."""

import secrets
import socket
import time
from ipaddress import ip_address
from typing import NamedTuple

from companion.files.yaml_file import ConfigError

PORT = 8090
_GIVES_WAY = 8.0
"""Time allowed for the page of an ended flight to leave its port, s."""


class Door(NamedTuple):
    """A listening socket, and who may come in.

    Attributes:
        host: IP address that it listens at.
        port: its number.
        token: must be given by those who change something, and by those who watch from another
            computer.
        listening: the socket.
    """

    host: str
    port: int
    token: str
    listening: socket.socket

    def words(self) -> str:
        """Where the page is, for the user."""
        shown = self.host if ip_address(self.host) not in _ANY else socket.gethostname()
        shown = f"[{shown}]" if ":" in shown else shown
        if ip_address(self.host).is_loopback:
            return (
                f"Live page: http://{shown}:{self.port}/  token to change values there: "
                f"{self.token}"
            )
        return f"Live page: http://{shown}:{self.port}/?token={self.token}"


_ANY = (ip_address("0.0.0.0"), ip_address("::"))


def open_door(address: str) -> Door:
    """Listen at [HOST][:PORT]; by default at port 8090 of this computer only.

    Raises:
        ConfigError: this is no address, or the port is in use.
    """
    host, port = _parts(address)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        _bind(listening, host, port)
    except OSError as error:
        listening.close()
        raise ConfigError(
            f"--live: cannot listen at port {port} of {host}: {error.strerror}; name another "
            f"one, as --live {port + 1}"
        ) from error
    listening.listen(50)
    return Door(host, listening.getsockname()[1], secrets.token_urlsafe(9), listening)


def _parts(address: str) -> tuple[str, int]:
    """Host and port of an address.

    Raises:
        ConfigError: this is no address.
    """
    host, colon, port = address.rpartition(":")
    if not colon and not address.isdigit():
        host, port = address, str(PORT)
    host = host.strip("[]") or "127.0.0.1"
    host = "127.0.0.1" if host == "localhost" else host
    try:
        number = int(port)
        ip_address(host)
    except ValueError as error:
        raise ConfigError(
            f"--live {address}: write an IP address, a port, or both, as 0.0.0.0:{PORT}"
        ) from error
    if not 0 <= number <= 65535:
        raise ConfigError(f"--live {address}: a port is at most 65535")
    return host, number


def _bind(listening: socket.socket, host: str, port: int) -> None:
    """Bind; the page of an ended flight gives way.

    Raises:
        OSError: the port is in use by something else.
    """
    deadline, leaving = time.monotonic() + _GIVES_WAY, False
    while True:
        try:
            listening.bind((host, port))
        except OSError:
            leaving = leaving or ask_to_leave(port)
            if not leaving or time.monotonic() > deadline:
                raise
            time.sleep(0.05)
        else:
            return


def leave_address(port: int) -> str:
    """Name of the local socket at which a page is asked to leave its port."""
    return f"\0companion-live-{port}"


def ask_to_leave(port: int) -> bool:
    """Ask the page at a port to leave; returns whether one is there whose flight has ended."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
        asking.settimeout(1.0)
        try:
            asking.connect(leave_address(port))
            return asking.recv(8) == b"leaving"
        except OSError:
            return False
