"""Files and a log of a real autopilot, downloaded through `companion serve` and directly.

`python -m tests.real.files px4`, or `ardupilot`. MAVSDK (mavsdk-grpc) reads a file or a folder by
MAVLink FTP, and a log by the log messages, through us and then directly. One line of JSON: whether
the bytes are equal, their number, and the seconds that each took. Needs the autopilots (see
`build.py`), so `make test` leaves it alone.
"""

import argparse
import asyncio
import hashlib
import json
import sys
import tempfile
import time
from pathlib import Path

from mavsdk_grpc import System

from companion.mavlink.transport.free_port import free_port
from tests.real.build import ROOT
from tests.real.served import ARGUMENTS, DIRECT, OURS
from tests.real.vehicle import TUNED, merged, real_vehicle

FILES = {"px4": ("/log", "/parameters_backup.bson"), "ardupilot": (None, "@PARAM/param.pck")}
"""The folder to list, and the file to read by FTP; MAVSDK cannot list ArduPilot's folders."""
_LOGGING_S = 5.0
_LONGEST_S = 120.0
_HEARTBEATS_S = 3.0


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.real.files", description=__doc__)
    parser.add_argument("autopilot", choices=sorted(FILES))
    options = parser.parse_args()
    autopilot = options.autopilot
    with real_vehicle(autopilot, *ARGUMENTS[autopilot], relayed=False) as vehicle:
        if autopilot == "ardupilot":
            vehicle.parameter("LOG_DISARMED", 1.0)
            time.sleep(_LOGGING_S)
        row = compared(vehicle)
    print(json.dumps({"autopilot": autopilot, **row}))
    return int(not row["equal"])


def compared(vehicle) -> dict:
    """What both ways read."""
    folder = Path(tempfile.mkdtemp(prefix="files-"))
    include = {"include": str(ROOT / "configs" / f"vehicle-{vehicle.autopilot}.yaml")}
    serve = {"serve": {"clients": [f"udpin://{OURS}"]}}
    serving = vehicle.launch(
        merged(TUNED[vehicle.autopilot], serve) | include,
        command="serve",
        folder=folder / "serve",
    )
    through_us = read(f"udpout://{OURS}", vehicle.autopilot, folder / "through-us")
    serving.send(2)
    counters = serving.finish()
    direct = read(DIRECT[vehicle.autopilot], vehicle.autopilot, folder / "direct")
    ours, theirs = ((folder / each / "log.bin").read_bytes() for each in ("through-us", "direct"))
    through_us["log"] = digest(ours)
    direct["log"] = digest(theirs[: len(ours)])  # the log has grown since
    equal = all(through_us.get(key) == direct.get(key) for key in ("listing", "file", "log"))
    return {
        "equal": equal,
        "through_us": through_us,
        "direct": direct,
        "load": vehicle.load(),
        "counters": counters,
    }


def read(endpoint: str, autopilot: str, folder: Path) -> dict:
    """What one program of MAVSDK reads."""
    folder.mkdir(parents=True)
    return asyncio.run(asyncio.wait_for(_read(endpoint, autopilot, folder), _LONGEST_S))


async def _read(endpoint: str, autopilot: str, folder: Path) -> dict:
    system = System(port=free_port())
    await system.connect(endpoint)
    async for state in system.core.connection_state():
        if state.is_connected:
            break
    await asyncio.sleep(_HEARTBEATS_S)
    await system.ftp.set_target_compid(1)
    path, file = FILES[autopilot]
    row: dict = {}
    if path is not None:
        listing = await system.ftp.list_directory(path)
        row["listing"] = sorted(each.name for each in listing.entries)
    began = time.monotonic()
    async for _ in system.ftp.download(file, str(folder), use_burst=False):
        pass
    row["file"] = digest((folder / Path(file).name).read_bytes())
    row["file_s"] = round(time.monotonic() - began, 1)
    entries = await system.log_files.get_entries()
    entry = min(entries, key=lambda each: (each.size_bytes == 0, each.id))
    began = time.monotonic()
    async for _ in system.log_files.download_log_file(entry, str(folder / "log.bin")):
        pass
    row["log_s"] = round(time.monotonic() - began, 1)
    return row


def digest(data: bytes) -> list:
    """Number of bytes, and their SHA-256."""
    return [len(data), hashlib.sha256(data).hexdigest()]


if __name__ == "__main__":
    sys.exit(main())
