"""The program's own vehicle time against the stamps that the autopilot wrote.

Where the stamps jump (a backlog of an earlier connection, say) the program goes on with its own
count of the vehicle's time, in which its CSV files are; the truth has the autopilot's.
"""

from pathlib import Path

import numpy as np

from companion.mavlink.tlog_file import messages
from tests.real.truth import Floats, NoTruthError

_LOOKED_AT = 400
_STEADY_S = 0.002


def stamp_offset(rates: Floats, log: Path) -> float:
    """The autopilot's stamps less the program's vehicle time in a flight, s.

    Args:
        rates: (n, 10), rows of `FlightTrace.rates`: each answers a sample, whose rates it keeps.
        log: the flight's `.tlog`, which has the samples as they came.

    Raises:
        NoTruthError: it is not steady, or nothing was answered.
    """
    stamps = {
        _key(m.rollspeed, m.pitchspeed, m.yawspeed): m.time_boot_ms / 1e3
        for _, m in messages(log, {"ATTITUDE_QUATERNION"})
    }
    some = rates[:: max(1, len(rates) // _LOOKED_AT)]
    keyed = [(row[0], _key(*row[6:9])) for row in some]
    found = np.array([stamps[key] - time for time, key in keyed if key in stamps])
    if len(found) == 0:
        raise NoTruthError("no sample of the log is among those that were answered")
    offset = float(np.median(found))
    if np.percentile(np.abs(found - offset), 95) > _STEADY_S:
        raise NoTruthError("the autopilot's clock jumped while it was controlled")
    return offset


def estimated(time: Floats, log: Path) -> Floats:
    """(n, 4), the attitudes that telemetry told at these stamps, s: the samples themselves."""
    rows = np.array(
        [
            (m.time_boot_ms / 1e3, m.q1, m.q2, m.q3, m.q4)
            for _, m in messages(log, {"ATTITUDE_QUATERNION"})
        ]
    )
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    after = np.clip(np.searchsorted(rows[:, 0], time), 1, len(rows) - 1)
    before_is_nearer = time - rows[after - 1, 0] < rows[after, 0] - time
    nearest: Floats = rows[after - before_is_nearer, 1:]
    return nearest / np.linalg.norm(nearest, axis=1, keepdims=True)


def _key(*rates: float) -> bytes:
    return np.array(rates, dtype=np.float32).tobytes()
