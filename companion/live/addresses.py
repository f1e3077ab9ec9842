"""Addresses of the live page and the live stream: IP address, port and token."""

import errno
import secrets
import socket
import time
from ipaddress import ip_address
from typing import NamedTuple

from companion.files.yaml_file import ConfigError

PAGE_PORT = 8090
STREAM_PORT = 8765
"""Default port of the live stream; also the default port in Foxglove and Lichtblick."""
_ANSWER_TIMEOUT = 0.5
"""Time allowed for the helper process of an ended flight to answer `ask_to_release`, s."""
_RELEASE_TIMEOUT = 8.0
"""Time allowed for the helper process of an ended flight to release its port, s."""


class PageSocket(NamedTuple):
    """The listening socket of the live page, and the token that admits users."""

    host: str
    port: int
    token: str
    """Secret text that permits changes of values, and watching from another computer."""
    listening_socket: socket.socket

    def address_text(self) -> str:
        """A line for the user: address of the page, and the token."""
        host = _displayed_host(self.host)
        if ip_address(self.host).is_loopback:
            return (
                f"Live page: http://{host}:{self.port}/  token to change values there: {self.token}"
            )
        return f"Live page: http://{host}:{self.port}/?token={self.token}"


class StreamAddress(NamedTuple):
    """Address of the live stream."""

    host: str
    """IP address."""
    port: int

    def address_text(self) -> str:
        """A line for the user: address of the stream, and how to open it."""
        return (
            f"Live stream: ws://{_displayed_host(self.host)}:{self.port}/  in Foxglove or "
            "Lichtblick: open connection, Foxglove WebSocket"
        )


_ANY_ADDRESS = (ip_address("0.0.0.0"), ip_address("::"))


def _displayed_host(host: str) -> str:
    name = host if ip_address(host) not in _ANY_ADDRESS else socket.gethostname()
    return f"[{name}]" if ":" in name else name


def open_page_socket(address: str) -> PageSocket:
    """Listen at [HOST][:PORT]; the default is port 8090, for this computer only.

    Raises:
        ConfigError: the address is not valid or not of this computer, or the port is in use or
            not permitted.
    """
    host, listening_socket = _listen(address, "--live", PAGE_PORT)
    return PageSocket(
        host, listening_socket.getsockname()[1], secrets.token_urlsafe(9), listening_socket
    )


def stream_address(address: str) -> StreamAddress:
    """Check that [HOST][:PORT] is free; the default is port 8765, for this computer only.

    The library of the live stream opens the port itself, later.

    Raises:
        ConfigError: the address is not valid or not of this computer, or the port is in use or
            not permitted.
    """
    host, listening_socket = _listen(address, "--foxglove", STREAM_PORT)
    with listening_socket:
        return StreamAddress(host, listening_socket.getsockname()[1])


def _listen(address: str, option: str, default_port: int) -> tuple[str, socket.socket]:
    """Listen at `address`, the value of the option `option`; return host and socket."""
    host, port = _host_and_port(address, option, default_port)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening_socket = socket.socket(family, socket.SOCK_STREAM)
    listening_socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        _bind(listening_socket, host, port)
        listening_socket.listen(50)
    except OSError as error:
        listening_socket.close()
        remedy = f"choose another port, such as {option} {port + 1}"
        if error.errno == errno.EADDRNOTAVAIL:
            remedy = f"no interface of this computer has that address; use {option} 0.0.0.0:{port}"
        raise ConfigError(
            f"{option}: cannot listen at port {port} of {host}: {error.strerror}; {remedy}"
        ) from error
    return host, listening_socket


def _host_and_port(address: str, option: str, default_port: int) -> tuple[str, int]:
    """Host and port of `address`, the value of the option `option`."""
    host, colon, port = address.rpartition(":")
    if not colon and not address.isdigit():
        host, port = address, str(default_port)
    host = host.strip("[]") or "127.0.0.1"
    host = "127.0.0.1" if host == "localhost" else host
    try:
        number = int(port)
        ip_address(host)
    except ValueError as error:
        raise ConfigError(
            f"{option} {address}: write an IP address, a port, or both, such as "
            f"0.0.0.0:{default_port}"
        ) from error
    if not 0 <= number <= 65535:
        raise ConfigError(f"{option} {address}: a port is at most 65535")
    return host, number


def _bind(listening_socket: socket.socket, host: str, port: int) -> None:
    """Bind the socket; ask the page or stream of an ended flight to release the port."""
    deadline, is_release_agreed = time.monotonic() + _ANSWER_TIMEOUT, False
    while True:
        try:
            listening_socket.bind((host, port))
        except OSError as error:
            if not is_release_agreed and ask_to_release(port):
                deadline, is_release_agreed = time.monotonic() + _RELEASE_TIMEOUT, True
            if error.errno != errno.EADDRINUSE or time.monotonic() > deadline:
                raise
            time.sleep(0.05)
        else:
            return


def release_socket_name(port: int) -> str:
    """Name of the local socket through which a page or stream is asked to release its port."""
    return f"\0companion-live-{port}"


def ask_to_release(port: int) -> bool:
    """Ask the page or stream of an ended flight to release its port; return whether it agreed."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as sock:
        sock.settimeout(1.0)
        try:
            sock.connect(release_socket_name(port))
            return sock.recv(8) == b"leaving"
        except OSError:
            return False
