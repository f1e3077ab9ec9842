"""The clients' programs: which one controls the vehicle, and what each of them last requested."""

from dataclasses import dataclass, field
from enum import Enum
from math import inf
from typing import NamedTuple

from companion.mavlink.framing import Frame
from companion.serve.network.addresses import Address, source_of
from companion.serve.network.client import Client
from companion.serve.setpoints.request import Request

_MAX_STREAMS = 64
"""Largest number of remembered streams; if there are more, silent ones are forgotten."""
_MAX_REQUESTS = 32
"""Largest number of programs whose newest request is kept."""


class Program(NamedTuple):
    """A program, identified by its client's connection and by its MAVLink address."""

    client: Client
    address: Address

    def __str__(self) -> str:
        return f"{self.client.name} ({self.address.system}/{self.address.component})"


class ControlState(Enum):
    """State of the control that the owner (the program in control) has over the vehicle.

    Messages show a value after the name of the owner.
    """

    FREE = "no client is in control"
    LIVE = "its setpoints are flown"
    HOLDING = "it sends no valid setpoint, and the vehicle is held"
    EXPIRED = "it sent no valid setpoint for too long, and the vehicle is handed back"


@dataclass
class _SetpointStream:
    """Arrival times of the last two setpoints of one program."""

    newest_arrival: float = -inf
    """Event-loop time at which the newest setpoint arrived, s; −inf: none yet."""
    previous_arrival: float = -inf
    """Event-loop time at which the setpoint before the newest arrived, s; −inf: none yet."""


@dataclass(eq=False)
class Ownership:
    """Keeps one owner, the program in control, and refuses all others with a reason."""

    _timeout: float
    """Time without a setpoint after which a program counts as silent, s."""
    _hold_time: float
    """Time for which the vehicle holds its position while the owner is silent, s."""
    owner: Program | None = field(default=None, init=False)
    """The program in control, or None."""
    _streams: dict[Program, _SetpointStream] = field(default_factory=dict, init=False)

    def note_setpoint(self, program: Program, now: float) -> str | None:
        """Note a setpoint; return why it is not flown, or None.

        A setpoint of another program takes over from a silent owner.
        """
        owner = self.owner
        if owner is not None and program != owner:
            if self._is_live(owner, now):
                return f"{owner} is in control"
            self.owner = program
        stream = self._streams.setdefault(program, _SetpointStream())
        stream.previous_arrival, stream.newest_arrival = stream.newest_arrival, now
        if len(self._streams) > _MAX_STREAMS:
            self._forget_silent(now)
        return None

    def withdraw(self, program: Program, owner_before: Program | None) -> None:
        """Withdraw the setpoint that was noted last, because it cannot be flown.

        `owner_before` was in control before the setpoint.
        """
        self.owner = owner_before
        stream = self._streams[program]
        stream.newest_arrival = stream.previous_arrival

    def request_control(self, program: Program, now: float) -> str | None:
        """Give control to a program that requests it; return the reason of a refusal, or None."""
        owner = self.owner
        if owner is not None and owner != program and self._is_live(owner, now):
            return f"{owner} is in control"
        if not self._is_live(program, now):
            return f"send setpoints first, every {1e3 * self._timeout:.0f} ms or more often"
        self.owner = program
        return None

    def has_stream(self, program: Program, now: float) -> bool:
        """Whether a program sends a stream: its last two setpoints came within the timeout."""
        stream = self._streams.get(program, _SetpointStream())
        return (
            self._is_live(program, now)
            and stream.newest_arrival - stream.previous_arrival <= self._timeout
        )

    def begin(self, now: float) -> None:
        """Note that control begins; if the owner is already silent, its hold time starts now."""
        if self.owner is not None:
            stream = self._streams.setdefault(self.owner, _SetpointStream())
            stream.newest_arrival = max(stream.newest_arrival, now - self._timeout)

    def release(self) -> None:
        """End the ownership: the owner has released control, or the vehicle has left our mode."""
        self.owner = None

    def state(self, now: float) -> ControlState:
        """Whether control is free, live, held or expired at the event-loop time `now`, s."""
        if self.owner is None:
            return ControlState.FREE
        overdue_time = (
            now - self._streams.get(self.owner, _SetpointStream()).newest_arrival - self._timeout
        )
        if overdue_time <= 0.0:
            return ControlState.LIVE
        return ControlState.HOLDING if overdue_time <= self._hold_time else ControlState.EXPIRED

    def _is_live(self, program: Program, now: float) -> bool:
        return now - self._streams.get(program, _SetpointStream()).newest_arrival <= self._timeout

    def _forget_silent(self, now: float) -> None:
        self._streams = {
            program: stream
            for program, stream in self._streams.items()
            if program == self.owner or self._is_live(program, now)
        }


class NewestRequests:
    """Keeps the newest request of each program, unless it was refused."""

    def __init__(self) -> None:
        self._newest_requests: dict[Program, Request] = {}  # in the order of their newest requests

    def keep(self, program: Program, request: Request) -> None:
        """Keep a program's newest request; drop the oldest of more than `_MAX_REQUESTS`."""
        self._newest_requests.pop(program, None)
        self._newest_requests[program] = request
        while len(self._newest_requests) > _MAX_REQUESTS:
            del self._newest_requests[next(iter(self._newest_requests))]

    def get(self, program: Program) -> Request | None:
        """The newest request of a program; None if it has sent none, or its request was dropped."""
        return self._newest_requests.get(program)

    def sender_of(self, client: Client, frame: Frame) -> Program:
        """The program that sent a command.

        A program may use different component ids for commands and setpoints. If no setpoint came
        from the address of `frame`, the sender is assumed to be the program of this client that
        sent a setpoint last.
        """
        program = Program(client, source_of(frame))
        if program in self._newest_requests:
            return program
        programs_of_client = (
            each for each in reversed(self._newest_requests) if each.client is client
        )
        return next(programs_of_client, program)
