"""Slips of the time stamp of position messages."""

from math import inf
from random import Random


class StampSlips:
    """Lag of a time stamp behind the true time: 0 or 1 ms, changing at random times.

    Args:
        rate_hz: mean number of changes (slips) per second; 0 = none.
        seed: seed of the times of the slips.
    """

    def __init__(self, rate_hz: float, seed: int) -> None:
        self._rate_hz = rate_hz
        self._random = Random(f"{seed}/stamps")
        self._slipped = False
        self._next_slip_us = self._draw_next_slip_us(0.0)

    def lag_ms(self, now_us: int) -> int:
        """Return the time stamp's lag behind ``now_us`` (which must not decrease), 0 or 1 ms."""
        if now_us >= self._next_slip_us:
            self._slipped = not self._slipped
            self._next_slip_us = self._draw_next_slip_us(now_us)
        return int(self._slipped)

    def _draw_next_slip_us(self, now_us: float) -> float:
        if not self._rate_hz:
            return inf
        return now_us + 1e6 * self._random.expovariate(self._rate_hz)
