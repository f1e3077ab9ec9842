"""Where a simulated vehicle truly was, over its own clock."""

from math import cos, radians
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_EARTH_M = 6371000.0
_LONGEST_GAP = 0.1
"""Truth with a longer hole than this within a maneuver measures nothing, s."""


class NoTruthError(Exception):
    """The truth of a flight is missing or has holes."""


class Truth(NamedTuple):
    """The true motion of a flight.

    Attributes:
        time: (n,), of the positions, the vehicle's clock, s since its boot, rising.
        position: (n, 3), north, east, down of any fixed origin, m.
        q_time: (k,), of the attitudes, the same clock.
        q: (k, 4), quaternion w x y z, body FRD to NED, without jumps of the sign.
    """

    time: Floats
    position: Floats
    q_time: Floats
    q: Floats

    def position_at(self, time: Floats) -> Floats:
        """(m, 3), linear between two samples.

        Raises:
            NoTruthError: there are holes in it.
        """
        require_cover(self.time, time)
        return np.column_stack([np.interp(time, self.time, axis) for axis in self.position.T])


def require_cover(known: Floats, wanted: Floats) -> None:
    """See that samples at the times `known` cover all between the first and last of `wanted`.

    Raises:
        NoTruthError: they do not.
    """
    inside = known[(known > wanted[0] - _LONGEST_GAP) & (known < wanted[-1] + _LONGEST_GAP)]
    if len(inside) < 2:
        raise NoTruthError(f"no truth between {wanted[0]:.1f} and {wanted[-1]:.1f} s")
    gaps = np.diff(np.concatenate([[wanted[0]], inside, [wanted[-1]]]))
    if gaps.max() > _LONGEST_GAP:
        raise NoTruthError(f"the truth has a hole of {gaps.max():.2f} s")


def truth_from(positions: Floats, attitudes: Floats) -> Truth:
    """From rows in any order, with repetitions.

    Args:
        positions: (n, 4): time s, north, east, down m.
        attitudes: (k, 5): time s, w, x, y, z.

    Raises:
        NoTruthError: there are none.
    """
    if len(positions) == 0 or len(attitudes) == 0:
        raise NoTruthError("no sample of the truth came")
    positions, attitudes = _rising(positions), _rising(attitudes)
    return Truth(positions[:, 0], positions[:, 1:], attitudes[:, 0], continuous(attitudes[:, 1:]))


def _rising(rows: Floats) -> Floats:
    return rows[np.unique(rows[:, 0], return_index=True)[1]]


def continuous(q: Floats) -> Floats:
    """The same rotations, each with the sign that is nearer to the one before."""
    turned = np.sum(q[1:] * q[:-1], axis=1) < 0.0
    sign = np.cumprod(np.concatenate([[1.0], np.where(turned, -1.0, 1.0)]))
    return q * sign[:, None]


def turned(q: Floats, angle: float) -> Floats:
    """The attitudes, turned about the vertical by `angle` (clockwise from above), rad."""
    return multiplied(np.array([[np.cos(angle / 2.0), 0.0, 0.0, np.sin(angle / 2.0)]]), q)


def multiplied(a: Floats, b: Floats) -> Floats:
    """Quaternion products, row by row."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a.T, b.T
    return np.column_stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )


def conjugated(q: Floats) -> Floats:
    """The inverse rotations."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def north_east(
    latitude: float, longitude: float, origin: tuple[float, float]
) -> tuple[float, float]:
    """Metres from `origin` (latitude, longitude in degrees); good for a few hundred metres."""
    north = radians(latitude - origin[0]) * _EARTH_M
    return north, radians(longitude - origin[1]) * _EARTH_M * cos(radians(origin[0]))
