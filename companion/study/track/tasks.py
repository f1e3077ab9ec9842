"""The tasks of the study: trajectories, speeds, planners and winds."""

from typing import Any, NamedTuple

from companion.attitude import PLANNER_NAMES
from companion.attitude.planner import FIRST_ORDER, MODEL_FOLLOWING

CIRCLE, EIGHT = "circle", "figure-eight"
RADIUS_M, HALF_WIDTH_M = 5.0, 3.0
CALM, WINDY = 0.0, 3.0
"""Mean wind, m/s."""
LINEAR, PREDICTIVE = "linear", "nmpc"
GUIDANCES = (LINEAR, PREDICTIVE)
"""Values of the configuration's `guidance.kind`."""
_PLANNERS_IN_WIND = (MODEL_FOLLOWING, FIRST_ORDER)


class TrajectoryAtSpeed(NamedTuple):
    """A trajectory at one speed, from rest to rest."""

    shape: str
    """`CIRCLE` or `EIGHT`."""
    speed: float
    """Steady speed on the circle, largest speed on the figure-eight, m/s."""
    laps: float
    """Number of laps, enough for the vehicle to hold the speed for a while."""

    def __str__(self) -> str:
        return f"{self.shape}, {self.speed:g} m/s"

    @property
    def file_content(self) -> dict[str, Any]:
        """Content of the trajectory file."""
        if self.shape == CIRCLE:
            return {"circle": {"radius_m": RADIUS_M, "speed_m_s": self.speed, "laps": self.laps}}
        figure_eight = {
            "half_width_m": HALF_WIDTH_M,
            "peak_speed_m_s": self.speed,
            "laps": self.laps,
        }
        return {"figure_eight": figure_eight}


class Task(NamedTuple):
    """The conditions of one flight."""

    trajectory: TrajectoryAtSpeed
    """The trajectory and its speed."""
    planner: str
    """Name of the planner."""
    guidance: str = LINEAR
    """`LINEAR` or `PREDICTIVE`."""
    wind: float = CALM
    """Mean wind with gusts, m/s; 0: still air."""
    lead: bool = True
    """Whether linear guidance compensates the response of the attitude loop (`guidance.lead`)."""

    def __str__(self) -> str:
        wind = f" in {self.wind:g} m/s of wind" if self.wind else ""
        guidance = "" if self.guidance == LINEAR else f", {self.guidance}"
        lead = "" if self.lead else ", without lead"
        return f"{self.trajectory}, {self.planner}{guidance}{lead}{wind}"


CIRCLE_AT_5, EIGHT_AT_5 = TrajectoryAtSpeed(CIRCLE, 5.0, 2.0), TrajectoryAtSpeed(EIGHT, 5.0, 2.0)
CIRCLES = (
    TrajectoryAtSpeed(CIRCLE, 1.0, 0.5),
    TrajectoryAtSpeed(CIRCLE, 3.0, 1.0),
    CIRCLE_AT_5,
    TrajectoryAtSpeed(CIRCLE, 7.0, 3.0),
)
EIGHTS = (TrajectoryAtSpeed(EIGHT, 1.0, 1.0), TrajectoryAtSpeed(EIGHT, 3.0, 1.0), EIGHT_AT_5)
TRAJECTORIES = (*CIRCLES, *EIGHTS)


def planners(guidance: str) -> tuple[str, ...]:
    """The planners that fly with this guidance in still air; with predictive guidance only one."""
    return PLANNER_NAMES if guidance == LINEAR else (MODEL_FOLLOWING,)


def tasks() -> tuple[Task, ...]:
    """All flights of the study.

    Linear guidance flies every planner in still air, two planners in wind, and one planner without
    lead in still air and in wind. Predictive guidance flies one planner in still air.
    """
    calm_tasks = [
        Task(trajectory, planner, guidance)
        for trajectory in TRAJECTORIES
        for guidance in GUIDANCES
        for planner in planners(guidance)
    ]
    windy_tasks = [
        Task(trajectory, planner, LINEAR, WINDY)
        for trajectory in TRAJECTORIES
        for planner in _PLANNERS_IN_WIND
    ]
    tasks_without_lead = [
        Task(trajectory, MODEL_FOLLOWING, LINEAR, wind, lead=False)
        for trajectory in TRAJECTORIES
        for wind in (CALM, WINDY)
    ]
    return (*calm_tasks, *windy_tasks, *tasks_without_lead)
