"""Ctrl-C, SIGTERM and SIGHUP outside a flight: each ends a command, with exit code 1.

During a flight and in `serve`, `companion.cli.signals` handles these signals.
"""

from __future__ import annotations

import os
import signal

from companion.cli.exit_codes import EXIT_FAILURE

TYPE_CHECKING = False  # type checkers take it for typing's, whose import would cost 5 ms
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType
    from typing import Any, NoReturn

    Handler = Callable[[int, FrameType | None], Any] | int | None

_DEFAULT_HANDLERS: dict[signal.Signals, Handler] = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
    signal.SIGHUP: signal.SIG_DFL,
}


def signals_with_default_handler() -> list[signal.Signals]:
    """Those of SIGINT, SIGTERM and SIGHUP that still have their default handler.

    Under `nohup` SIGHUP is ignored, so the list does not contain it.
    """
    return [
        number
        for number, handler in _DEFAULT_HANDLERS.items()
        if signal.getsignal(number) is handler
    ]


def exit_on(signals: list[signal.Signals]) -> None:
    """Have these signals end the process without an exception.

    During imports an exception could be swallowed or printed.
    """
    for number in signals:
        signal.signal(number, _exit)


def raise_interrupt_on(signals: list[signal.Signals]) -> None:
    """Have these signals raise KeyboardInterrupt in the main thread.

    Closing the event loop of a flight removes all handlers; call this again afterwards.
    """
    for number in signals:
        # asyncio ends its tasks in good order only if SIGINT has Python's own handler
        signal.signal(number, _DEFAULT_HANDLERS[number] if number == signal.SIGINT else _interrupt)


def restore_default_handlers(signals: list[signal.Signals]) -> None:
    """Give these signals the default handlers of a Python program again."""
    for number in signals:
        signal.signal(number, _DEFAULT_HANDLERS[number])


def _exit(_number: int, _frame: FrameType | None) -> NoReturn:
    os.write(2, b"companion: interrupted before anything was sent\n")
    os._exit(EXIT_FAILURE)


def _interrupt(_number: int, _frame: FrameType | None) -> NoReturn:
    """Raise KeyboardInterrupt; further SIGTERM and SIGHUP are ignored while the command ends."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: None)  # programs we start would inherit SIG_IGN
    raise KeyboardInterrupt
