"""The programs behind the clients, and the newest request of each."""

from typing import NamedTuple

from companion.mavlink.framing import Frame
from companion.serve.network.addresses import Address, source_of
from companion.serve.network.client import Client
from companion.serve.setpoints.request import Request

_MAX_PROGRAMS = 32
"""Number of programs whose newest request is kept."""


class Program(NamedTuple):
    """A program, identified by its client's connection and by its MAVLink address."""

    client: Client
    address: Address

    def __str__(self) -> str:
        return f"{self.client.name} ({self.address.system}/{self.address.component})"


class Programs:
    """Keeps the newest request of each program, unless it was refused."""

    def __init__(self) -> None:
        self._newest: dict[Program, Request] = {}  # in the order of their newest requests

    def keep(self, program: Program, request: Request) -> None:
        """Keep a program's newest request; drop the oldest of more than `_MAX_PROGRAMS`."""
        self._newest.pop(program, None)
        self._newest[program] = request
        while len(self._newest) > _MAX_PROGRAMS:
            del self._newest[next(iter(self._newest))]

    def newest_request(self, program: Program) -> Request | None:
        """The newest request of a program; None if it has sent none, or its request was dropped."""
        return self._newest.get(program)

    def sender_of(self, client: Client, frame: Frame) -> Program:
        """The program that sent a command.

        A program may use different component ids for commands and setpoints. If no setpoint came
        from the address of `frame`, the command counts as sent by the program with the newest
        setpoint at the same client.
        """
        program = Program(client, source_of(frame))
        if program in self._newest:
            return program
        others = (each for each in reversed(self._newest) if each.client is client)
        return next(others, program)
