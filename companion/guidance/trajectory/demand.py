"""What a trajectory demands of the vehicle: tilt, tilt rate and thrust."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.drag import Drag
from companion.guidance.trajectory.sample import Trajectory, TrajectoryError
from companion.guidance.trajectory.septic_spline import Floats
from companion.guidance.trajectory.time_laws import Progress, derivatives


@dataclass(frozen=True, slots=True)
class Motion:
    """A motion at (m,) times; vectors are (m, 3), NED, from where it starts; SI units, radians."""

    times: Floats
    position: Floats
    velocity: Floats
    acceleration: Floats
    jerk: Floats
    heading_rate: Floats

    def retimed(self, times: Floats, progress: Progress) -> "Motion":
        """The same path, flown at other times.

        Args:
            times: (m,), new time of each row, s.
            progress: the time of this motion as a function of the new time, with derivatives, at
                each of `times`; (m,).
        """
        velocity, acceleration, jerk = derivatives(
            progress, columns(self.velocity), columns(self.acceleration), columns(self.jerk)
        )
        return Motion(
            times,
            self.position,
            np.stack(velocity, axis=1),
            np.stack(acceleration, axis=1),
            np.stack(jerk, axis=1),
            self.heading_rate * progress.first_derivative,
        )

    def slowed(self, factor: "float | Floats") -> "Motion":
        """The motion, slower by `factor`: one number for all times, or one for each, (m,)."""
        return self.retimed(self.times * factor, Progress(0.0, 1.0 / factor))  # type: ignore[arg-type]


def sampled_motion(trajectory: Trajectory, times: Sequence[float] | None = None) -> Motion:
    """Sample a trajectory at `times` (s); None: at its check times.

    Raises:
        TrajectoryError: the trajectory is too long to be checked.
        FloatingPointError: a value is not finite; see `reporting_numerical_errors`.
    """
    times = trajectory.check_times() if times is None else times
    samples = [trajectory.at(time) for time in times]
    position, velocity, acceleration, jerk, heading, heading_rate = (
        np.array(column) for column in zip(*samples, strict=True)
    )
    motion = Motion(np.array(times), position, velocity, acceleration, jerk, heading_rate)
    require_finite(motion)
    _require_all_finite(heading)
    return motion


def require_finite(motion: Motion) -> None:
    """Check that all numbers are finite. No limit would refuse NaN: comparisons with it are false.

    Raises:
        FloatingPointError: a value is not finite; see `reporting_numerical_errors`.
        TrajectoryError: an array has another number of rows than `times`.
    """
    count = len(motion.times)
    vectors = (motion.position, motion.velocity, motion.acceleration, motion.jerk)
    shapes = [np.shape(vector) for vector in vectors]
    if any(shape != (count, 3) for shape in shapes) or np.shape(motion.heading_rate) != (count,):
        raise TrajectoryError(
            f"a motion at {count} times has vectors of the shape ({count}, 3) and {count} heading "
            f"rates, not {shapes} and {np.shape(motion.heading_rate)}"
        )
    _require_all_finite(*vectors, motion.heading_rate)


def _require_all_finite(*arrays: Floats) -> None:
    for array in arrays:
        if not np.isfinite(array).all():
            raise FloatingPointError("not a finite number")


@dataclass(frozen=True, slots=True)
class Demand:
    """Tilt, tilt rate and thrust that a motion needs; each array is (m,).

    The rotors must produce the specific thrust f = a + d − g, where d is the deceleration by drag.
    The body's vertical axis points along f, and turns with the part of ḟ = jerk + ḋ that is
    perpendicular to f: differential flatness as in Faessler, Franchi & Scaramuzza, RA-L 2018, for
    drag that is the same along all axes.

    Attributes:
        tilt: angle between f and the vertical, rad.
        tilt_rate: the roll-pitch rate, rad/s.
        thrust: specific thrust, the length of f, m/s².
    """

    tilt: Floats
    tilt_rate: Floats
    thrust: Floats


def demand(motion: Motion, drag: Drag, gravity: float) -> Demand:
    """Thrust, tilt and tilt rate that a motion needs.

    Args:
        motion: motion in still air.
        drag: drag of the vehicle.
        gravity: gravity, m/s².
    """
    velocity, acceleration = columns(motion.velocity), columns(motion.acceleration)
    deceleration = np.stack(drag.deceleration(velocity), axis=1)
    force = motion.acceleration + deceleration - np.array([0.0, 0.0, gravity])
    force_rate = motion.jerk + np.stack(drag.deceleration_rate(velocity, acceleration), axis=1)
    thrust = np.linalg.norm(force, axis=1)
    tilt = np.arctan2(np.hypot(force[:, 0], force[:, 1]), -force[:, 2])
    # Without thrust there is no axis that could turn; the thrust limit then refuses the motion.
    cross = np.linalg.norm(np.cross(force, force_rate), axis=1)
    tilt_rate = np.divide(cross, thrust**2, out=np.zeros_like(cross), where=thrust > 0.0)
    return Demand(tilt, tilt_rate, thrust)


def columns(vectors: Floats) -> tuple[Floats, Floats, Floats]:
    """The components of vectors (m, 3): three arrays (m,)."""
    return vectors[:, 0], vectors[:, 1], vectors[:, 2]
