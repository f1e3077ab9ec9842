"""What a trajectory demands of the vehicle: tilt, rates, thrust, speeds, room."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.trajectory.sample import Trajectory

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Motion:
    """A trajectory at (m,) times; vectors are (m, 3), NED, from where it begins."""

    times: Floats
    position: Floats
    velocity: Floats
    acceleration: Floats
    jerk: Floats
    heading_rate: Floats

    def slowed(self, factor: float) -> "Motion":
        """Of the trajectory stretched in time by `factor`."""
        return Motion(
            self.times * factor,
            self.position,
            self.velocity / factor,
            self.acceleration / factor**2,
            self.jerk / factor**3,
            self.heading_rate / factor,
        )


def sampled(trajectory: Trajectory, step: float) -> Motion:
    """The motion from beginning to end, at most `step` seconds apart."""
    times = np.linspace(0.0, trajectory.duration, int(np.ceil(trajectory.duration / step)) + 1)
    samples = [trajectory.at(time) for time in times.tolist()]
    position, velocity, acceleration, jerk, _, heading_rate = (
        np.array(column) for column in zip(*samples, strict=True)
    )
    return Motion(times, position, velocity, acceleration, jerk, heading_rate)


@dataclass(frozen=True, slots=True)
class Demand:
    """What the rotors must do for a motion, each (m,).

    The rotors have to give f = a + d·v − g; the body's vertical axis points along it, and turns
    with the part of ḟ = jerk + d·a that is across f. Differential flatness, as in Faessler, Franchi
    & Scaramuzza, RA-L 2018, for drag that is the same along all axes.

    Attributes:
        tilt: of f from the vertical, rad.
        tilt_rate: the roll-pitch rate, rad/s.
        thrust: specific, the length of f, m/s².
    """

    tilt: Floats
    tilt_rate: Floats
    thrust: Floats


def demand(motion: Motion, drag: float, gravity: float) -> Demand:
    """What a motion takes.

    Args:
        motion: in still air.
        drag: linear, per mass, 1/s.
        gravity: m/s².
    """
    force = motion.acceleration + drag * motion.velocity - np.array([0.0, 0.0, gravity])
    growth = motion.jerk + drag * motion.acceleration
    thrust = np.linalg.norm(force, axis=1)
    tilt = np.arctan2(np.hypot(force[:, 0], force[:, 1]), -force[:, 2])
    # Without thrust there is no axis that could turn, and the thrust itself is what is wrong.
    across = np.linalg.norm(np.cross(force, growth), axis=1)
    tilt_rate = np.divide(across, thrust**2, out=np.zeros_like(across), where=thrust > 0.0)
    return Demand(tilt, tilt_rate, thrust)
