"""The maneuvers and the phases of a flight: one section for each maneuver."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from companion.config.units import Si
from companion.files.yaml_file import PathKey, Section

Seconds = Annotated[float, Field(gt=0.0, le=3600.0)]

ACCELERATION_STEPS = ("steps", "corners")
"""Maneuvers that command steps of the acceleration without position feedback."""
OPEN_LOOP = (*ACCELERATION_STEPS, "identify")
"""Maneuvers without a position reference, so without a tracking error."""


class FlightConfig(Section):
    """Maneuvers, and the time limit of each phase."""

    takeoff_height_m: Annotated[float, Field(ge=1.5, le=100.0)] = 5.0
    """Height above home to which the autopilot takes off."""
    maneuvers: Annotated[
        tuple[Literal["hover", "steps", "circle", "corners", "identify", "trajectory"], ...],
        Field(min_length=1, max_length=20),
    ] = ("hover", "steps", "circle")
    """Maneuvers in the order in which they are flown."""
    trajectory: PathKey | None = None
    """File of the maneuver `trajectory`, such as trajectories/figure8.yaml. A relative path starts
    at the folder of the file with this key; after --trajectory and --set, at the working folder."""
    slow_down: bool = False
    """Slow down a trajectory that exceeds the limits, instead of refusing it."""
    slow_down_reserve_m_s2: Annotated[float, Field(ge=0.0, le=10.0)] = 0.5
    """Part of the horizontal acceleration at limits.max_tilt_deg that is kept for feedback and wind
    when a trajectory is slowed down."""
    arm: bool = False
    """true, or the option --arm: the program arms the vehicle. false: the program waits until the
    pilot arms it."""
    take_over: bool = False
    """true, or the option --take-over: the pilot takes off, climbs to takeoff_height_m or higher,
    and hands over by switching to hold (GUIDED on ArduPilot); at the end the vehicle holds for the
    pilot. false: the autopilot takes off and lands."""
    accept: Annotated[tuple[Annotated[str, Field(max_length=100)], ...], Field(max_length=100)] = ()
    """Names of unsafe findings of `companion doctor` that do not prevent a flight, such as
    COM_OF_LOSS_T. The flight's events list them."""
    connect_timeout_s: Seconds = 30.0
    """Time allowed for the first heartbeat."""
    ready_timeout_s: Seconds = 60.0
    """Time allowed for the autopilot's estimator and pre-arm checks."""
    arming_timeout_s: Seconds = 60.0
    """Time allowed for arming; with take_over, until the pilot hands over."""
    takeoff_timeout_s: Seconds = 40.0
    """Time allowed to reach takeoff_height_m."""
    landing_timeout_s: Seconds = 90.0
    """Time allowed until the landing begins, and again until the autopilot reports that it has
    landed. A vehicle with ArduPilot that does not begin to land is held until it does or a pilot
    takes over, because it would drift without setpoints."""

    @model_validator(mode="after")
    def _check_who_arms(self) -> "FlightConfig":
        if self.arm and self.take_over:
            raise ValueError(
                "flight.take_over and flight.arm (--arm) exclude each other, because a pilot who "
                "hands over in the air has armed the vehicle; leave out one of them"
            )
        return self


class HoverConfig(Section):
    """Maneuver `hover`: stay where control began."""

    duration_s: Seconds = 3.0
    """Duration of the hover."""


class StepsConfig(Section):
    """Maneuver `steps`: acceleration doublets along north, east and a diagonal."""

    coefficient: Annotated[float, Field(gt=0.0, le=0.7)] = 0.25
    """Size of a step: horizontal acceleration per specific thrust, the sine of the tilt."""
    duration_s: Annotated[float, Field(ge=0.3, le=3.0)] = 1.0
    """Duration of the first part of a doublet; the middle part is twice as long."""
    settle_s: Annotated[float, Field(ge=0.5, le=60.0)] = 3.0
    """Duration of the position hold between doublets."""


class CornersConfig(Section):
    """Maneuver `corners`: acceleration steps round a rectangle, to compare planners."""

    north_coefficient: Annotated[float, Field(gt=0.0, le=0.8)] = 0.35
    """Magnitude of each corner's north coefficient: acceleration per specific thrust. The sine of
    the tilt is √(north² + east²)."""
    east_coefficient: Annotated[float, Field(gt=0.0, le=0.8)] = 0.35
    """Magnitude of each corner's east coefficient. North 0.4 and east 0.5 give the steps in figure
    2 of Xu & Pei."""
    duration_s: Annotated[float, Field(ge=0.3, le=3.0)] = 1.2
    """Duration of each step from corner to corner. A low gain needs longer steps: if the next step
    begins before the acceleration has settled, the acceleration leaves the straight line between
    the corners. Longer steps carry the vehicle farther."""
    settle_s: Annotated[float, Field(ge=0.5, le=60.0)] = 3.0
    """Duration of the position hold at the end."""


class CircleConfig(Section):
    """Maneuver `circle`: laps at a steady speed, heading held."""

    radius_m: Annotated[float, Field(ge=0.1, le=1000.0)] = 3.0
    """Radius. The circle begins at the vehicle, and its centre lies north of it."""
    speed_m_s: Annotated[float, Field(ge=0.01, le=50.0)] = 2.0
    """Speed along the circle, with smooth acceleration at the beginning and braking at the end."""
    laps: Annotated[float, Field(ge=0.01, le=1000.0)] = 1.0
    """Number of laps, acceleration and braking included."""


class IdentifyConfig(Section):
    """Maneuver `identify`, flown by `companion identify`: doublets of body rates and of climb."""

    tilt_rate_deg_s: Annotated[float, Field(ge=15.0, le=180.0)] = 60.0
    """Roll and pitch rate of the larger doublets; the smaller ones have half the rate."""
    tilt_duration_s: Annotated[float, Field(ge=0.1, le=1.0)] = 0.25
    """Duration of the first part of a roll or pitch doublet. Rate times duration is the tilt."""
    yaw_rate_deg_s: Annotated[float, Field(ge=15.0, le=180.0)] = 50.0
    """Yaw rate of the larger doublet; the smaller one has half the rate."""
    yaw_duration_s: Annotated[float, Field(ge=0.2, le=3.0)] = 1.2
    """Duration of the first part of a yaw doublet, longer than for roll and pitch because yaw is
    slower.
    """
    climb_m_s2: Annotated[float, Field(ge=0.5, le=4.0)] = 2.0
    """Vertical acceleration of the doublets that measure the thrust."""
    climb_duration_s: Annotated[float, Field(ge=0.1, le=1.0)] = 0.25
    """Duration of the first part of a climb doublet. The vehicle rises climb_m_s2 · duration²."""
    settle_s: Annotated[float, Field(ge=1.0, le=60.0)] = 1.5
    """Duration of the position hold before each doublet and at the end."""

    tilt_rate = Si("tilt_rate_deg_s")
    yaw_rate = Si("yaw_rate_deg_s")
