"""The safety ladder's section of the configuration: limits, and what each breach leads to.

What a flight ends for whoever has the vehicle (pilot, failsafe, disarmed) and the deadman are not
here: they cannot be changed. A breach that says that our control cannot be trusted cannot be made a
mere warning either.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from companion.config.units import Si
from companion.files.yaml_file import Section
from companion.guidance.fence import inside

Ending = Literal["hand_back", "land"]
"""hand_back: the autopilot holds, and is left holding. land: it lands."""
Any = Literal["warn", "hold", "hand_back", "land"]
"""warn: say so. hold: give the maneuver up, hold in offboard, then see. Or as `Ending`."""
Metres = Annotated[float, Field(ge=-2000.0, le=2000.0)]
Latitude = Annotated[float, Field(ge=-85.0, le=85.0)]
Longitude = Annotated[float, Field(ge=-180.0, le=180.0)]
MonitoredShare = Annotated[float, Field(ge=0.0, le=0.9)]
"""Below 1: a share of everything would never be exceeded."""
MOST_CORNERS = 200


class SafetyConfig(Section):
    """The safety ladder, beside `limits` and `deadman`: what is watched, and what follows."""

    hold_s: Annotated[float, Field(gt=0.0, le=60.0)] = 3.0
    """How long a hold may take to mend what it was for; then the vehicle lands."""
    fence_polygon_m: Annotated[
        tuple[tuple[Metres, Metres], ...], Field(max_length=MOST_CORNERS)
    ] = ()
    """Corners [north, east] in metres about where control began; the vehicle stays inside."""
    fence_polygon_deg: Annotated[
        tuple[tuple[Latitude, Longitude], ...], Field(max_length=MOST_CORNERS)
    ] = ()
    """The same as [latitude, longitude]; give one of the two, or none."""
    braking_m_s2: Annotated[float, Field(ge=0.1, le=20.0)] = 2.5
    """Deceleration that is certain: the vehicle is stopped where it would leave the fence."""
    reaction_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.3
    """Time until it begins."""
    fence_action: Ending = "land"
    """Outside the fence. Within braking distance of it the maneuver is given up for a hold."""
    battery_action: Literal["warn", "hand_back", "land"] = "land"
    """Below limits.min_battery_percent, or not reported for 5 s."""
    position_action: Ending = "land"
    """GPS lost, the estimator without attitude, velocity or position, or neither told for 5 s."""
    max_reset_m: Annotated[float, Field(ge=0.01, le=20.0)] = 1.0
    """The estimator's position may jump so far in one flight; references move along with it."""
    max_reset_deg: Annotated[float, Field(gt=0.0, le=120.0)] = 45.0
    """The same of its heading; the thrust axis may jump half as far."""
    max_resets: Annotated[int, Field(ge=0, le=30)] = 3
    """The estimator may be reset so often within 30 s."""
    reset_action: Ending = "land"
    """More or larger resets."""
    tilt_margin_deg: Annotated[float, Field(ge=1.0, le=60.0)] = 20.0
    """So far beyond limits.max_tilt_deg the vehicle may tilt for a moment."""
    max_body_rate_deg_s: Annotated[float, Field(ge=10.0, le=1800.0)] = 400.0
    """Faster turning means that nobody controls it."""
    envelope_action: Ending = "hand_back"
    """Beyond that tilt or that body rate."""
    max_speed_m_s: Annotated[float, Field(ge=0.1, le=60.0)] = 15.0
    """Largest speed in any direction."""
    speed_action: Any = "hold"
    """Faster than that for 0.3 s."""
    max_tracking_error_m: Annotated[float, Field(ge=0.05, le=100.0)] = 5.0
    """Largest distance from the reference; after open-loop steps, once it is back there."""
    tracking_action: Any = "hold"
    """Farther than that for 1 s."""
    thrust_action: Any = "hold"
    """Thrust at limits.min_thrust or limits.max_thrust for 2 s."""
    max_loss: MonitoredShare = 0.4
    """Share of the vehicle's frames that may get lost, over a second."""
    max_round_trip_ms: Annotated[float, Field(ge=1.0, le=2000.0)] = 150.0
    """Longest way through the link and back."""
    link_action: Any = "warn"
    """More lost for 2 s, or a longer way for 5 s."""
    max_missed: MonitoredShare = 0.25
    """Share of the answers that may miss deadman.deadline_ms, over a second."""
    max_starved: MonitoredShare = 0.5
    """Share of a second by which our own timer may be late: the computer gives us no time."""
    computer_action: Any = "hand_back"
    """More of either for 1.5 s."""

    max_reset_angle = Si("max_reset_deg")
    tilt_margin = Si("tilt_margin_deg")
    max_body_rate = Si("max_body_rate_deg_s")
    max_round_trip = Si("max_round_trip_ms")

    @model_validator(mode="after")
    def _consistent(self) -> "SafetyConfig":
        if self.fence_polygon_m and self.fence_polygon_deg:
            raise ValueError("give fence_polygon_m or fence_polygon_deg, not both")
        for corners in (self.fence_polygon_m, self.fence_polygon_deg):
            if 0 < len(corners) < 3:
                raise ValueError("a polygon has at least three corners")
        if self.fence_polygon_m and not inside(0.0, 0.0, self.fence_polygon_m):
            raise ValueError("fence_polygon_m: [0, 0], where control begins, lies outside")
        return self
