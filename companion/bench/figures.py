"""What the latency benchmarks share: the length of a round, and the figures of a sender."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from companion.bench.process import BenchmarkError
from companion.bench.sender import Sender

ROUND_S = 1.0
"""The programs are measured in turn, in rounds of this length, s, so load affects all equally."""


@contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Switch Python's garbage collector off in the context, so that the sender does not pause."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def figures_of(sender: Sender) -> dict[str, Any]:
    """The figures of one program: round trips in µs, processor time in % of a core, and counts.

    Raises:
        BenchmarkError: no sample was answered in time.
    """
    ordered = sorted(sender.round_trips_ns)
    if not ordered:
        raise BenchmarkError(f"{sender.name} answered none of {sender.sent} samples in time")
    return {
        "p50_us": _quantile_us(ordered, 0.50),
        "p99_us": _quantile_us(ordered, 0.99),
        "max_us": _quantile_us(ordered, 1.0),
        "cpu_percent": round(100.0 * sender.cpu_ns / sender.wall_ns, 2),
        "samples": sender.sent,
        "unanswered": sender.sent - len(ordered),
    }


def _quantile_us(ordered: list[int], quantile: float) -> float:
    index = min(len(ordered) - 1, int(quantile * len(ordered)))
    return round(ordered[index] / 1000.0, 1)
