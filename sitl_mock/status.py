"""One line about a running vehicle, kept up to date on a terminal."""

import sys
import time
from math import degrees

from sitl_mock.autopilot.motion_telemetry import euler
from sitl_mock.simulation import Autopilot

_PERIOD_S = 0.25


class StatusLine:
    """Writes the line to standard error, at most four times a second."""

    def __init__(self) -> None:
        self._next = 0.0

    def show(self, autopilot: Autopilot) -> None:
        """Write the line if it is time again."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + _PERIOD_S
        state, truth = autopilot.state, autopilot.vehicle.truth
        north, east, down = truth.position_ned
        roll, pitch, heading = (degrees(angle) for angle in euler(truth.q))
        text = (
            f"{state.time_s:8.1f} s  {state.mode.name:<9} {'armed' if state.armed else 'disarmed'}"
            f"{' FAILSAFE' if state.failsafe else ''}"
            f"  N {north:7.2f}  E {east:7.2f}  up {0.0 - down:6.2f} m"
            f"  roll {roll:4.0f}  pitch {pitch:4.0f}  heading {heading % 360:4.0f} deg"
            f"  setpoints {autopilot.stream.received}"
        )
        sys.stderr.write(f"\r{text}\x1b[K")
        sys.stderr.flush()
