"""Setting parameters one by one, each asked for, undoable before it is set, and read back."""

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from enum import Enum
from math import isclose
from typing import NamedTuple

from companion.mavlink.errors import LinkError, ParameterError
from companion.preflight.finding import Change, Finding
from companion.preflight.undo import Undo, UndoFile
from companion.vehicle.link import Link

_SINGLE = 1e-6
"""Parameters are single precision, which tells so much apart."""
_KNOWN_FOR = 3.0
"""A heartbeat older than this does not tell any more whether the vehicle is armed, s."""


class Answer(Enum):
    """What the user says to a change."""

    YES = "yes"
    NO = "no"
    ALL = "all"
    QUIT = "quit"


Ask = Callable[[Finding], Awaitable[Answer]]


class Outcome(NamedTuple):
    """What became of a change.

    Attributes:
        change: It.
        refusal: Why it was not made; empty if it was.
    """

    change: Change
    refusal: str = ""


class NotWhileArmedError(LinkError):
    """Parameters of a vehicle that may fly are left alone."""


async def mend(
    link: Link,
    findings: Iterable[Finding],
    ask: Ask,
    undo: UndoFile,
    told: Callable[[Outcome], None],
) -> None:
    """Propose each change, and make those that the user agrees to.

    Args:
        link: To the vehicle.
        findings: Those without a change are left out.
        ask: Is asked before each, until it says all.
        undo: Notes the old value before it is overwritten.
        told: Takes what became of each change that was agreed to, as soon as that is known.

    Raises:
        NotWhileArmedError: The vehicle is armed, or nobody knows; no more was set.
        ConfigError: The undo file cannot be written; no more was set.
        LinkLost: The connection dropped meanwhile.
    """
    answer = Answer.NO
    for finding in findings:
        change = finding.change
        if change is None:
            continue
        if answer is not Answer.ALL:
            answer = await ask(finding)
        if answer is Answer.QUIT:
            return
        if answer is Answer.NO:
            continue
        require_disarmed(link)
        undo.add(change.parameter, change.old)
        told(await _set(link, change))


async def restore(link: Link, undo: Undo, told: Callable[[Outcome], None]) -> None:
    """Set what the undo file says, the last change first.

    Raises:
        NotWhileArmedError, LinkLost: As `mend`.
    """
    for parameter, old in reversed(undo.parameters.items()):
        require_disarmed(link)
        try:
            now = float(await link.read_parameter(parameter))
        except ParameterError as error:
            told(Outcome(Change(parameter, old, old, reboot=False), str(error)))
            continue
        told(await _set(link, Change(parameter, now, old, reboot=False)))


def require_disarmed(link: Link) -> None:
    """Go no further with a vehicle that may fly.

    Raises:
        NotWhileArmedError: It is armed, or its last heartbeat is too old to tell.
    """
    heartbeat, now = link.state.heartbeat, asyncio.get_running_loop().time()
    if heartbeat is None or now - heartbeat.received > _KNOWN_FOR:
        raise NotWhileArmedError(
            "no heartbeat any more, so it is not known whether the vehicle is armed; "
            "no more parameters are set"
        )
    if heartbeat.armed:
        raise NotWhileArmedError(
            "the vehicle is armed, and its parameters are left alone; land and disarm it first"
        )


async def _set(link: Link, change: Change) -> Outcome:
    try:
        await link.write_parameter(change.parameter, change.new)
        held = await link.read_parameter(change.parameter)
    except ParameterError as error:
        return Outcome(change, str(error))
    if isclose(held, change.new, rel_tol=_SINGLE, abs_tol=_SINGLE):
        return Outcome(change)
    return Outcome(change, f"{change.parameter}: {held:g} was read back instead of {change.new:g}")
