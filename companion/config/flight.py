"""What is flown: the phases of a flight, and one section a maneuver."""

from typing import Annotated, Literal

from pydantic import Field, StrictBool

from companion.config.units import Si
from companion.files.yaml_file import PathKey, Section

Seconds = Annotated[float, Field(gt=0.0, le=3600.0)]


class FlightConfig(Section):
    """What to fly, and how long each phase may take."""

    takeoff_height_m: Annotated[float, Field(ge=1.5, le=100.0)] = 5.0
    """Height above home to which the autopilot takes off."""
    maneuvers: Annotated[
        tuple[Literal["hover", "steps", "circle", "corners", "identify", "trajectory"], ...],
        Field(min_length=1, max_length=20),
    ] = (
        "hover",
        "steps",
        "circle",
    )
    """Flown in this order."""
    trajectory: PathKey | None = None
    """File of what the maneuver `trajectory` follows: configs/trajectories/figure8.yaml, say."""
    slow_down: bool = False
    """Slow a trajectory down that the limits do not allow, instead of refusing it."""
    arm: StrictBool = False
    """Arm by ourselves. Otherwise the pilot arms, and we wait for it; `fly --arm` says yes too."""
    accept: Annotated[tuple[Annotated[str, Field(max_length=100)], ...], Field(max_length=100)] = ()
    """Unsafe findings of `companion doctor` with which it is flown all the same, by their names,
    such as COM_OF_LOSS_T; each is told in the flight's events."""
    connect_timeout_s: Seconds = 30.0
    """Wait this long for a heartbeat."""
    ready_timeout_s: Seconds = 60.0
    """Wait this long for the autopilot's estimator and pre-arm checks."""
    arming_timeout_s: Seconds = 60.0
    """Wait this long for the vehicle to be armed."""
    takeoff_timeout_s: Seconds = 40.0
    """Wait this long to reach takeoff_height_m."""
    landing_timeout_s: Seconds = 90.0
    """Wait this long for the autopilot to report that it has landed."""


class HoverConfig(Section):
    """Maneuver `hover`: stay where control began."""

    duration_s: Seconds = 3.0
    """How long."""


class StepsConfig(Section):
    """Maneuver `steps`: acceleration doublets along north, east and a diagonal."""

    coefficient: Annotated[float, Field(gt=0.0, le=0.7)] = 0.25
    """Size of a step: horizontal acceleration per specific thrust, the sine of the tilt."""
    duration_s: Annotated[float, Field(ge=0.3, le=3.0)] = 1.0
    """How long the first part of a doublet lasts; the middle part takes twice as long."""
    settle_s: Annotated[float, Field(ge=0.5, le=60.0)] = 3.0
    """Position hold between doublets."""


class CornersConfig(Section):
    """Maneuver `corners`: acceleration steps past level, where the planners differ."""

    north_coefficient: Annotated[float, Field(gt=0.0, le=0.8)] = 0.35
    """North at each corner, but for the sign; the tilt has the sine √(north² + east²)."""
    east_coefficient: Annotated[float, Field(gt=0.0, le=0.8)] = 0.35
    """East at each corner. North 0.4, east 0.5 are the steps of the paper's figure 2."""
    duration_s: Annotated[float, Field(ge=0.3, le=3.0)] = 1.2
    """How long each corner is held."""
    settle_s: Annotated[float, Field(ge=0.5, le=60.0)] = 3.0
    """Position hold at the end."""


class CircleConfig(Section):
    """Maneuver `circle`: laps at a steady speed, heading held."""

    radius_m: Annotated[float, Field(ge=0.1, le=1000.0)] = 3.0
    """Radius; the circle begins where the vehicle is and lies north of it."""
    speed_m_s: Annotated[float, Field(ge=0.01, le=50.0)] = 2.0
    """Speed along the circle, reached and left smoothly."""
    laps: Annotated[float, Field(gt=0.0, le=1000.0)] = 1.0
    """How often round, gathering speed and braking included."""


class IdentifyConfig(Section):
    """Maneuver `identify`, flown by `companion identify`: doublets of body rates and of climb."""

    tilt_rate_deg_s: Annotated[float, Field(ge=15.0, le=180.0)] = 60.0
    """Roll and pitch rate of the larger doublets; the smaller ones have half of it."""
    tilt_duration_s: Annotated[float, Field(ge=0.1, le=1.0)] = 0.25
    """How long their first part lasts; with the rate it gives how far the vehicle tilts."""
    yaw_rate_deg_s: Annotated[float, Field(ge=15.0, le=180.0)] = 50.0
    """Yaw rate of the larger doublet; the smaller one has half of it."""
    yaw_duration_s: Annotated[float, Field(ge=0.2, le=3.0)] = 1.2
    """The same for yaw, which answers more slowly."""
    climb_m_s2: Annotated[float, Field(ge=0.5, le=4.0)] = 2.0
    """Vertical acceleration of the doublets that tell the thrust."""
    climb_duration_s: Annotated[float, Field(ge=0.1, le=1.0)] = 0.25
    """How long their first part lasts; the vehicle rises by climb_m_s2 times its square."""
    settle_s: Annotated[float, Field(ge=1.0, le=60.0)] = 1.5
    """Position hold before each doublet and at the end."""

    tilt_rate = Si("tilt_rate_deg_s")
    yaw_rate = Si("yaw_rate_deg_s")
