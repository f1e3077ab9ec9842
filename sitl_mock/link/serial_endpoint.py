"""A serial endpoint: a pseudo-terminal; the companion opens its other end."""

import os
import select
import tty
from pathlib import Path

from sitl_mock.config.section import ConfigError
from sitl_mock.link.byte_stream import ByteStream


class SerialEndpoint:
    """A UART without a baud rate. Frames are dropped while the other end is closed.

    Args:
        path: path of a symbolic link to the device; None = no link.

    Raises:
        ConfigError: the link cannot be created, or the system has no free pseudo-terminal.
    """

    connected = True  # a UART cannot know

    def __init__(self, path: Path | None) -> None:
        try:
            self._master, slave = os.openpty()
        except OSError as error:
            raise ConfigError(f"cannot open a pseudo-terminal: {error.strerror}") from error
        tty.setraw(slave)
        self._device = os.ttyname(slave)
        # Closed here, so that the kernel reports whether another process has the device open.
        os.close(slave)
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, 0)
        self._stream = ByteStream(self._master)
        self._path = path
        self.address = self._device if path is None else f"{self._device} ({path})"
        self.has_received = False
        if path is not None:
            self._create_link(path)

    @property
    def descriptors(self) -> list[int]:
        """File descriptor for select; none while the other end is closed, so that select waits."""
        return [self._master] if self._other_end_open() else []

    def receive(self) -> tuple[bytes, bool] | None:
        """Return the next frame, None if there is none."""
        if not self._other_end_open():
            return None
        frame = self._stream.receive()
        if frame is None:
            return None
        self.has_received = True
        return frame, True

    def send(self, datagrams: list[bytes]) -> None:
        """Send if the other end is open."""
        if self._other_end_open():
            self._stream.send(datagrams)

    def close(self) -> None:
        """Close the vehicle's end and remove the symbolic link."""
        os.close(self._master)
        if self._path is not None:
            self._path.unlink(missing_ok=True)

    def _other_end_open(self) -> bool:
        """Whether the other end is open; if it was closed, drop unfinished frames."""
        hung_up = any(event & select.POLLHUP for _, event in self._poll.poll(0))
        if hung_up or not self._stream.open:
            self._stream = ByteStream(self._master)
        return not hung_up

    def _create_link(self, path: Path) -> None:
        try:
            if path.is_symlink():
                path.unlink()  # left by a mock that was killed
            path.symlink_to(self._device)
        except OSError as error:
            os.close(self._master)
            raise ConfigError(
                f"endpoint serial://{path}: cannot create this link ({error.strerror}); "
                "choose another path"
            ) from error
