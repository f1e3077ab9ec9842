"""Stands between a real autopilot and the program: the cable to unplug, and a clock of its own."""

import multiprocessing
import selectors
import socket
import time
from contextlib import suppress

SETPOINT = 82
"""SET_ATTITUDE_TARGET."""
_HOST = "127.0.0.1"


def frames(data: bytes):
    """The MAVLink 2 frames that begin in `data`, as (message id, frame)."""
    at = data.find(b"\xfd")
    while 0 <= at < len(data) - 10:
        end = at + 12 + data[at + 1] + (13 if data[at + 2] & 1 else 0)
        yield int.from_bytes(data[at + 7 : at + 10], "little"), data[at:end]
        at = data.find(b"\xfd", end)


def connected(host: str, port: int, seconds: float) -> socket.socket:
    """A TCP connection to a simulator that may not listen yet.

    Raises:
        AssertionError: nobody listens in all that time.
    """
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        with suppress(OSError):
            return socket.create_connection((host, port))
        time.sleep(0.2)
    raise AssertionError(f"nobody listens on {host}:{port} after {seconds} s")


class Relay:
    """Passes on both ways, over UDP (PX4) or TCP (ArduPilot), in a process of its own.

    In a thread it would wait for the station's, and make samples 50 ms older (measured).

    Attributes:
        endpoint: for `link.endpoint`.
    """

    def __init__(self, autopilot: str, vehicle_port: int, port: int) -> None:
        scheme = "udpin" if autopilot == "px4" else "tcp"
        self.endpoint = f"{scheme}://{_HOST}:{port}"
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        passing = _UdpPassing if autopilot == "px4" else _TcpPassing
        self._process = context.Process(
            target=_run, args=(passing, vehicle_port, port, theirs), daemon=True
        )
        self._process.start()
        assert self._ask("ready")

    def close(self) -> None:
        self._process.terminate()
        self._process.join()

    def plug(self, *, up: bool, down: bool) -> None:
        """Whether anything passes towards the vehicle, and towards the program."""
        self._ask("plug", up, down)

    def inject(self, frame: bytes) -> None:
        """Send as another program on the same link would, through a router."""
        self._ask("inject", frame)

    @property
    def setpoints(self) -> list[float]:
        """When each setpoint came from the program, s of `time.monotonic`."""
        return self._ask("setpoints")

    def _ask(self, *question):
        self._pipe.send(question)
        assert self._pipe.poll(20.0), "the relay does not answer"
        return self._pipe.recv()


class _Passing:
    """What both kinds of link have in common."""

    def __init__(self, pipe) -> None:
        self.pipe, self.up, self.down = pipe, True, True
        self.setpoints: list[float] = []
        self.selector = selectors.DefaultSelector()
        self.selector.register(pipe, selectors.EVENT_READ, self.asked)

    def run(self) -> None:
        while True:
            for key, _ in self.selector.select():
                key.data()

    def asked(self) -> None:
        what, *arguments = self.pipe.recv()
        if what == "plug":
            self.up, self.down = arguments
        elif what == "inject":
            self.send_up(arguments[0])
        self.pipe.send(self.setpoints if what == "setpoints" else True)

    def from_program(self, data: bytes) -> None:
        now = time.monotonic()
        self.setpoints += [now for number, _ in frames(data) if number == SETPOINT]
        if self.up:
            self.send_up(data)

    def send_up(self, data: bytes) -> None:
        raise NotImplementedError


class _UdpPassing(_Passing):
    """PX4 answers the first sender only, so the vehicle's side stays one socket."""

    def __init__(self, vehicle_port: int, port: int, pipe) -> None:
        super().__init__(pipe)
        self.ours, self.theirs = (_HOST, port), (_HOST, vehicle_port + 40)
        self.vehicle, self.program = (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)
        )
        self.vehicle.bind((_HOST, vehicle_port))
        self.program.bind((_HOST, 0))
        self.selector.register(self.vehicle, selectors.EVENT_READ, self.vehicle_sent)
        self.selector.register(self.program, selectors.EVENT_READ, self.program_sent)

    def vehicle_sent(self) -> None:
        data = self.vehicle.recv(65536)
        if self.down:
            self.program.sendto(data, self.ours)

    def program_sent(self) -> None:
        try:
            data = self.program.recv(65536)
        except OSError:
            return  # no program is there yet
        self.from_program(data)

    def send_up(self, data: bytes) -> None:
        self.vehicle.sendto(data, self.theirs)


class _TcpPassing(_Passing):
    """ArduPilot boots when a client comes, so the vehicle's side stays open."""

    def __init__(self, vehicle_port: int, port: int, pipe) -> None:
        super().__init__(pipe)
        self.vehicle = connected(_HOST, vehicle_port, 15.0)
        self.vehicle.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.listener = socket.create_server((_HOST, port))
        self.program: socket.socket | None = None
        self.selector.register(self.vehicle, selectors.EVENT_READ, self.vehicle_sent)
        self.selector.register(self.listener, selectors.EVENT_READ, self.accept)

    def accept(self) -> None:
        self.hang_up()
        self.program, _ = self.listener.accept()
        self.program.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.selector.register(self.program, selectors.EVENT_READ, self.program_sent)

    def hang_up(self) -> None:
        if self.program is not None:
            self.selector.unregister(self.program)
            self.program.close()
            self.program = None

    def vehicle_sent(self) -> None:
        data = self.vehicle.recv(65536)
        if not self.down or self.program is None:
            return
        try:
            # A program that does not read is not to hold up the vehicle.
            self.program.send(data, socket.MSG_DONTWAIT)
        except BlockingIOError:
            pass
        except OSError:
            self.hang_up()

    def program_sent(self) -> None:
        if self.program is None:
            return  # hung up since the selector saw this
        try:
            data = self.program.recv(65536)
        except OSError:
            data = b""
        if data:
            self.from_program(data)
        else:
            self.hang_up()

    def send_up(self, data: bytes) -> None:
        self.vehicle.sendall(data)


def _run(passing, vehicle_port: int, port: int, pipe) -> None:
    passing(vehicle_port, port, pipe).run()
