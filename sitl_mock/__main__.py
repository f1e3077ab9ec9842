"""``python -m sitl_mock``: start one or several mock vehicles."""

import argparse
import multiprocessing
import os
import signal
import sys
import threading
import time
from math import degrees
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

from sitl_mock.config.section import ConfigError
from sitl_mock.physics.quaternion import euler
from sitl_mock.server import Server
from sitl_mock.settings import MockSettings, load_settings
from sitl_mock.simulation import Simulation

EXIT_OK = 0
EXIT_USAGE = 2
_STATUS_PERIOD_S = 0.25

_END_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return the exit code.

    0: ended by a signal, or `--check` found no fault. 2: cannot start, or `--check` found a fault.
    """
    options = _parser().parse_args(arguments)
    try:
        settings = load_settings(options.config, _overrides(options))
        if options.check:
            Simulation(settings)  # it also reads the passphrase of the signing
            sys.stdout.write("configuration is valid\n")
            return EXIT_OK
        servers = _servers(settings, options)
    except ConfigError as error:
        sys.stderr.write(f"sitl_mock: {error}\n")
        return EXIT_USAGE
    for end_signal in _END_SIGNALS:  # a shell may start us with SIGINT ignored
        signal.signal(end_signal, _interrupt)
    if options.end_with_stdin:
        threading.Thread(target=_end_with_stdin, name="stdin", daemon=True).start()
    for server in servers:
        sys.stdout.write(f"ready on {server.address}\n")
    sys.stdout.flush()
    try:
        if len(servers) == 1:
            servers[0].run()
        else:
            _run_all(servers)
    except KeyboardInterrupt:
        pass
    if not options.headless:
        sys.stderr.write("\n")
    return EXIT_OK


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m sitl_mock", description="A simulated multirotor with its autopilot."
    )
    parser.add_argument("--config", type=Path, help="YAML file; its `mock` section is read")
    parser.add_argument("--port", type=int, help="UDP port of the companion (default 14540)")
    parser.add_argument("--endpoint", help="udp (default), tcpin://HOST:PORT or serial:///PATH")
    parser.add_argument("--gcs-port", type=int, help="UDP port of a ground station, 0 = none")
    parser.add_argument(
        "--control-port", type=int, help="UDP port of the JSON control channel, 0 = none"
    )
    parser.add_argument("--seed", type=int, help="seed of all noise and faults")
    parser.add_argument(
        "--speed", type=float, help="seconds of vehicle time per second of real time"
    )
    parser.add_argument(
        "--lockstep", action="store_true", help="lockstep: wait for an answer to each step"
    )
    parser.add_argument("--count", type=int, default=1, help="number of vehicles (1..100)")
    parser.add_argument(
        "--headless", action="store_true", help="show no status line on the terminal"
    )
    parser.add_argument(
        "--end-with-stdin", action="store_true", help="exit when standard input ends"
    )
    parser.add_argument("--check", action="store_true", help="check the configuration and exit")
    return parser


def _overrides(options: argparse.Namespace) -> dict[str, Any]:
    keys = ("port", "endpoint", "gcs_port", "control_port", "seed", "speed")
    overrides = {key: getattr(options, key) for key in keys if getattr(options, key) is not None}
    if options.lockstep:
        overrides["lockstep"] = {"enabled": True}
    return overrides


def _servers(settings: MockSettings, options: argparse.Namespace) -> list[Server]:
    if not 1 <= options.count <= 100:
        raise ConfigError(f"--count must be 1 to 100, not {options.count}")
    shows_status = not options.headless and options.count == 1 and sys.stderr.isatty()
    return [
        Server(settings.for_vehicle(index), 1 + index, StatusLine().show if shows_status else None)
        for index in range(options.count)
    ]


def _run_all(servers: list[Server]) -> None:
    """Run each vehicle in its own process, which inherits the bound sockets."""
    context = multiprocessing.get_context("fork")
    processes: list[BaseProcess] = [
        context.Process(target=_run_one, args=(server,), daemon=True) for server in servers
    ]
    # A signal during `start` would leave a vehicle process that nothing ends.
    signal.pthread_sigmask(signal.SIG_BLOCK, _END_SIGNALS)
    for process in processes:
        process.start()
    for server in servers:
        server.close()
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _END_SIGNALS)
        for process in processes:
            process.join()
    finally:
        for process in processes:
            process.terminate()
            process.join()


def _run_one(server: Server) -> None:
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _END_SIGNALS)
        server.run()
    except KeyboardInterrupt:
        sys.exit(EXIT_OK)


def _end_with_stdin() -> None:
    """Wait until standard input, a pipe from the parent process, ends; then exit."""
    while os.read(0, 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


def _interrupt(_signal: int, _frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


class StatusLine:
    """Writes one line about the vehicle to standard error, at most four times a second."""

    def __init__(self) -> None:
        self._next_show_s = 0.0

    def show(self, simulation: Simulation) -> None:
        """Write the line, unless the last one is less than a quarter of a second old."""
        now = time.monotonic()
        if now < self._next_show_s:
            return
        self._next_show_s = now + _STATUS_PERIOD_S
        state, truth = simulation.state, simulation.vehicle.truth
        north, east, down = truth.position_ned
        roll, pitch, heading = (degrees(angle) for angle in euler(truth.q))
        text = (
            f"{state.time_s:8.1f} s  {state.mode.name:<9} {'armed' if state.armed else 'disarmed'}"
            f"{' FAILSAFE' if state.failsafe else ''}"
            f"  N {north:7.2f}  E {east:7.2f}  up {0.0 - down:6.2f} m"
            f"  roll {roll:4.0f}  pitch {pitch:4.0f}  heading {heading % 360:4.0f} deg"
            f"  setpoints {simulation.stream.setpoint_count}"
        )
        sys.stderr.write(f"\r{text}\x1b[K")
        sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
