"""COMMAND_LONG with its COMMAND_ACK. Source: the MAVLink command protocol."""

import asyncio
from collections import deque
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.errors import CommandRefused, CommandTimeout, CommandUnfinished
from companion.mavlink.messages import Message, dialect
from companion.mavlink.outbox import Outbox
from companion.mavlink.pending import AnswerQueue, AnswerQueueRegistry
from companion.mavlink.settings import LinkSettings
from companion.mavlink.texts import TextAssembler


class Command(NamedTuple):
    """A MAV_CMD with its parameters, ready for `Link.command(*command)`."""

    command: int
    p1: float = 0.0
    p2: float = 0.0
    p3: float = 0.0
    p4: float = 0.0
    p5: float = 0.0
    p6: float = 0.0
    p7: float = 0.0


ARM = Command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
"""Arms, with all checks of the autopilot."""
DISARM = Command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
"""Disarms a vehicle on the ground; autopilots refuse this command in the air."""

_ACCEPTED, _IN_PROGRESS = dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_IN_PROGRESS
_IN_PROGRESS_TIMEOUT_S = 30.0  # from the ACK "in progress" to the final one
_STALL_S = 0.1  # a timeout that ends this late means that this process was stalled
_BACKLOG_S = 0.5  # after a stall the backlog of frames is read within this time
_REASON_DELAY_S = 0.3  # the reason of a refusal may come as a STATUSTEXT this long after the ACK


def command_name(command: int) -> str:
    """Name of a MAV_CMD; if the dialect lacks the command, its number, as `MAV_CMD 123`."""
    entry = dialect.enums["MAV_CMD"].get(command)
    return entry.name if entry is not None else f"MAV_CMD {command}"


def result_name(result: int) -> str:
    """Name of a MAV_RESULT, without prefix; if the dialect lacks it, its number, as `RESULT 42`."""
    entry = dialect.enums["MAV_RESULT"].get(result)
    return entry.name.removeprefix("MAV_RESULT_") if entry is not None else f"RESULT {result}"


@dataclass(slots=True)
class _Try:
    """A COMMAND_LONG that was sent and has no final ACK yet."""

    answers: AnswerQueue[int]
    deadline: float = inf
    """Event-loop time until which an ACK is accepted, s; inf while `CommandClient.send` waits."""


class CommandClient:
    """Sends commands and waits for their ACKs.

    An ACK names only the command, so a call waits until an earlier call with the same command ends.
    ACKs come in the order of the tries, so each ACK counts for the oldest try that expects an ACK.
    A late ACK of a cancelled call, or of a call before a stall, does not count for the next call.
    """

    def __init__(
        self,
        settings: LinkSettings,
        outbox: Outbox,
        dispatcher: MessageDispatcher,
        registry: AnswerQueueRegistry,
        texts: TextAssembler,
    ) -> None:
        self._settings, self._outbox, self._registry = settings, outbox, registry
        self._texts = texts
        self._locks: dict[int, asyncio.Lock] = {}
        self._unanswered_tries: dict[int, deque[_Try]] = {}
        dispatcher.subscribe("COMMAND_ACK", self._on_ack)

    async def send(
        self, command: int, params: tuple[float, ...], timeout_s: float, retries: int
    ) -> None:
        """Send a command and wait until the autopilot accepts it.

        Args:
            command: MAV_CMD.
            params: up to seven parameters; the rest are 0.
            timeout_s: time allowed for the ACK of each try, s. After an ACK "in progress" the
                command is not repeated, and may take 30 s.
            retries: number of repetitions after the first try.

        Raises:
            CommandRefused: the result is not ACCEPTED.
            CommandTimeout: no ACK came to any of the tries.
            CommandUnfinished: the autopilot answered "in progress", and gave no final result
                within 30 s.
            LinkLost: the connection dropped while waiting.
        """
        lock = self._locks.setdefault(command, asyncio.Lock())
        async with lock:
            start_time = asyncio.get_running_loop().time()
            with AnswerQueue[int](self._registry) as answers:
                result = await self._exchange(command, params, timeout_s, retries, answers)
            if result != _ACCEPTED:
                await asyncio.sleep(_REASON_DELAY_S)
                texts = self._texts.texts_since(start_time)
                raise CommandRefused(command_name(command), result, result_name(result), texts)

    async def _exchange(
        self,
        command: int,
        params: tuple[float, ...],
        timeout_s: float,
        retries: int,
        answers: AnswerQueue[int],
    ) -> int:
        time = asyncio.get_running_loop().time
        for confirmation in range(retries + 1):
            this_try, deadline = _Try(answers), time() + timeout_s
            self._expected_tries(command).append(this_try)
            self._send_try(command, params, confirmation)
            try:
                result = await answers.next(timeout_s)
                if result == _IN_PROGRESS:
                    result = await self._final_result(command, answers)
                return result
            except TimeoutError:  # the ACK is lost, or after a stall it may be in the backlog
                deadline = time() + _BACKLOG_S if time() - deadline > _STALL_S else -inf
            except asyncio.CancelledError:
                if time() > deadline:  # a stall of this process delayed the timeout
                    deadline = time() + _BACKLOG_S
                raise
            finally:
                this_try.deadline = deadline
        raise CommandTimeout(
            f"{command_name(command)}: no answer after {retries + 1} tries of {timeout_s:g} s; "
            f"is system {self._settings.target_system} still there?"
        )

    async def _final_result(self, command: int, answers: AnswerQueue[int]) -> int:
        """Wait for the final result of a command that is in progress."""
        try:
            async with asyncio.timeout(_IN_PROGRESS_TIMEOUT_S):
                while (result := await answers.next(_IN_PROGRESS_TIMEOUT_S)) == _IN_PROGRESS:
                    pass
                return result
        except TimeoutError:
            raise CommandUnfinished(
                f"{command_name(command)}: the autopilot answered that the command is in progress, "
                f"but gave no result within {_IN_PROGRESS_TIMEOUT_S:g} s; look at the autopilot's "
                "messages, and try again"
            ) from None

    def _send_try(self, command: int, params: tuple[float, ...], confirmation: int) -> None:
        padded = (*params, *(0.0,) * 7)[:7]
        self._outbox.send(
            dialect.MAVLink_command_long_message(
                self._settings.target_system,
                self._settings.target_component,
                command,
                confirmation,
                *padded,
            )
        )

    def _on_ack(self, message: Message) -> None:
        # An ACK may be for another station. The extension fields name the addressee; an autopilot
        # that does not fill them sends zeros.
        if message.target_system not in (0, self._settings.source_system):
            return
        if message.target_component not in (0, self._settings.source_component):
            return
        expected_tries = self._expected_tries(message.command)
        if not expected_tries:
            return
        expected_tries[0].answers.put(message.result)
        if message.result != _IN_PROGRESS:
            expected_tries.popleft()

    def _expected_tries(self, command: int) -> deque[_Try]:
        """The tries of a command whose ACK may still come, oldest first."""
        now = asyncio.get_running_loop().time()
        tries = self._unanswered_tries.setdefault(command, deque())
        while tries and tries[0].deadline < now:
            tries.popleft()
        return tries
