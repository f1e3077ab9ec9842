"""`companion bench link`: the time from a sample to its setpoint, for this and other programs.

A sender simulates the vehicle for five programs in turn, in short rounds, so that the load of the
computer affects all of them equally. The programs are a bare echo in Python (the lower bound), this
program, a simple loop on pymavlink, this program with MAVSDK as its link, and a program written
with MAVSDK alone.
"""

from contextlib import ExitStack, closing
from typing import Any, NamedTuple

from rich.console import Console

from companion.bench.figures import measure, print_table
from companion.bench.process import BenchmarkedProgram
from companion.bench.sender import (
    TIME_MODULUS,
    Sender,
    StampReader,
    stamp_by_time,
    stamp_by_yaw_rate,
)
from companion.extras import require

_YAW_RATE_STAMP_MODULUS = 8192  # STAMP_MODULUS of `mavsdk_program`


class _Program(NamedTuple):
    """A program to measure."""

    key: str
    """Key of the program in the result."""
    title: str
    """Name to show to users."""
    command: str
    """Module of `companion.bench` that is run, and further arguments."""
    read_stamp: StampReader = stamp_by_time
    """Reads from a setpoint the time stamp of its sample."""
    modulus: int = TIME_MODULUS
    """Value at which the time stamps in setpoints wrap, ms."""


_PROGRAMS = (
    _Program("echo", "blocking echo", "echo_program"),
    _Program("companion", "companion", "companion_program"),
    _Program("pymavlink", "blocking pymavlink", "pymavlink_program"),
    _Program("companion_mavsdk", "companion through MAVSDK", "companion_program mavsdk"),
    _Program("mavsdk", "MAVSDK", "mavsdk_program", stamp_by_yaw_rate, _YAW_RATE_STAMP_MODULUS),
)


def run(seconds: float, rate_hz: float, as_json: bool) -> dict[str, Any]:
    """Measure all programs, in interleaved rounds of about 1 s.

    Args:
        seconds: time for which each program is measured, s.
        rate_hz: rate of the attitude samples, Hz.
        as_json: print nothing; the caller prints the result.

    Returns:
        For each of `echo`, `companion`, `pymavlink`, `companion_mavsdk` and `mavsdk`: `p50_us`,
        `p99_us`, `max_us`, `cpu_percent` (of one core), `samples` and `unanswered`. Under `ratio`,
        as `companion_to_…`, the p50 of `companion` divided by that of `echo`, `pymavlink` and
        `mavsdk`.

    Raises:
        MissingExtraError: MAVSDK is not installed.
        BenchmarkError: a program failed.
        LinkError: there are no free ports.
    """
    require("mavsdk", "mavsdk", "this benchmark")
    with ExitStack() as stack:
        senders = {
            program.key: stack.enter_context(closing(_start(program))) for program in _PROGRAMS
        }
        for sender in senders.values():
            sender.wait_ready()
        figures = measure(senders, rate_hz, seconds)
    figures["ratio"] = {
        f"companion_to_{other}": round(figures["companion"]["p50_us"] / figures[other]["p50_us"], 3)
        for other in ("echo", "pymavlink", "mavsdk")
    }
    if not as_json:
        _show(figures, rate_hz)
    return figures


def _start(program: _Program) -> Sender:
    started_program = BenchmarkedProgram(
        program.title, *f"companion.bench.{program.command}".split()
    )
    return Sender(started_program, program.read_stamp, program.modulus)


def _show(figures: dict[str, Any], rate_hz: float) -> None:
    title = f"sample out → setpoint in, at {rate_hz:g} Hz"
    print_table(title, {program.key: program.title for program in _PROGRAMS}, figures)
    ratio = figures["ratio"]
    Console().print(
        f"p50 of companion: {ratio['companion_to_echo']:.2f} × echo, "
        f"{ratio['companion_to_pymavlink']:.2f} × pymavlink, "
        f"{ratio['companion_to_mavsdk']:.2f} × MAVSDK",
        highlight=False,
    )
