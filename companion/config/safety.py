"""The safety section of the configuration: limits, and the action on each breach.

Some actions are fixed and have no key: on silence, gaps, low rates and a changed clock; when a
pilot or a failsafe flies the vehicle; when the vehicle is disarmed or on the ground. If a breach
means that our control cannot be trusted, its action cannot be `warn`.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from companion import plugins
from companion.config.guidance import require_known_name
from companion.config.units import Si
from companion.files.yaml_file import Section
from companion.guidance.fence import inside

Ending = Literal["hand_back", "land"]
"""hand_back: the autopilot holds, and the program leaves it there. land: the autopilot lands."""
AnyAction = Literal["warn", "hold", "hand_back", "land"]
"""warn: report the breach. hold: end the maneuver, hold in offboard, and land. The others: see
`Ending`."""
Metres = Annotated[float, Field(ge=-2000.0, le=2000.0)]
Latitude = Annotated[float, Field(ge=-85.0, le=85.0)]
Longitude = Annotated[float, Field(ge=-180.0, le=180.0)]
AlarmShare = Annotated[float, Field(ge=0.0, le=0.9)]
"""Limit of a share; a limit of 1 could never be exceeded."""
MOST_CORNERS = 200
MonitorName = Annotated[str, Field(min_length=1, max_length=50)]
MOST_MONITORS = 20


class SafetyConfig(Section):
    """Actions of all safety monitors, and those limits that are not in `limits` or `deadman`."""

    hold_s: Annotated[float, Field(gt=0.0, le=60.0)] = 3.0
    """Longest hold after a breach. The vehicle lands when the breach has ended and the vehicle is
    at rest, at the latest after this time. If the vehicle is then still within braking distance
    of the fence, fence_action follows instead."""
    fence_polygon_m: Annotated[
        tuple[tuple[Metres, Metres], ...], Field(max_length=MOST_CORNERS)
    ] = ()
    """Fence polygon: corners [north, east] in metres from where control began. Set fence_polygon_m
    or fence_polygon_deg, not both; neither: no polygon."""
    fence_polygon_deg: Annotated[
        tuple[tuple[Latitude, Longitude], ...], Field(max_length=MOST_CORNERS)
    ] = ()
    """Fence polygon: corners [latitude, longitude]. Set fence_polygon_m or fence_polygon_deg, not
    both; neither: no polygon."""
    braking_m_s2: Annotated[float, Field(ge=0.1, le=20.0)] = 2.5
    """Assumed braking deceleration: the vehicle brakes in time to stay inside the fence. If
    limits.max_tilt_deg and the estimated wind allow less, the program assumes less."""
    reaction_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.3
    """Assumed delay before the vehicle brakes at the fence; it may still accelerate meanwhile."""
    fence_action: Ending = "land"
    """Action outside the fence. Within braking distance of the fence, a hold ends the maneuver."""
    battery_action: Literal["warn", "hand_back", "land"] = "land"
    """Action if the battery is below limits.min_battery_percent, or not reported for 5 s."""
    position_action: Ending = "land"
    """Action if GPS is lost, if the estimator loses attitude, velocity or position, if its height
    contradicts its vertical speed, or if GPS or its status is not reported for 5 s."""
    max_reset_m: Annotated[float, Field(ge=0.01, le=20.0)] = 1.0
    """Largest sum of the estimator's position jumps in a flight. The position references move
    with each jump."""
    max_reset_deg: Annotated[float, Field(gt=0.0, le=120.0)] = 45.0
    """Largest sum of the estimator's heading jumps in a flight. The limit for jumps of the thrust
    axis (tilt) is half as large.
    """
    max_resets: Annotated[int, Field(ge=0, le=30)] = 3
    """Largest number of estimator resets within 30 s."""
    reset_action: Ending = "land"
    """Action if max_resets, max_reset_m or max_reset_deg is exceeded."""
    tilt_margin_deg: Annotated[float, Field(ge=1.0, le=60.0)] = 20.0
    """Tilt beyond limits.max_tilt_deg that is tolerated."""
    max_body_rate_deg_s: Annotated[float, Field(ge=10.0, le=1800.0)] = 400.0
    """Largest body rate; a faster rotation counts as loss of control."""
    envelope_action: Ending = "hand_back"
    """Action if the tilt exceeds its limit for 0.3 s, or the body rate for 0.2 s."""
    max_speed_m_s: Annotated[float, Field(ge=0.1, le=60.0)] = 15.0
    """Largest speed in any direction."""
    speed_action: AnyAction = "hold"
    """Action if max_speed_m_s is exceeded for 0.3 s."""
    max_tracking_error_m: Annotated[float, Field(ge=0.05, le=100.0)] = 5.0
    """Largest distance from the reference. After open-loop steps the monitor waits until the
    vehicle has returned, at most 10 s.
    """
    tracking_action: AnyAction = "hold"
    """Action if the distance from the reference exceeds max_tracking_error_m for 1 s."""
    thrust_action: AnyAction = "hold"
    """Action if thrust stays at limits.min_thrust or limits.max_thrust for 2 s."""
    max_loss: AlarmShare = 0.4
    """Largest share of lost frames over a second."""
    max_round_trip_ms: Annotated[float, Field(ge=1.0, le=2000.0)] = 150.0
    """Largest round-trip time of the link."""
    link_action: AnyAction = "warn"
    """Action if max_loss is exceeded for 2 s, or max_round_trip_ms for 5 s."""
    max_missed: AlarmShare = 0.25
    """Largest share of setpoints that miss deadman.deadline_ms, over a second."""
    max_starved: AlarmShare = 0.5
    """CPU starvation: largest share of a second by which our timer may be late."""
    computer_action: AnyAction = "hand_back"
    """Action if max_missed or max_starved is exceeded for 1.5 s."""
    monitors: Annotated[tuple[MonitorName, ...], Field(max_length=MOST_MONITORS)] = ()
    """Monitors of other packages that run in addition to the built-in ones, named by their entry
    points in `companion.monitors`. If one fails in flight, the vehicle is handed back."""

    max_reset_angle = Si("max_reset_deg")
    tilt_margin = Si("tilt_margin_deg")
    max_body_rate = Si("max_body_rate_deg_s")
    max_round_trip = Si("max_round_trip_ms")

    @model_validator(mode="after")
    def _check_consistency(self) -> "SafetyConfig":
        for name in self.monitors:
            require_known_name("monitor", name, (), plugins.MONITORS)
        if self.fence_polygon_m and self.fence_polygon_deg:
            raise ValueError("give fence_polygon_m or fence_polygon_deg, not both")
        for key in ("fence_polygon_m", "fence_polygon_deg"):
            if 0 < len(getattr(self, key)) < 3:
                raise ValueError(f"{key} must have at least three corners, or none")
        if self.fence_polygon_m and not inside(0.0, 0.0, self.fence_polygon_m):
            raise ValueError(
                "fence_polygon_m must surround [0, 0], the point where control begins; "
                "move its corners"
            )
        return self
