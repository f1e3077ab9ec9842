"""Which autopilot is flown: the ones in the folder `REAL`, or one of the user's own.

`REAL` (environment) is a folder that holds `px4/start`, `ardupilot/start` and `stop`, or a YAML
file that describes one build; without it `../shared/real`, beside the repository. Such a file:

    autopilot: px4                       # or ardupilot
    start: HEADLESS=1 make px4_sitl sihsim_quadx    # a shell command
    folder: ~/PX4-Autopilot              # where it is run
    # All from here on may be left out; these are the defaults.
    stop: null                           # a shell command; null: `start` is interrupted
    ready_s: 120                         # until its heartbeat comes
    endpoint: udpin://127.0.0.1:14540    # ardupilot: tcp://127.0.0.1:5760
    station: udpin:127.0.0.1:14550       # a second link, as pymavlink writes it; tcp:127.0.0.1:5762
    truth: hil                           # hil (PX4's SIH), a folder of .BIN logs (ArduPilot), none
"""

import os
import signal
import subprocess
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import yaml

ROOT = Path(__file__).parents[2]
REAL = Path(os.environ.get("REAL") or ROOT.parent / "shared" / "real")
_ENDPOINTS = {"px4": "udpin://127.0.0.1:14540", "ardupilot": "tcp://127.0.0.1:5760"}
_STATIONS = {"px4": "udpin:127.0.0.1:14550", "ardupilot": "tcp:127.0.0.1:5762"}
_FIFO = "chrt -f 40 "


class Build(NamedTuple):
    """How an autopilot is started and reached; see the module's docstring.

    Attributes:
        autopilot: px4 or ardupilot.
        start: shell command.
        stop: shell command, or None.
        folder: where both are run.
        ready_s: s.
        endpoint: of the program.
        station: of the second link.
        truth: "hil", "none", or a folder of logs.
    """

    autopilot: str
    start: str
    stop: str | None
    folder: Path
    ready_s: float
    endpoint: str
    station: str
    truth: str


def builds() -> dict[str, str]:
    """What `REAL` offers: the autopilot of each, by name, and where it comes from.

    Raises:
        ValueError: there is nothing there.
    """
    if REAL.is_file():
        return {_described()["autopilot"]: str(REAL)}
    found = {name: str(REAL / name) for name in _ENDPOINTS if (REAL / name / "start").exists()}
    if not found:
        raise ValueError(
            f"REAL={REAL}: neither px4/start nor ardupilot/start is there, nor is it a YAML file; "
            "docs/real-autopilots.md says how to name your own build"
        )
    return found


def build_of(autopilot: str, folder: Path, arguments: list[str]) -> Build:
    """The build of an autopilot that `REAL` offers.

    Args:
        autopilot: px4 or ardupilot.
        folder: where one out of the folder `REAL` keeps its files.
        arguments: of its `start`; a user's own build takes none.

    Raises:
        ValueError: there is none.
    """
    if autopilot not in builds():
        raise ValueError(f"REAL={REAL} has no {autopilot}")
    told = _described() if REAL.is_file() else _from_folder(autopilot, folder, arguments)
    return Build(
        autopilot,
        told["start"],
        told.get("stop"),
        Path(told.get("folder", ".")).expanduser(),
        told.get("ready_s", 120.0),
        told.get("endpoint", _ENDPOINTS[autopilot]),
        told.get("station", _STATIONS[autopilot]),
        str(told.get("truth", "hil" if autopilot == "px4" else "none")),
    )


def _described() -> dict:
    told = yaml.safe_load(REAL.read_text())
    if not isinstance(told, dict) or told.get("autopilot") not in _ENDPOINTS or "start" not in told:
        raise ValueError(f"{REAL}: needs `autopilot` (px4 or ardupilot) and `start` (a command)")
    return told


def _from_folder(autopilot: str, folder: Path, arguments: list[str]) -> dict:
    words = " ".join(f"'{word}'" for word in arguments)
    return {
        "start": f"'{REAL / autopilot / 'start'}' '{folder}' {words}",
        "stop": f"'{REAL / 'stop'}' '{folder}'",
        "truth": "hil" if autopilot == "px4" else str(folder / "logs"),
    }


@contextmanager
def running(build: Build, log: Path, *, fifo: bool = False):
    """Start it, and end it whatever happens; its words go to `log`.

    Args:
        build: what is started.
        log: a file.
        fifo: before other programs of this computer (SCHED_FIFO), where that is allowed.
    """
    process = subprocess.Popen(
        (_FIFO if fifo else "") + build.start, shell=True, cwd=build.folder,
        stdin=subprocess.PIPE,  # PX4's shell ends the simulation when its input does
        stdout=log.open("w"), stderr=subprocess.STDOUT, start_new_session=True,
    )  # fmt: skip
    try:
        yield process
    finally:
        if build.stop is not None:
            subprocess.run(build.stop, shell=True, cwd=build.folder, check=False)
        _end(process)


def _end(process: subprocess.Popen) -> None:
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        if process.poll() is not None:
            return
        os.killpg(process.pid, number)
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            continue
