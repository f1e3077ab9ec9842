"""What ends MAVSDK's own repeating of setpoints, whatever has become of the rest of the program.

MAVSDK sends a setpoint at once, and then again 20 times a second, from a thread of its own, until
it is told to stop. Two things stop it when no new setpoint comes:

- A thread of ours, after `SILENCE_LIMIT_S`. An event loop that is frozen does not stop this thread:
  Python takes turns between threads every 5 ms, and a system call that blocks lets others run.
- What does stop every thread of Python (an extension that keeps the interpreter) stops MAVSDK's,
  too: all that it hears and sends is shown to us (`MavsdkTransport`), which takes the interpreter,
  so it waits with its next repetition at the latest.
"""

import logging
import threading
from collections.abc import Callable
from time import monotonic

_LOG = logging.getLogger(__name__)

SILENCE_LIMIT_S = 0.15
"""Without a new setpoint for this long MAVSDK is stopped; no sample period flown on is longer."""
_LOOK_PERIOD_S = 0.02


class Deadman:
    """Lets setpoints out, and has the sending stopped when they cease.

    Args:
        stop: Stops MAVSDK's repeating. Called in the deadman's thread, never while `sending` runs.
    """

    def __init__(self, stop: Callable[[], None]) -> None:
        self._stop = stop
        self._lock = threading.Lock()
        self._last: float | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="mavsdk deadman", daemon=True)
        self._thread.start()

    def sending(self, send: Callable[[], None]) -> None:
        """Send one setpoint, from which on MAVSDK repeats it."""
        with self._lock:
            self._last = monotonic()
            send()

    def end(self, silence: float = 0.0) -> None:
        """Stop the repeating now, unless a setpoint was sent in the last `silence` s."""
        with self._lock:
            if self._last is None or monotonic() - self._last < silence:
                return  # one was sent while the lock was waited for
            self._stop()
            self._last = None

    def close(self) -> None:
        """Stop the repeating, and the thread."""
        self._closing.set()
        self._thread.join()
        self.end()

    def _watch(self) -> None:
        while not self._closing.wait(_LOOK_PERIOD_S):
            last = self._last
            if last is not None and monotonic() - last > SILENCE_LIMIT_S:
                try:
                    self.end(SILENCE_LIMIT_S)
                except Exception:  # the next look tries again: this thread must not end
                    _LOG.exception("MAVSDK could not be stopped from repeating the last setpoint")
