"""The same way flown more slowly."""

from dataclasses import dataclass

from companion.guidance.trajectory.sample import Sample, Trajectory, Vector


@dataclass(frozen=True, slots=True)
class Slowed:
    """A trajectory stretched in time.

    Attributes:
        trajectory: as it was.
        factor: it lasts so many times as long.
    """

    trajectory: Trajectory
    factor: float

    @property
    def name(self) -> str:
        """That of the trajectory."""
        return self.trajectory.name

    @property
    def duration(self) -> float:
        """How long it lasts, s."""
        return self.factor * self.trajectory.duration

    @property
    def holds_heading(self) -> bool:
        """As the trajectory does."""
        return self.trajectory.holds_heading

    def check_times(self) -> list[float]:
        """Those of the trajectory, stretched."""
        return [self.factor * time for time in self.trajectory.check_times()]

    def at(self, time: float) -> Sample:
        """The sample `time` seconds after the beginning."""
        rate = 1.0 / self.factor
        sample = self.trajectory.at(time * rate)
        return Sample(
            sample.position,
            _scaled(sample.velocity, rate),
            _scaled(sample.acceleration, rate**2),
            _scaled(sample.jerk, rate**3),
            sample.heading,
            sample.heading_rate * rate,
        )


def _scaled(vector: Vector, by: float) -> Vector:
    return vector[0] * by, vector[1] * by, vector[2] * by
