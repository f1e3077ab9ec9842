"""Checks before the flight that a maneuver stays far enough from the fence to trigger no monitor.

`Fence.breach_at_stopping_point` checks each time of the reference with the monitor's formula.
`TRACKING_MARGIN` allows for the tracking error. A vehicle that follows an accepted reference within
this margin triggers no monitor, unless wind leaves less tilt for braking than the monitor assumes.
"""

from dataclasses import dataclass, replace

import numpy as np

from companion.guidance.fence import Breach, Fence, LatLon
from companion.guidance.reference import Vector
from companion.guidance.trajectory.demand import Motion, columns
from companion.guidance.trajectory.feasibility import Violation
from companion.guidance.trajectory.septic_spline import Floats

TRACKING_MARGIN = 0.5
"""Margin between reference and fence, m, for the tracking error and for `_POINT_DISTANCE`."""

_POINT_DISTANCE = 0.25
"""Distance between two checked points of a polygon fence, m."""

_MAX_CHECKED_TIMES = 4000
"""Approximate number of moments of a long motion that are checked to find when a breach begins."""


@dataclass(frozen=True, slots=True)
class FenceCheck:
    """Checks a motion, whose positions are relative to where control begins, against the fence."""

    fence: Fence
    """The fence that the monitors watch in flight."""
    height: float
    """Height above home where control begins, m."""
    origin: LatLon | None = None
    """Geographic position where control begins, or None; then a fence in latitude and longitude is
    not checked."""

    def __call__(self, motion: Motion) -> Violation | None:
        """The worst violation, and whether a slower motion would avoid it; None: no violation."""
        worst = self._worst_breach(motion)
        if worst is None:
            return None
        zeros = np.zeros_like(motion.velocity)
        motion_at_rest = replace(motion, velocity=zeros, acceleration=zeros)
        worst_at_rest = self._worst_breach(motion_at_rest)
        slowing_helps = worst_at_rest is None
        time, breach = worst_at_rest or worst
        begin = self._begin_time(motion if slowing_helps else motion_at_rest, time)
        text, remedy = _breach_text(breach, begin, slowing_helps), _remedy(slowing_helps)
        return Violation(breach.limit, begin, time, text, remedy, slowing_helps=slowing_helps)

    def _worst_breach(self, motion: Motion) -> tuple[float, Breach] | None:
        """The worst breach and its time, s."""
        north, east, _ = columns(motion.acceleration)
        stopping_point = self.fence.stopping_point(
            columns(motion.position), columns(motion.velocity), (north, east)
        )
        stopping_points = np.stack(stopping_point, axis=1)
        breaches = [
            (motion.times[k], breach)
            for k in self._candidate_indices(stopping_points)
            if (breach := self._breach(motion, k)) is not None
        ]
        if not breaches:
            return None
        time, breach = max(breaches, key=lambda each: each[1].distance_outside)
        return float(time), breach

    def _candidate_indices(self, stopping_points: Floats) -> list[int]:
        """Indices of the stopping points to check: the farthest, the highest and the lowest.

        At a stopping point the vehicle would stop if it braked. For a polygon, stopping points at
        every `_POINT_DISTANCE` along their path are added.
        """
        distance = np.hypot(stopping_points[:, 0], stopping_points[:, 1])
        indices = {
            int(distance.argmax()),
            int(stopping_points[:, 2].argmin()),
            int(stopping_points[:, 2].argmax()),
        }
        if self.fence.polygon or (self.fence.polygon_deg and self.origin):
            step_lengths = np.hypot(*np.diff(stopping_points[:, :2], axis=0).T)
            path_sections = np.floor(
                np.concatenate(([0.0], np.cumsum(step_lengths))) / _POINT_DISTANCE
            )
            indices.update(np.unique(path_sections, return_index=True)[1].tolist())
        return sorted(indices)

    def _breach(self, motion: Motion, k: int) -> Breach | None:
        offset, velocity = _vector(motion.position[k]), _vector(motion.velocity[k])
        fence = self.fence
        if fence.polygon_deg and self.origin is None:
            fence = replace(fence, polygon_deg=())
        north, east, _ = _vector(motion.acceleration[k])
        height = self.height - offset[2]
        return fence.breach_at_stopping_point(
            offset, velocity, height, self.origin, TRACKING_MARGIN, (north, east)
        )

    def _begin_time(self, motion: Motion, worst_time: float) -> float:
        """Time of the first checked moment with a breach, s; `worst_time` if none is earlier."""
        stride = max(1, motion.times.size // _MAX_CHECKED_TIMES)
        for k in range(0, motion.times.size, stride):
            if motion.times[k] >= worst_time or self._breach(motion, k) is not None:
                return float(min(motion.times[k], worst_time))
        return worst_time


def _breach_text(breach: Breach, time: float, slowing_helps: bool) -> str:
    if breach.distance_outside > 0.0:
        what_happens = "braking would end" if slowing_helps else "the vehicle goes"
        what_happens = f"{what_happens} up to {breach.distance_outside:.1f} m outside the fence"
    else:
        what_happens = (
            "the vehicle would stop too near to the fence"
            if slowing_helps
            else "the vehicle comes too near to the fence"
        )
    return (
        f"from {time:.2f} s on {what_happens} ({breach.where}; {breach.limit} with a margin of "
        f"{TRACKING_MARGIN:g} m for the tracking error)"
    )


def _remedy(slowing_helps: bool) -> str:
    if slowing_helps:
        return "fly more slowly (for a trajectory, --slow-down finds how much), or widen the fence"
    return "make the path smaller, or widen the fence"


def _vector(row: Floats) -> Vector:
    north, east, down = row.tolist()
    return north, east, down
