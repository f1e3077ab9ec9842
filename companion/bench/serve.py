"""`companion bench serve`: how much forwarding to other programs delays the setpoints.

Two processes get the same samples and telemetry in turn, in short rounds. The first has no clients.
The second forwards everything to three clients that read all, and to a fourth that is stopped
(SIGSTOP).
"""

import json
import os
import signal
import subprocess
import sys
from contextlib import ExitStack, closing
from functools import partial
from typing import Any

from pymavlink.dialects.v20 import common as dialect
from rich.console import Console

from companion.bench.figures import ROUND_S, measure, print_table
from companion.bench.process import BenchmarkedProgram, BenchmarkError
from companion.bench.sender import Sender
from companion.child_process import end_with_parent
from companion.mavlink.transport.free_port import free_port

_CLIENTS = 3
_ZEROS = [0.0] * 21
_TELEMETRY = (
    dialect.MAVLink_attitude_message(1, 0.1, 0.1, 0.1, 0.01, 0.02, 0.03),
    dialect.MAVLink_local_position_ned_message(1, 1.0, 2.0, -3.0, 0.1, 0.2, 0.3),
    dialect.MAVLink_highres_imu_message(1, *[0.1] * 13, 0xFFFF),
    dialect.MAVLink_odometry_message(
        1, 1, 8, 1.0, 2.0, -3.0, [1.0, 0.1, 0.1, 0.1], *[0.1] * 6, _ZEROS, _ZEROS
    ),
    dialect.MAVLink_servo_output_raw_message(1, 0, *[1500] * 8),
)
"""Messages that the vehicle sends after each sample."""
_TITLES = {"alone": "no client", "with_clients": f"{_CLIENTS} clients, and one that reads nothing"}


def run(seconds: float, rate_hz: float, as_json: bool) -> dict[str, Any]:
    """Measure with and without clients, in interleaved rounds of about 1 s.

    Args:
        seconds: time of each of the two measurements, s.
        rate_hz: rate of the attitude samples and of each of five telemetry messages, Hz.
        as_json: print nothing; the caller prints the result.

    Returns:
        `alone`, `with_clients`: figures like those of a program in `companion bench link`;
        `ratio`: p50 and p99 with clients divided by those without; `clients`: number of frames
        that each of the three reading clients received and lost.

    Raises:
        BenchmarkError: a program failed.
        LinkError: there are no free ports.
    """
    with ExitStack() as stack:
        ports = {key: free_port() for key in _TITLES}
        senders = {key: stack.enter_context(closing(_start(key, ports[key]))) for key in _TITLES}
        for sender in senders.values():
            sender.wait_ready()
        reading_clients = _start_clients(stack, ports["with_clients"], _CLIENTS)
        stopped_client = _start_clients(stack, ports["with_clients"], 1)
        senders["with_clients"].send_for(rate_hz, ROUND_S)  # all four connect, and receive
        stopped_client.send_signal(signal.SIGSTOP)
        senders["with_clients"].reset_measurements()
        figures = measure(senders, rate_hz, seconds)
        figures["clients"] = _read_counts(reading_clients)
    alone, with_clients = figures["alone"], figures["with_clients"]
    figures["ratio"] = {
        name: round(with_clients[f"{name}_us"] / alone[f"{name}_us"], 3) for name in ("p50", "p99")
    }
    if not as_json:
        _show(figures, rate_hz)
    return figures


def _start(key: str, client_port: int) -> Sender:
    program = BenchmarkedProgram(
        _TITLES[key], "companion.bench.companion_program", str(client_port)
    )
    return Sender(program, extra_messages=_TELEMETRY)


def _start_clients(stack: ExitStack, port: int, count: int) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-m", "companion.bench.client_program", str(port), str(count)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,  # Ctrl-C ends the benchmark, which ends the clients
        preexec_fn=partial(end_with_parent, os.getpid()),  # noqa: PLW1509  the benchmark has one thread
    )
    stack.callback(process.communicate)
    stack.callback(process.kill)
    return process


def _read_counts(process: subprocess.Popen[str]) -> list[dict[str, int]]:
    out, _ = process.communicate()
    if process.returncode != 0:
        raise BenchmarkError(
            f"the clients of the benchmark ended with exit code {process.returncode}"
        )
    counts: list[dict[str, int]] = json.loads(out)
    return counts


def _show(figures: dict[str, Any], rate_hz: float) -> None:
    title = f"sample out → setpoint in, at {rate_hz:g} Hz, forwarding full telemetry"
    print_table(title, _TITLES, figures)
    ratio, lost_count = figures["ratio"], sum(client["lost"] for client in figures["clients"])
    received_count = sum(client["received"] for client in figures["clients"])
    Console().print(
        f"with clients: p50 {ratio['p50']:.2f} ×, p99 {ratio['p99']:.2f} ×; "
        f"lost {lost_count} of {received_count + lost_count} forwarded frames",
        highlight=False,
    )
