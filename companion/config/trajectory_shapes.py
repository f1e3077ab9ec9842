"""The built-in trajectory shapes, as sections of a YAML file."""

from math import radians
from typing import Annotated, Literal

from pydantic import Field, model_validator

from companion.files.yaml_file import Section
from companion.guidance.trajectory import (
    LARGEST_COORDINATE,
    LARGEST_SPEED,
    LONGEST_DURATION,
    Hover,
    Laps,
    Trajectory,
    bernoulli_eight,
    circle,
    gerono_eight,
    helix,
    line,
    straight_legs,
    waypoints,
)

Metres = Annotated[float, Field(ge=0.01, le=1000.0)]
Speed = Annotated[float, Field(ge=0.01, le=LARGEST_SPEED)]
Acceleration = Annotated[float, Field(ge=0.01, le=100.0)]
Jerk = Annotated[float, Field(ge=0.01, le=1000.0)]
Degrees = Annotated[float, Field(ge=-360.0, le=360.0)]
Offset = Annotated[float, Field(ge=-LARGEST_COORDINATE, le=LARGEST_COORDINATE)]
Point = tuple[Offset, Offset, Offset]
FixedOrAlong = Literal["fixed", "along"]


class HoverShape(Section):
    """Hover at the start."""

    duration_s: Annotated[float, Field(ge=0.01, le=LONGEST_DURATION)]
    """Duration of the hover."""

    def trajectory(self) -> Trajectory:
        """The trajectory of this shape."""
        return Hover(self.duration_s)


class LineShape(Section):
    """A straight line with limited jerk, rest to rest."""

    to_m: Point
    """End point: north, east, down from the start."""
    speed_m_s: Speed
    """Largest speed."""
    acceleration_m_s2: Acceleration = 3.0
    """Largest acceleration."""
    jerk_m_s3: Jerk = 10.0
    """Largest jerk."""
    heading: FixedOrAlong = "fixed"
    """fixed: the heading at the start. along: facing along the path."""

    def trajectory(self) -> Trajectory:
        """The trajectory of this shape."""
        face_path = self.heading == "along"
        return line(self.to_m, self.speed_m_s, self.acceleration_m_s2, self.jerk_m_s3, face_path)


class _LapShape(Section):
    """Keys of all shapes with laps."""

    laps: Annotated[float, Field(ge=0.01, le=1000.0)] = 1.0
    """Number of laps, acceleration and braking included."""
    acceleration_m_s2: Acceleration = 3.0
    """Largest acceleration and braking along the path; exceeded if the laps are too short for it.
    """
    direction_deg: Degrees = 0.0
    """Direction from the start in which the figure lies, clockwise from north."""
    heading: FixedOrAlong = "fixed"
    """fixed: the heading at the start. along: facing along the path."""

    def _laps(self, speed: float) -> Laps:
        face_path = self.heading == "along"
        direction = radians(self.direction_deg)
        return Laps(speed, self.laps, self.acceleration_m_s2, direction, face_path)


class CircleShape(_LapShape):
    """A circle, anticlockwise from above; it begins and ends where the vehicle is."""

    radius_m: Metres
    """Radius; the centre lies in direction_deg from the start."""
    speed_m_s: Speed
    """Speed along the path after acceleration."""

    def trajectory(self) -> Trajectory:
        """The trajectory of this shape."""
        return circle(self.radius_m, self._laps(self.speed_m_s))


class HelixShape(CircleShape):
    """A circle that rises."""

    rise_m: Annotated[float, Field(ge=-1000.0, le=1000.0)]
    """Climb in each lap; negative: descent."""

    def trajectory(self) -> Trajectory:
        """The trajectory of this shape."""
        return helix(self.radius_m, self.rise_m, self._laps(self.speed_m_s))


class FigureEightShape(_LapShape):
    """A figure-eight about the start, its long side along direction_deg."""

    half_width_m: Metres
    """Distance from the middle to a tip."""
    peak_speed_m_s: Speed
    """Speed at the fastest point: the middle for gerono, the tips for bernoulli."""
    shape: Literal["gerono", "bernoulli"] = "gerono"
    """gerono: A sin φ along direction_deg, A sin φ cos φ across it; A is half_width_m. bernoulli:
    both divided by 1 + cos² φ, with rounder loops. Between acceleration and braking, φ increases at
    a constant rate."""

    def trajectory(self) -> Trajectory:
        """The trajectory of this shape."""
        eight = gerono_eight if self.shape == "gerono" else bernoulli_eight
        return eight(self.half_width_m, self._laps(self.peak_speed_m_s))


class WaypointsShape(Section):
    """A path through waypoints: minimum snap without stops, or straight legs with stops."""

    points_m: Annotated[tuple[Point, ...], Field(min_length=1, max_length=1000)]
    """Waypoints: north, east, down from the start; the start itself is left out."""
    speed_m_s: Speed
    """Largest speed."""
    acceleration_m_s2: Acceleration = 3.0
    """Largest acceleration. The path is flown as fast as acceleration_m_s2 and speed_m_s allow."""
    stops: bool = False
    """true: straight lines between the points, with a stop at each. false: one smooth curve through
    all points, which leaves the straight lines; the flight reports by how much."""
    jerk_m_s3: Jerk = 10.0
    """Largest jerk on straight lines; the smooth curve does not use it."""
    heading: FixedOrAlong = "fixed"
    """fixed: the heading at the start. along: facing along the path; only without stops."""
    headings_deg: tuple[Degrees | None, ...] | None = None
    """Instead of `heading`: heading at each point, clockwise from north; null: any heading."""

    @model_validator(mode="after")
    def _require_one_heading(self) -> "WaypointsShape":
        if self.headings_deg is not None and "heading" in self.model_fields_set:
            raise ValueError("give either heading or headings_deg")
        if self.stops and self.heading == "along":
            raise ValueError(
                "with `heading: along` the vehicle would turn on the spot at each stop; use "
                "`headings_deg`"
            )
        return self

    def trajectory(self) -> Trajectory:
        """The trajectory of this shape."""
        headings = [None if h is None else radians(h) for h in self.headings_deg or ()]
        limits = self.speed_m_s, self.acceleration_m_s2
        if self.stops:
            return straight_legs(self.points_m, *limits, self.jerk_m_s3, headings)
        return waypoints(self.points_m, *limits, self.heading == "along", headings)
