"""A process of `companion` that flies a real autopilot."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import yaml

from tests.real.build import ROOT


class Flight:
    """A process that flies.

    Attributes:
        began: when it was started, s of `time.monotonic`.
        obeyed_at: since when the autopilot obeyed it, as far as was waited for.
        result: its summary, with `finish`.
    """

    def __init__(self, vehicle, process: subprocess.Popen, errors: Path) -> None:
        self.vehicle, self.process, self.began = vehicle, process, time.monotonic()
        self._errors = errors
        self.obeyed_at: float | None = None
        self.result: dict = {}

    def until_obeyed(self, seconds: float = 120.0) -> float:
        station = self.vehicle.station
        now = station.until(
            lambda: station.obeys or self.process.poll() is not None, seconds, "offboard"
        )
        self.obeyed_at = now if station.obeys else None
        return now

    def send(self, number: signal.Signals) -> float:
        now = time.monotonic()
        self.process.send_signal(number)
        return now

    def finish(self, seconds: float = 120.0) -> dict:
        """The summary; a program that takes longer than this is killed.

        Raises:
            AssertionError: it was.
        """
        try:
            out, _ = self.process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()
            raise AssertionError(f"the program did not end within {seconds} s") from None
        lines = out.splitlines()
        self.result = json.loads(lines[-1]) if lines else {}
        return self.result

    def said(self) -> list[str]:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return [event["text"] for event in self.finish().get("events", [])]

    def error(self) -> str:
        """The last line that it said in case of an error."""
        lines = self._errors.read_text().strip().splitlines()
        return lines[-1] if lines else "it said nothing"

    def last_setpoint(self, since: float) -> float | None:
        """How long after `since` the last setpoint passed, s; None if none did."""
        later = [at for at in self.vehicle.relay.setpoints if at > since]
        return round(later[-1] - since, 3) if later else None


def started(vehicle, config: dict, folder: Path, command: str = "fly", prelude: str = "") -> Flight:
    """Start the program with a configuration; it records in `folder`."""
    folder.mkdir(parents=True)
    path, errors = folder / "fly.yaml", folder / "err.txt"
    path.write_text(
        yaml.safe_dump(config | {"recording": {"directory": str(folder)}}, sort_keys=False)
    )
    program = f"{prelude}\nfrom companion.cli.main import main\nraise SystemExit(main())"
    process = subprocess.Popen(
        [sys.executable, "-c", program, command, "--config", str(path), "--json"],
        cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors.open("w"),
        text=True,
    )  # fmt: skip
    return Flight(vehicle, process, errors)
