"""The recipe of the digests beside it: `python make_digest.py FOLDER_OF_TLOGS`.

A digest is what a recording of a real autopilot says about its link: what the client asked when,
which messages came first when, and how often each came between two requests for it. All times are
the vehicle's, so that a simulation that stalled does not matter.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink import mavutil

DIALECTS = {"ardupilot": "ardupilotmega", "px4": "development"}
NAMES = (
    "px4-idle", "px4-offboard-entry", "px4-flight-companion", "px4-flight-gcs",
    "ardupilot-idle", "ardupilot-flight",
)  # fmt: skip
ASKED = {
    "COMMAND_LONG", "PARAM_REQUEST_READ", "PARAM_REQUEST_LIST", "PARAM_SET", "REQUEST_DATA_STREAM",
}  # fmt: skip
SET_MESSAGE_INTERVAL = 511
SHORTEST_S = 4.0
"""A rate is not told of less."""
GAP_S = 2.0
"""A longer pause ends a stream of setpoints."""


def records(path: Path) -> list[tuple[float, Any]]:
    """Return (time of recording in s since the first, message)."""
    dialect = DIALECTS[path.name.split("-")[0]]
    log = mavutil.mavlink_connection(str(path), dialect=dialect)
    found = []
    while (message := log.recv_msg()) is not None:
        found.append((message._timestamp, message))
    first = found[0][0]
    return [(time - first, message) for time, message in found]


def vehicle_clock(rows: list[tuple[float, Any]], ardupilot: bool) -> Any:
    """Return a function from the time of recording to the vehicle's, s since its boot."""
    pairs = []
    for time, message in rows:
        if message.get_srcComponent() != 1 or message.get_srcSystem() != 1:
            continue
        kind = message.get_type()
        if kind in ("ATTITUDE", "ATTITUDE_QUATERNION", "GLOBAL_POSITION_INT", "SYSTEM_TIME"):
            pairs.append((time, message.time_boot_ms / 1e3))
        elif kind == "TIMESYNC" and ardupilot and message.tc1 == 0:
            pairs.append((time, message.ts1 / 1e9))
    times, stamps = np.array(pairs).T
    stamps = np.maximum.accumulate(stamps)

    def clock(time: float) -> float:
        inside = float(np.interp(time, times, stamps))
        return inside + min(0.0, time - times[0]) + max(0.0, time - times[-1])

    return clock


def fields(message: Any) -> dict[str, Any]:
    """Return a message's fields, the ones that are zero left out."""
    values = message.to_dict()
    values.pop("mavpackettype")
    return {name: value for name, value in values.items() if value not in (0, 0.0)}


def digest(path: Path) -> dict[str, Any]:
    """Return the digest of one recording."""
    rows = records(path)
    clock = vehicle_clock(rows, path.name.startswith("ardupilot"))
    end = clock(rows[-1][0])
    asked: list[list[Any]] = []
    came: dict[str, list[float]] = {}
    setpoints: list[float] = []
    heartbeats: list[float] = []
    client: list[int] = []
    for time, message in rows:
        kind, at = message.get_type(), round(clock(time), 3)
        source = (message.get_srcSystem(), message.get_srcComponent())
        if source in ((1, 1), (0, 0)):
            name = f"#{kind[8:]}" if kind.startswith("UNKNOWN_") else kind
            came.setdefault(name, []).append(at)
        elif kind == "SET_ATTITUDE_TARGET":
            setpoints.append(at)
        elif kind == "HEARTBEAT":
            heartbeats.append(at)
            client = [*source, message.type]
        elif kind in ASKED:
            asked.append([at, kind, fields(message)])
    return {
        "from_s": round(clock(0.0), 3),
        "to_s": round(end, 3),
        "client": client,
        "heartbeats": heartbeats[:1] + heartbeats[-1:],
        "asked": asked,
        "setpoints": streams(setpoints),
        "first": [[name, times[0]] for name, times in came.items()],
        "rates": {name: rates(name, times, asked, end) for name, times in came.items()},
    }


def streams(times: list[float]) -> list[list[float]]:
    """Return (from, to, Hz) of each unbroken run of setpoints."""
    runs: list[list[float]] = []
    for time in times:
        if runs and time - runs[-1][-1] < GAP_S:
            runs[-1].append(time)
        else:
            runs.append([time])
    return [
        [run[0], run[-1], round((len(run) - 1) / (run[-1] - run[0]), 1)]
        for run in runs
        if len(run) > 2
    ]


def rates(name: str, times: list[float], asked: list[list[Any]], end: float) -> list[list[float]]:
    """Return (from, to, Hz) of a message between the requests that could change its rate."""
    found = []
    number = getattr(mavutil.mavlink, f"MAVLINK_MSG_ID_{name}", None)
    cuts = [
        at
        for at, kind, values in asked
        if kind == "REQUEST_DATA_STREAM"
        or (values.get("command") == SET_MESSAGE_INTERVAL and values.get("param1") == number)
    ]
    for start, stop in zip([times[0], *cuts], [*cuts, end], strict=True):
        inside = [time for time in times if start <= time <= stop]
        if len(inside) > 2 and inside[-1] - inside[0] >= SHORTEST_S:
            hz = (len(inside) - 1) / (inside[-1] - inside[0])
            found.append([inside[0], inside[-1], round(hz, 2)])
    return found


if __name__ == "__main__":
    for log in NAMES:
        told = digest(Path(sys.argv[1]) / f"{log}.tlog")
        text = json.dumps(told, separators=(",", ":")).replace("],[", "],\n[")
        (Path(__file__).parent / f"{log}.json").write_text(text + "\n")
