"""MAVLink over a UART or USB device."""

import asyncio
import errno
import os
import termios
import time

import serial

from companion.mavlink.errors import EndpointError
from companion.mavlink.loop import unwatch, watch
from companion.mavlink.transport.base import LostCallback, ReceiveCallback
from companion.mavlink.transport.endpoint import SerialPort

_READ_BYTES = 4096

_NO_PERMISSION = "not permitted; add yourself to its group: sudo adduser $USER dialout"
_IN_USE = "in use by another program (a ground station?); end that program first"
_NO_HARDWARE = "no hardware answers under this name; is it plugged in and enabled?"
_OPEN_ERROR_TEXTS: dict[int | None, str] = {
    errno.ENOENT: (
        "there is no such device; is it plugged in? `ls /dev/serial/by-id` lists USB devices; a "
        "port of the computer's own (ttyAMA0, ttyTHS1) must be enabled first"
    ),
    errno.EACCES: _NO_PERMISSION,
    errno.EPERM: _NO_PERMISSION,
    errno.EBUSY: _IN_USE,
    errno.EAGAIN: _IN_USE,
    errno.EISDIR: "a folder, not a serial device; `ls /dev/serial/by-id` lists the devices",
    errno.ENOTTY: "not a serial device; `ls /dev/serial/by-id` lists those plugged in",
    errno.EIO: _NO_HARDWARE,
    errno.ENXIO: _NO_HARDWARE,
    errno.ENODEV: _NO_HARDWARE,
}
"""Why a device cannot be opened, and what to do, by the system's error number."""


class SerialTransport:
    """A serial port, read and written without blocking.

    No frame is sent in part. If the driver takes only part of a frame, the rest is sent as soon as
    there is room; until then, new frames are dropped.

    Raises:
        EndpointError: the device is missing, in use or not permitted, or refuses the baud rate.
    """

    reconnects = True

    def __init__(self, endpoint: SerialPort, receive: ReceiveCallback, lost: LostCallback) -> None:
        self._receive, self._lost = receive, lost
        self._loop = asyncio.get_running_loop()
        self._unsent = b""
        try:
            self._port = serial.Serial(
                endpoint.device, endpoint.baud, timeout=0, write_timeout=0, exclusive=True
            )
        # SerialException is an OSError; pyserial lets termios.error through.
        except (OSError, ValueError, termios.error) as error:
            raise EndpointError(_open_error(endpoint, error)) from error
        self._fd: int = self._port.fileno()
        watch(self._loop, self._fd, self._read)

    def _read(self) -> None:
        try:
            data = os.read(self._fd, _READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._report_lost(f"serial device failed: {error.strerror}")
            return
        if not data:
            self._report_lost("serial device is gone")
            return
        self._receive(data, time.perf_counter_ns())

    def send(self, frame: bytes) -> bool:
        """Write one frame, or drop it and return False.

        A frame is dropped if the device is gone, its buffer is full, or the last frame is
        unfinished.
        """
        if self._fd < 0 or self._unsent:
            return False
        return self._write(frame)

    def _write(self, data: bytes) -> bool:
        try:
            written = os.write(self._fd, data)
        except BlockingIOError:
            return False
        except OSError as error:
            # Called later, because the caller of `send` may not be ready for a lost connection.
            self._loop.call_soon(self._report_lost, f"serial device failed: {error.strerror}")
            return False
        if written < len(data):
            self._unsent = data[written:]
            self._loop.add_writer(self._fd, self._write_rest)
        return True

    def _write_rest(self) -> None:
        try:
            self._unsent = self._unsent[os.write(self._fd, self._unsent) :]
        except BlockingIOError:
            return
        except OSError as error:
            self._report_lost(f"serial device failed: {error.strerror}")
            return
        if not self._unsent:
            self._loop.remove_writer(self._fd)

    def _report_lost(self, reason: str) -> None:
        if self._fd >= 0:
            self.close()
            self._lost(reason)

    def close(self) -> None:
        """Close the device; the rest of an unfinished frame is discarded."""
        if self._fd < 0:
            return
        unwatch(self._loop, self._fd)
        self._loop.remove_writer(self._fd)
        self._fd, self._unsent = -1, b""
        self._port.close()


def _open_error(endpoint: SerialPort, error: Exception) -> str:
    error_number = _error_number(error)
    if error_number in _OPEN_ERROR_TEXTS:
        return f"serial {endpoint.device}: {_OPEN_ERROR_TEXTS[error_number]}"
    if error_number == errno.EINVAL or isinstance(error, ValueError):
        return (
            f"serial {endpoint.device}: the device does not take {endpoint.baud} baud; write the "
            "baud rate of the autopilot's port in link.endpoint, such as 57600 or 921600"
        )
    reason = "" if error_number is None else f": {os.strerror(error_number)}"
    return f"serial {endpoint.device} at {endpoint.baud} baud cannot be opened{reason}"


def _error_number(error: BaseException | None) -> int | None:
    """The system's error number; some errors of pyserial have it only in their context."""
    while error is not None:
        number = error.args[0] if isinstance(error, termios.error) else getattr(error, "errno", 0)
        if number:
            return int(number)
        error = error.__context__
    return None
