"""Ctrl-C while a program flies: the vehicle is handed back even if the program does not react."""

import asyncio
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from companion.api.flight_loop import FlightLoop, OwnThreadLoop

REACTION_TIMEOUT = 0.5
"""Time after Ctrl-C within which the program's event loop must run, s."""


@contextmanager
def on_ctrl_c(loop: FlightLoop, interrupt: Callable[[str], object]) -> Iterator[None]:
    """While the block runs, hand the vehicle back if the program does not react to Ctrl-C.

    The usual effects of Ctrl-C remain: `asyncio.run` cancels the program, and a second Ctrl-C
    raises KeyboardInterrupt in it. Python handles Ctrl-C in its main thread between two
    instructions, even in a program that never yields. A hand-back that is under way is completed.

    Args:
        loop: loop of the flight.
        interrupt: hands the vehicle back for a reason; called in the flight's loop.
    """
    handler_before = signal.getsignal(signal.SIGINT)
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or not isinstance(loop, OwnThreadLoop) or not callable(handler_before):
        yield
        return
    handler = _Handler(loop, interrupt, handler_before)
    signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        handler.ended = True
        # Of two flights that overlap, the first to end may have left its handler below ours.
        while (
            isinstance(current_handler := signal.getsignal(signal.SIGINT), _Handler)
            and current_handler.ended
        ):
            signal.signal(signal.SIGINT, current_handler.handler_before)


class _Handler:
    """Handler of SIGINT during one flight; it also calls the handler installed before.

    Attributes:
        ended: whether the flight has ended.
    """

    def __init__(
        self,
        loop: FlightLoop,
        interrupt: Callable[[str], object],
        handler_before: Callable[[int, FrameType | None], object],
    ) -> None:
        self._loop, self._interrupt = loop, interrupt
        self.handler_before = handler_before
        self.ended = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self._loop.post(_require_reaction, self._loop, self._interrupt)
        self.handler_before(number, frame)


def _require_reaction(loop: FlightLoop, interrupt: Callable[[str], object]) -> None:
    """In the flight's loop, hand back unless the program's loop reacts in `REACTION_TIMEOUT`."""
    reacted = threading.Event()
    loop.post_to_program(reacted.set)

    def hand_back_without_reaction() -> None:
        if not reacted.is_set():
            interrupt("interrupted by the user (Ctrl-C)")

    asyncio.get_running_loop().call_later(REACTION_TIMEOUT, hand_back_without_reaction)
