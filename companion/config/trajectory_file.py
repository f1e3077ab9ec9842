"""Trajectories as files: one shape in YAML, or a CSV table of samples."""

from math import radians
from pathlib import Path
from typing import Annotated, Literal, Protocol

from pydantic import Field, model_validator

from companion.files import yaml_file
from companion.files.yaml_file import ConfigError, Section
from companion.guidance.trajectory import (
    FARTHEST,
    FASTEST,
    LONGEST,
    Frame,
    HeadingFrom,
    Hover,
    Laps,
    SampleOptions,
    Trajectory,
    TrajectoryError,
    bernoulli_eight,
    circle,
    computable,
    from_samples,
    gerono_eight,
    helix,
    line,
    read_csv,
    waypoints,
)

Metres = Annotated[float, Field(ge=0.01, le=1000.0)]
Speed = Annotated[float, Field(ge=0.01, le=FASTEST)]
Acceleration = Annotated[float, Field(ge=0.01, le=100.0)]
Degrees = Annotated[float, Field(ge=-360.0, le=360.0)]
Offset = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]
Place = tuple[Offset, Offset, Offset]
FixedOrAlong = Literal["fixed", "along"]


class _Shape(Protocol):
    """A section that describes a trajectory; files that it names are relative to `folder`."""

    def trajectory(self, folder: Path) -> Trajectory: ...


class HoverShape(Section):
    """Stay where it begins."""

    duration_s: Annotated[float, Field(ge=0.01, le=LONGEST)]
    """Duration."""

    def trajectory(self, folder: Path) -> Trajectory:
        """What it describes."""
        return Hover(self.duration_s)


class LineShape(Section):
    """A straight line with limited jerk, rest to rest."""

    to_m: Place
    """The end: north, east, down of the start."""
    speed_m_s: Speed
    """Largest speed."""
    acceleration_m_s2: Acceleration = 3.0
    """Largest acceleration."""
    jerk_m_s3: Annotated[float, Field(ge=0.01, le=1000.0)] = 10.0
    """Largest jerk."""
    heading: FixedOrAlong = "fixed"
    """fixed: as it was at the start. along: facing along the path."""

    def trajectory(self, folder: Path) -> Trajectory:
        """What it describes."""
        along = self.heading == "along"
        return line(self.to_m, self.speed_m_s, self.acceleration_m_s2, self.jerk_m_s3, along)


class _Rounds(Section):
    """Keys of all figures that are flown in laps."""

    laps: Annotated[float, Field(ge=0.01, le=1000.0)] = 1.0
    """How often round, gathering and losing speed included."""
    acceleration_m_s2: Acceleration = 3.0
    """Largest along the path while speed is gathered or lost; too few laps take more."""
    direction_deg: Degrees = 0.0
    """Where the figure lies from the start, clockwise from north."""
    heading: FixedOrAlong = "fixed"
    """fixed: as it was at the start. along: facing along the path."""

    def _laps(self, speed: float) -> Laps:
        along = self.heading == "along"
        direction = radians(self.direction_deg)
        return Laps(speed, self.laps, self.acceleration_m_s2, direction, along)


class CircleShape(_Rounds):
    """A circle, anticlockwise from above; it begins and ends where the vehicle is."""

    radius_m: Metres
    """Radius; the centre lies in direction_deg of the start."""
    speed_m_s: Speed
    """Speed along it, once gathered."""

    def trajectory(self, folder: Path) -> Trajectory:
        """What it describes."""
        return circle(self.radius_m, self._laps(self.speed_m_s))


class HelixShape(CircleShape):
    """A circle that rises."""

    rise_m: Annotated[float, Field(ge=-1000.0, le=1000.0)]
    """Upwards in each lap; negative sinks."""

    def trajectory(self, folder: Path) -> Trajectory:
        """What it describes."""
        return helix(self.radius_m, self.rise_m, self._laps(self.speed_m_s))


class FigureEightShape(_Rounds):
    """A figure-eight about the start, its long side along direction_deg."""

    half_width_m: Metres
    """From the middle to a tip."""
    peak_speed_m_s: Speed
    """Speed at the fastest place: gerono, in the middle; bernoulli, at the tips."""
    shape: Literal["gerono", "bernoulli"] = "gerono"
    """gerono: (A sin φ, A sin φ cos φ). bernoulli: the same over 1 + cos² φ, with rounder loops.
    φ runs steadily."""

    def trajectory(self, folder: Path) -> Trajectory:
        """What it describes."""
        eight = gerono_eight if self.shape == "gerono" else bernoulli_eight
        return eight(self.half_width_m, self._laps(self.peak_speed_m_s))


class WaypointsShape(Section):
    """Through points without a stop, by minimum snap."""

    points_m: Annotated[tuple[Place, ...], Field(min_length=1, max_length=1000)]
    """north, east, down of the start; the start itself is not among them."""
    speed_m_s: Speed
    """Largest speed."""
    acceleration_m_s2: Acceleration = 3.0
    """Largest acceleration. The path is made as fast as this and the speed allow."""
    heading: FixedOrAlong = "fixed"
    """fixed: as it was at the start. along: facing along the path."""
    headings_deg: tuple[Degrees | None, ...] | None = None
    """Instead of `heading`: at each point, clockwise from north; null where it does not matter."""

    @model_validator(mode="after")
    def _one_heading(self) -> "WaypointsShape":
        if self.headings_deg is not None and "heading" in self.model_fields_set:
            raise ValueError("give either heading or headings_deg")
        return self

    def trajectory(self, folder: Path) -> Trajectory:
        """What it describes."""
        headings = [None if h is None else radians(h) for h in self.headings_deg or ()]
        along = self.heading == "along"
        return waypoints(self.points_m, self.speed_m_s, self.acceleration_m_s2, along, headings)


class CsvShape(Section):
    """Samples in a CSV file, as Agilicious and others publish them.

    Columns by name: t,p_x,p_y,p_z,q_w,…,v_x,…,a_lin_x,… or t,x,y,z,yaw,vx,…,ax,… in s, m and rad.
    """

    file: Path
    """The CSV file, relative to this one."""
    frame: Literal["enu", "nwu", "ned"] = "enu"
    """In which it is given. enu: x east, y north, z up (ROS). nwu: x north, y west, z up. ned: x
    north, y east, z down. The trajectory begins where the vehicle is, wherever the file does."""
    heading: Literal["file", "fixed", "along"] = "file"
    """file: its yaw or quaternion, if it has one. fixed: as at the start. along: along the path."""
    cutoff_hz: Annotated[float, Field(ge=0.5, le=50.0)] = 5.0
    """What is quicker is taken for noise or rounding, and smoothed."""
    acceleration_m_s2: Acceleration = 3.0
    """With which speed is gathered or lost where the file begins or ends in motion."""

    def trajectory(self, folder: Path) -> Trajectory:
        """What it describes.

        Raises:
            TrajectoryError: as always, but the file named in it.
        """
        path = folder / self.file
        options = SampleOptions(
            Frame(self.frame), HeadingFrom(self.heading), self.cutoff_hz, self.acceleration_m_s2
        )
        table = read_csv(path)
        try:
            return from_samples(table, options, self.file.stem)
        except TrajectoryError as error:
            raise TrajectoryError(f"{path}: {error}") from error


class TrajectoryFile(Section):
    """One trajectory; the top level of the YAML file. Exactly one of the shapes."""

    hover: HoverShape | None = None
    line: LineShape | None = None
    circle: CircleShape | None = None
    helix: HelixShape | None = None
    figure_eight: FigureEightShape | None = None
    waypoints: WaypointsShape | None = None
    csv: CsvShape | None = None

    @model_validator(mode="after")
    def _one_shape(self) -> "TrajectoryFile":
        if len(self.model_fields_set) != 1:
            known = ", ".join(type(self).model_fields)
            raise ValueError(f"give exactly one trajectory, one of: {known}")
        return self

    def trajectory(self, folder: Path) -> Trajectory:
        """What it describes; files that it names are relative to `folder`.

        Raises:
            TrajectoryError: no such trajectory can be made.
        """
        (name,) = self.model_fields_set
        shape: _Shape = getattr(self, name)
        return shape.trajectory(folder)


def load(path: Path) -> Trajectory:
    """Read a trajectory: a YAML file of one shape, or a CSV file with the defaults of `csv`.

    Raises:
        ConfigError: it cannot be read, holds an unknown key or a bad value, or describes what
            cannot be made.
    """
    is_table = path.suffix.lower() == ".csv"
    try:
        with computable():
            trajectory = (
                CsvShape(file=Path(path.name)).trajectory(path.parent)
                if is_table
                else yaml_file.load(path, TrajectoryFile).trajectory(path.parent)
            )
            trajectory.check_times()
            return trajectory
    except TrajectoryError as error:
        named = is_table and str(error).startswith(str(path))  # a table's own errors name it
        raise ConfigError(str(error) if named else f"{path}: {error}") from error
