"""What ends MAVSDK's own repeating of setpoints, whatever has become of the rest of the program.

MAVSDK sends a setpoint at once, and then again 20 times a second, from a thread of its own, until
it is told to stop. Two things stop it when no new setpoint comes:

- A thread, after `SILENCE_LIMIT_S`. An event loop that is frozen does not stop this thread: Python
  takes turns between threads every 5 ms, and a system call that blocks lets others run.
- The kernel's timer, after `KERNEL_LIMIT_S`, for what does stop this thread: an extension that
  never gives the interpreter back, a port that MAVSDK cannot write to, a computer that lets the
  program wait for so long. It ends the process (SIGALRM), and with it MAVSDK's thread; then the
  autopilot's failsafe has the vehicle.
"""

import signal
import threading
from collections.abc import Callable
from time import monotonic

SILENCE_LIMIT_S = 0.15
"""Without a new setpoint for this long MAVSDK is stopped; no sample period flown on is longer."""
KERNEL_LIMIT_S = 0.28
"""Without a new setpoint for this long the process is ended, if it could not stop MAVSDK."""
_LOOK_PERIOD_S = 0.02


def set_kernel_timer(seconds: float) -> None:
    """End this process `seconds` from now, unless this is called again before; 0: never."""
    signal.setitimer(signal.ITIMER_REAL, seconds)


class Deadman:
    """Lets setpoints out, and has the sending stopped when they cease.

    Args:
        stop: Stops MAVSDK's repeating. Called in the deadman's thread, never while `sending` runs.
        set_timer: As `set_kernel_timer`.
    """

    def __init__(
        self, stop: Callable[[], None], set_timer: Callable[[float], None] = set_kernel_timer
    ) -> None:
        self._stop, self._set_timer = stop, set_timer
        self._lock = threading.Lock()
        self._last: float | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="mavsdk deadman", daemon=True)
        self._thread.start()

    def sending(self, send: Callable[[], None]) -> None:
        """Send one setpoint, from which on MAVSDK repeats it."""
        with self._lock:
            # Before it is sent: from then on it is repeated, whatever happens to us.
            self._set_timer(KERNEL_LIMIT_S)
            self._last = monotonic()
            send()

    def close(self) -> None:
        """Stop the repeating, and the thread."""
        self._closing.set()
        self._thread.join()
        self._stop_sending()

    def _watch(self) -> None:
        while not self._closing.wait(_LOOK_PERIOD_S):
            last = self._last
            if last is not None and monotonic() - last > SILENCE_LIMIT_S:
                self._stop_sending(SILENCE_LIMIT_S)

    def _stop_sending(self, silence: float = 0.0) -> None:
        with self._lock:
            if self._last is None or monotonic() - self._last < silence:
                return  # one was sent while the lock was waited for
            self._stop()
            self._last = None
            self._set_timer(0.0)
