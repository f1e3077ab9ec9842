"""The programs behind the clients, and the newest request of each."""

from typing import NamedTuple

from companion.mavlink.framing import Frame
from companion.serve.network.addresses import Address, source_of
from companion.serve.network.client import Client
from companion.serve.setpoints.request import Request

_MOST = 32
"""Programs whose newest request is kept."""


class Program(NamedTuple):
    """One program of a client, told apart by its address behind the connection."""

    client: Client
    address: Address

    def __str__(self) -> str:
        return f"{self.client.name} ({self.address.system}/{self.address.component})"


class Programs:
    """Keeps the newest request of each program that was not refused."""

    def __init__(self) -> None:
        self._newest: dict[Program, Request] = {}  # in the order of their newest requests

    def keep(self, program: Program, request: Request) -> None:
        """Keep a program's newest request; those of the longest silent ones are forgotten."""
        self._newest.pop(program, None)
        self._newest[program] = request
        while len(self._newest) > _MOST:
            del self._newest[next(iter(self._newest))]

    def newest(self, program: Program) -> Request:
        """The newest request of a program.

        Raises:
            KeyError: it has sent none, or has been silent for long.
        """
        return self._newest[program]

    def asking(self, client: Client, frame: Frame) -> Program:
        """The program that sent a command.

        A program may send commands and setpoints under two component ids. Then the one of the same
        client counts whose setpoint is the newest.
        """
        program = Program(client, source_of(frame))
        if program in self._newest:
            return program
        others = (each for each in reversed(self._newest) if each.client is client)
        return next(others, program)
