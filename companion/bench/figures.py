"""Measures programs in interleaved rounds, and prints their latency and processor time."""

from collections.abc import Mapping
from math import ceil
from typing import Any

from rich.console import Console
from rich.table import Table

from companion.bench.process import BenchmarkError
from companion.bench.sender import Sender
from companion.realtime import no_garbage_collection

ROUND_S = 1.0
"""The programs are measured in turn, in rounds of this length, s, so load affects all equally."""


def measure(senders: Mapping[str, Sender], rate_hz: float, seconds: float) -> dict[str, Any]:
    """Measure each program for `seconds`, in interleaved rounds; return all figures by key.

    Raises:
        BenchmarkError: a program ended, or answered no sample in time.
    """
    rounds = ceil(seconds / ROUND_S)
    with no_garbage_collection():  # the senders must not pause
        for _ in range(rounds):
            for measured_sender in senders.values():
                measured_sender.send_for(rate_hz, seconds / rounds)
                for sender in senders.values():
                    sender.send_heartbeat()
    return {key: _figures_of(sender) for key, sender in senders.items()}


def print_table(title: str, names: Mapping[str, str], figures: Mapping[str, Any]) -> None:
    """Print a row for each program: its title from `names` and its figures from `figures`."""
    table = Table(title=title)
    for column_title in ("", "p50 µs", "p99 µs", "max µs", "CPU %", "unanswered"):
        table.add_column(column_title, justify="right" if column_title else "left")
    for key, name in names.items():
        row = figures[key]
        table.add_row(
            name,
            *(f"{row[figure]:.0f}" for figure in ("p50_us", "p99_us", "max_us")),
            f"{row['cpu_percent']:.1f}",
            f"{row['unanswered']} of {row['samples']}",
        )
    Console().print(table)


def _figures_of(sender: Sender) -> dict[str, Any]:
    """The figures of one program: round trips in µs, processor time in % of a core, and counts.

    Raises:
        BenchmarkError: no sample was answered in time.
    """
    sorted_times_ns = sorted(sender.round_trips_ns)
    if not sorted_times_ns:
        raise BenchmarkError(
            f"{sender.name} answered none of {sender.sent_samples} samples in time"
        )
    return {
        "p50_us": _quantile_us(sorted_times_ns, 0.50),
        "p99_us": _quantile_us(sorted_times_ns, 0.99),
        "max_us": _quantile_us(sorted_times_ns, 1.0),
        "cpu_percent": round(100.0 * sender.cpu_ns / sender.wall_ns, 2),
        "samples": sender.sent_samples,
        "unanswered": sender.sent_samples - len(sorted_times_ns),
    }


def _quantile_us(sorted_times_ns: list[int], quantile: float) -> float:
    index = min(len(sorted_times_ns) - 1, int(quantile * len(sorted_times_ns)))
    return round(sorted_times_ns[index] / 1000.0, 1)
