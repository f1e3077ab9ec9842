"""The early end of a flight for the plots: time, reason, and the limit that was crossed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from companion.config import Config
from companion.guidance.fence import circle_corners
from companion.recording.flight_record import FlightRecord

_CORNERS_OF_CIRCLE = 72


@dataclass(frozen=True)
class CrossedLimit:
    """The limit whose monitor ended the flight."""

    curve: str
    """Name of the curve that the limit bounds: "speed", "tilt", "error", "rate", "thrust",
    "latency", "height" or "track"."""
    key: str
    """Configuration key of the limit."""
    levels: tuple[float, ...] = ()
    """Values of the limit, in the curve's unit. The flight ended because the curve was at or beyond
    one of these values for too long or, for "latency", too often."""
    outline: tuple[tuple[float, float], ...] = ()
    """Fence around the track, (N, 2) north and east, m; empty for other curves."""


@dataclass(frozen=True)
class EarlyEndMark:
    """The early end of a flight, as the plots mark it."""

    time: float
    """Time since the flight began, s."""
    reason: str
    limit: CrossedLimit | None = None
    """Limit that was crossed; None if no plot shows it."""

    def sentence(self) -> str:
        """Time and reason, for the user."""
        return f"The flight ended early at {self.time:.1f} s: {self.reason.rstrip('.')}."


def early_end(
    figures: Mapping[str, Any], record: FlightRecord, config: Config | None
) -> EarlyEndMark | None:
    """The early end of a flight; None if it was flown to its end.

    `figures` are the content of `summary.json`. The configuration is None if it is unknown.
    """
    early_end_figures = figures["early_end"]
    if early_end_figures is None:
        return None
    reason, monitor, limit = figures["result"], early_end_figures["monitor"], None
    if config is not None and monitor in ("fence", "braking"):
        limit = _fence_side(config, reason, record)
    elif config is not None:
        limit = _constant_limits(config).get(monitor)
    return EarlyEndMark(float(early_end_figures["time_s"]), reason, limit)


def _constant_limits(config: Config) -> dict[str, CrossedLimit]:
    """The limits that are constant over the flight, by the monitor's name."""
    limits, safety = config.limits, config.safety
    max_tilt_deg = limits.max_tilt_deg + safety.tilt_margin_deg
    max_rate_deg_s = safety.max_body_rate_deg_s
    return {
        "tilt": CrossedLimit(
            "tilt", "limits.max_tilt_deg + safety.tilt_margin_deg", (max_tilt_deg,)
        ),
        "body rate": CrossedLimit(
            "rate", "safety.max_body_rate_deg_s", (-max_rate_deg_s, max_rate_deg_s)
        ),
        "speed": CrossedLimit("speed", "safety.max_speed_m_s", (safety.max_speed_m_s,)),
        "tracking": CrossedLimit(
            "error", "safety.max_tracking_error_m", (safety.max_tracking_error_m,)
        ),
        "thrust": CrossedLimit(
            "thrust", "limits.min_thrust, max_thrust", (limits.min_thrust, limits.max_thrust)
        ),
        "deadlines": CrossedLimit("latency", "deadman.deadline_ms", (config.deadman.deadline_ms,)),
    }


def _fence_side(config: Config, reason: str, record: FlightRecord) -> CrossedLimit | None:
    """The side of the fence that `reason` names, in the coordinates of the plots.

    Radius, ceiling and polygon are relative to the position where control began. The floor is
    relative to home. None: control never began, or the polygon is in latitude and longitude.
    """
    guidance, limits = record.rows("guidance"), config.limits
    controlled_rows = guidance[guidance["offboard_active"] == 1]
    if len(controlled_rows) == 0:
        return None
    north = float(controlled_rows["estimated_north_m"][0])
    east = float(controlled_rows["estimated_east_m"][0])
    if "fence_ceiling_m" in reason or "fence_floor_m" in reason:
        motion = record.rows("motion")
        start_time = record.since_start(controlled_rows["time_s"][:1])
        start_height = float(np.interp(start_time, motion["time_s"], motion["height_m"])[0])
        is_ceiling = "fence_ceiling_m" in reason
        return CrossedLimit(
            "height",
            f"limits.fence_{'ceiling' if is_ceiling else 'floor'}_m",
            (start_height + limits.fence_ceiling_m if is_ceiling else limits.fence_floor_m,),
        )
    if "fence_radius_m" in reason:
        key = "limits.fence_radius_m"
        corners = circle_corners(limits.fence_radius_m, _CORNERS_OF_CIRCLE)
    elif config.safety.fence_polygon_m:
        key, corners = "safety.fence_polygon_m", config.safety.fence_polygon_m
    else:
        return None
    outline = [(north + corner[0], east + corner[1]) for corner in (*corners, corners[0])]
    return CrossedLimit("track", key, outline=tuple(outline))
