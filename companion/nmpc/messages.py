"""Requests to the solver's process and its answers; they are sent pickled."""

from enum import IntEnum
from typing import NamedTuple

from companion.attitude import BodyRates, Quaternion
from companion.drag import NO_DRAG, Drag
from companion.guidance.trajectory.sample import Vector
from companion.nmpc.reference import Start

READY_MESSAGE = b"ready"
"""First message of the solver's process, sent when it can take requests."""


class VehicleSnapshot(NamedTuple):
    """State of the vehicle at the time of a request."""

    time: float
    """Time of the state, s."""
    position: Vector
    """Position, m, NED."""
    velocity: Vector
    """Velocity, m/s, NED."""
    q: Quaternion
    """Attitude, body → world; must be a unit quaternion."""
    body_rates: BodyRates
    """Body rates, rad/s, FRD."""
    disturbance: Vector = (0.0, 0.0, 0.0)
    """Acceleration by wind and other unmodelled forces, m/s², NED."""
    drag: Drag = NO_DRAG
    axis_drag: float = 0.0
    """Coefficient of `AxisDrag`, 1/m."""


class ControlInput(NamedTuple):
    """A control input, commanded by predictive control or by linear guidance."""

    time: float
    """Time of the command, on the clock of `VehicleSnapshot.time`, s."""
    north: float
    east: float
    """`north` and `east`: acceleration coefficients of the target."""
    heading: float
    """Heading of the target, rad."""
    thrust: float
    """Specific thrust, m/s²."""


class Request(NamedTuple):
    """A problem to solve."""

    number: int
    """Number of the request; its answer has the same number."""
    vehicle: VehicleSnapshot
    trajectory_time: float
    """Time since the trajectory began, at `vehicle.time`, s."""
    start: Start
    inputs: tuple[ControlInput, ...]
    """Latest control inputs, in order of time; must cover the dead time before `vehicle.time`.
    The first input is assumed to have been in effect before its time, too. Without any input,
    attitude and vertical speed are assumed to be held."""


class Status(IntEnum):
    """How a solve ended."""

    SOLVED = 0
    FAILED = 1
    """The solver found no plan, or a number of the plan is not finite."""
    TILTED_TOO_FAR = 2
    """The tilt is larger than the models allow, now or when the answer would take effect; or the
    attitude is not a unit quaternion."""


class Answer(NamedTuple):
    """Answer to a request."""

    number: int
    status: Status
    """How the solve ended; unless it is `SOLVED`, target, thrust, `solver_seconds` and `iterations`
    are 0."""
    computed_at: float
    """Time at which the answer was computed, on the computer's monotonic clock, s."""
    time: float
    """Time at which to use the answer, on the clock of `VehicleSnapshot.time`, s."""
    north: float
    east: float
    """`north` and `east`: acceleration coefficients of the target."""
    heading: float
    """Heading of the target, rad, in (−π, π]."""
    thrust: float
    """Specific thrust, m/s²."""
    computing_seconds: float
    """Wall time of the computation, including prediction and reference, s."""
    solver_seconds: float
    """Processor time of the solver alone, s."""
    iterations: float
    """Number of SQP iterations."""
