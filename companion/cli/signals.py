"""Signals in flight: each makes the program hand the vehicle back.

Only a second Ctrl-C stops the setpoints at once.
"""

import asyncio
import signal
import time
from collections.abc import Callable

from companion.flight.session import Session
from companion.recording.measurements.summary import Summary

MIN_CTRL_C_INTERVAL = 1.0
"""Time after a Ctrl-C from which another Ctrl-C stops the setpoints at once, s.

A Ctrl-C that comes sooner is ignored, because a key may bounce.
"""

HOW_TO_LEAVE = (
    f"to stop the setpoints at once, press Ctrl-C again after {MIN_CTRL_C_INTERVAL:g} s or more; "
    "then the pilot or the autopilot's offboard-loss failsafe flies the vehicle"
)


class SignalHandler:
    """Handles the signals that arrive while a session flies.

    When a terminal closes, the shell and the kernel each send SIGHUP, and SIGTERM may follow. So a
    repeated SIGHUP or SIGTERM changes nothing. Only a second Ctrl-C interrupts a hand-back.

    Args:
        cancel_flight: called at the first signal if the session has no flight to hand back yet.
    """

    def __init__(
        self,
        session: Session,
        cancel_flight: Callable[[], object],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._session = session
        self._cancel_flight = cancel_flight
        self._clock = clock
        self._cancelled = False
        self._ctrl_c_at: float | None = None

    def handle(self, number: signal.Signals) -> None:
        """Handle one signal."""
        match number:
            case signal.SIGINT:
                self._handle_ctrl_c()
            case signal.SIGHUP:
                self._hand_back("SIGHUP (the terminal went away)")
            case _:
                self._hand_back(number.name)

    def _handle_ctrl_c(self) -> None:
        previous_time, self._ctrl_c_at = self._ctrl_c_at, self._clock()
        if previous_time is None:
            self._hand_back("the user (Ctrl-C)")
            self._session.note(HOW_TO_LEAVE)
        elif self._ctrl_c_at - previous_time >= MIN_CTRL_C_INTERVAL:
            self._session.leave()

    def _hand_back(self, cause: str) -> None:
        if not self._session.interrupt(f"interrupted by {cause}") and not self._cancelled:
            self._cancelled = True  # only once: closing the link must not be interrupted
            self._cancel_flight()


async def fly_interruptibly(session: Session) -> Summary:
    """Fly a session; `SignalHandler` handles SIGINT (Ctrl-C), SIGTERM and SIGHUP.

    Under `nohup` a terminal that closes changes nothing.

    Raises:
        CancelledError: interrupted before there was a flight; nothing was sent.
        LinkError, OSError, RealtimeError: see `Session.fly`.
    """
    flight = asyncio.ensure_future(session.fly())
    handler = SignalHandler(session, flight.cancel)
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM, *hangup_signals()):
        loop.add_signal_handler(number, handler.handle, number)
    return await flight


def hangup_signals() -> list[signal.Signals]:
    """SIGHUP in a list; empty if this process was started with SIGHUP ignored, as by `nohup`."""
    ignored = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    return [] if ignored else [signal.SIGHUP]
