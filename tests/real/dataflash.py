"""ArduPilot's truth: the messages SIM (attitude) and SIM2 (position) of its `.BIN` log.

Their stamp, TimeUS, is of the clock that stamps ATTITUDE_QUATERNION. SIM2 comes at 400 Hz, SIM at
25 Hz with bit 0 of LOG_BITMASK, without it at 10 Hz.
"""

import struct
from pathlib import Path

import numpy as np

from tests.real.truth import Truth, truth_from

_HEAD = b"\xa3\x95"
_FMT, _FMT_SIZE = 128, 89
_TYPES = {"Q": "Q", "f": "f", "L": "i", "e": "i", "c": "h", "C": "H", "I": "I", "d": "d"}
"""Of the format letters, those that SIM and SIM2 use."""


class DataflashLog:
    """Reads one log as it grows.

    Args:
        path: the `.BIN` file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._at = 0
        self._sizes: dict[int, int] = {_FMT: _FMT_SIZE}
        self._wanted: dict[int, tuple[str, struct.Struct, list[int]]] = {}
        self._rows: dict[str, list[tuple[float, ...]]] = {"SIM": [], "SIM2": []}

    def truth(self, since: float) -> Truth:
        """The motion from `since` on, s since the vehicle's boot.

        Raises:
            NoTruthError: the log holds none.
        """
        self._read()
        attitude, position = (
            np.array([row for row in self._rows[name] if row[0] >= since]).reshape(-1, columns)
            for name, columns in (("SIM", 5), ("SIM2", 4))
        )
        return truth_from(position, attitude)

    def _read(self) -> None:
        data = self._path.read_bytes()
        at = self._at
        while at + 3 <= len(data):
            size = self._sizes.get(data[at + 2]) if data[at : at + 2] == _HEAD else None
            if size is None:
                at += 1  # a damaged place: look for the next message
                continue
            if at + size > len(data):
                break
            self._take(data[at + 2], data[at + 3 : at + size])
            at += size
        self._at = at

    def _take(self, number: int, body: bytes) -> None:
        if number == _FMT:
            self._learn(body)
        elif number in self._wanted:
            name, layout, picked = self._wanted[number]
            values = layout.unpack(body)
            time, *rest = (values[index] for index in picked)
            self._rows[name].append((time / 1e6, *rest))

    def _learn(self, body: bytes) -> None:
        number, size = body[0], body[1]
        name, letters, labels = (
            part.split(b"\0")[0].decode() for part in (body[2:6], body[6:22], body[22:86])
        )
        self._sizes[number] = size
        wanted = {"SIM": "TimeUS,Q1,Q2,Q3,Q4", "SIM2": "TimeUS,PN,PE,PD"}.get(name)
        if wanted is not None:
            layout = struct.Struct("<" + "".join(_TYPES[letter] for letter in letters))
            columns = labels.split(",")
            self._wanted[number] = (
                name, layout, [columns.index(label) for label in wanted.split(",")]
            )  # fmt: skip


def newest_log(folder: Path) -> Path:
    """The log that is being written, or was last, in a folder `logs`."""
    return max(folder.glob("*.BIN"), key=lambda path: path.stat().st_mtime)
