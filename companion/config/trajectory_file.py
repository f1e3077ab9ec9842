"""Trajectories as files: one shape in YAML, or a CSV table of samples."""

from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, model_validator

from companion.config.file_kinds import FileKind, require_kind
from companion.config.trajectory_notes import detour_notes, table_notes
from companion.config.trajectory_shapes import (
    Acceleration,
    CircleShape,
    FigureEightShape,
    HelixShape,
    HoverShape,
    LineShape,
    WaypointsShape,
)
from companion.files import yaml_file
from companion.files.yaml_file import ConfigError, Section
from companion.guidance.trajectory import (
    Frame,
    HeadingFrom,
    SampleOptions,
    Trajectory,
    TrajectoryError,
    from_samples,
    read_csv,
    reporting_numerical_errors,
)


class CsvShape(Section):
    """Samples in a CSV file, in the formats of Agilicious and other projects.

    Columns by name: t,p_x,p_y,p_z,q_w,…,v_x,…,a_lin_x,… or t,x,y,z,yaw,vx,…,ax,… in s, m and rad.
    """

    file: Path
    """The CSV file, relative to this one."""
    frame: Literal["enu", "nwu", "ned"] | None = None
    """Frame of the table. enu: x east, y north, z up (ROS). nwu: x north, y west, z up. ned: x
    north, y east, z down. null: the frame that a comment before the header names
    (`# frame: ned`), else enu. The trajectory begins at the vehicle, wherever the file begins.
    """
    heading: Literal["file", "fixed", "along"] = "file"
    """file: the table's yaw or quaternion, if it has one. fixed: the heading at the start. along:
    facing along the path.
    """
    cutoff_hz: Annotated[float, Field(ge=0.5, le=50.0)] = 5.0
    """Cutoff of the smoothing filter; faster changes are taken as noise or rounding."""
    acceleration_m_s2: Acceleration = 3.0
    """Acceleration of the ramp that is added where the table begins or ends in motion: from rest to
    the table's speed, or from this speed to rest."""

    def read(self, folder: Path) -> "LoadedTrajectory":
        """The trajectory of this section, with notes on how a table was read.

        Raises:
            TrajectoryError: the trajectory cannot be made; the message names the file.
        """
        path = folder / self.file
        table = read_csv(path)
        frame = self._frame(table.frame, path)
        options = SampleOptions(
            frame or Frame.ENU, HeadingFrom(self.heading), self.cutoff_hz, self.acceleration_m_s2
        )
        try:
            trajectory = from_samples(table, options, self.file.stem)
        except TrajectoryError as error:
            raise TrajectoryError(f"{path}: {error}") from error
        return LoadedTrajectory(trajectory, table_notes(path, frame, table, trajectory))

    def _frame(self, table_frame: str | None, path: Path) -> Frame | None:
        """The frame that this section or the table names; None if neither does."""
        if table_frame is not None and table_frame not in {frame.value for frame in Frame}:
            known_frames = ", ".join(frame.value for frame in Frame)
            raise TrajectoryError(
                f"{path}: its frame {table_frame!r:.40} is not one of {known_frames}"
            )
        if None not in (self.frame, table_frame) and self.frame != table_frame:
            raise TrajectoryError(
                f"{path}: its comment says frame: {table_frame}, and csv.frame says {self.frame}; "
                "remove one of them"
            )
        frame = self.frame or table_frame
        return None if frame is None else Frame(frame)


class LoadedTrajectory(NamedTuple):
    """A trajectory from a file."""

    trajectory: Trajectory
    notes: tuple[str, ...] = ()
    """How a table was read, or how far a curve leaves the lines between its waypoints; one sentence
    each."""


class TrajectoryFile(Section):
    """A trajectory file (top level of the YAML). It must contain exactly one of the shapes."""

    hover: HoverShape | None = None
    line: LineShape | None = None
    circle: CircleShape | None = None
    helix: HelixShape | None = None
    figure_eight: FigureEightShape | None = None
    waypoints: WaypointsShape | None = None
    csv: CsvShape | None = None

    @model_validator(mode="after")
    def _require_one_shape(self) -> "TrajectoryFile":
        if len(self.model_fields_set) != 1:
            shape_names = ", ".join(type(self).model_fields)
            raise ValueError(f"give exactly one trajectory, one of: {shape_names}")
        return self

    def read(self, folder: Path) -> LoadedTrajectory:
        """The trajectory of the file; paths in it are relative to `folder`.

        Raises:
            TrajectoryError: the trajectory cannot be made.
        """
        if self.csv is not None:
            return self.csv.read(folder)
        (name,) = self.model_fields_set
        trajectory: Trajectory = getattr(self, name).trajectory()
        return LoadedTrajectory(trajectory, detour_notes(trajectory))


def is_table(path: Path) -> bool:
    """Whether a trajectory's file is a CSV table."""
    return path.suffix.lower() == ".csv"


def load_shape(path: Path) -> TrajectoryFile:
    """Load the shape that a YAML file describes.

    Raises:
        ConfigError: the file cannot be read, is of another kind, or holds an unknown key or a bad
            value.
    """
    contents = yaml_file.read(path, TrajectoryFile)
    require_kind(path, contents.keys, FileKind.TRAJECTORY)
    return yaml_file.validated(contents.keys, str(path), TrajectoryFile, contents.places)


def load(path: Path | str) -> Trajectory:
    """Load the trajectory of a file; see `read`.

    Raises:
        ConfigError: see `read`.
    """
    return read(Path(path)).trajectory


def read(path: Path) -> LoadedTrajectory:
    """Read a trajectory: a YAML file with one shape, or a CSV file with default settings.

    Raises:
        ConfigError: the file cannot be read, holds an unknown key or a bad value, or describes an
            impossible trajectory.
    """
    try:
        with reporting_numerical_errors():
            loaded_trajectory = (
                CsvShape(file=Path(path.name)).read(path.parent)
                if is_table(path)
                else load_shape(path).read(path.parent)
            )
            loaded_trajectory.trajectory.check_times()  # in the block, because it may overflow too
            return loaded_trajectory
    except TrajectoryError as error:
        # The errors of a table name it already.
        error_names_file = is_table(path) and str(error).startswith(str(path))
        raise ConfigError(str(error) if error_names_file else f"{path}: {error}") from error
