"""Requests to the solver's process and its answers, and how they are packed in bytes."""

import struct
from enum import IntEnum
from typing import NamedTuple

from companion.attitude import BodyRates, Quaternion
from companion.drag import NO_DRAG, Drag
from companion.guidance.trajectory.sample import Vector
from companion.nmpc.reference import Start

READY = b"ready"
"""First message of the solver's process, sent when it can take requests."""

_REQUEST_HEAD = struct.Struct("<q25d")
_INPUT = struct.Struct("<5d")
_ANSWER = struct.Struct("<2q9d")


class Vehicle(NamedTuple):
    """State of the vehicle."""

    time: float
    """Time of the state, s."""
    position: Vector
    """m, NED."""
    velocity: Vector
    """m/s, NED."""
    q: Quaternion
    """Attitude, body → world; must be a unit quaternion."""
    body_rates: BodyRates
    """rad/s, FRD."""
    disturbance: Vector = (0.0, 0.0, 0.0)
    """Acceleration by wind and other unmodelled forces, m/s², NED."""
    drag: Drag = NO_DRAG
    """Estimated drag."""
    axis_drag: float = 0.0
    """Coefficient of `AxisDrag`, 1/m."""


class Input(NamedTuple):
    """A control input, commanded by predictive control or by linear guidance."""

    time: float
    """When it was commanded, on the clock of `Vehicle.time`, s."""
    north: float
    east: float
    """`north` and `east`: coefficients of the target."""
    heading: float
    """Heading of the target, rad."""
    thrust: float
    """Specific thrust, m/s²."""


class Request(NamedTuple):
    """A problem to solve."""

    number: int
    """Number of the request; its answer has the same number."""
    vehicle: Vehicle
    trajectory_time: float
    """Time since the trajectory began, at `vehicle.time`, s."""
    start: Start
    inputs: tuple[Input, ...]
    """Latest control inputs, in order of time. They must cover the dead time before `vehicle.time`.
    Before the first input, that input is assumed. If there is no input, attitude and vertical speed
    are assumed to be held."""


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
    """Number of the request."""
    status: Status
    """How the solve ended; unless it is `SOLVED`, target, thrust, `solver_seconds` and `iterations`
    are 0."""
    computed_at: float
    """When the answer was computed, on the computer's monotonic clock, s."""
    time: float
    """When to use the answer, on the clock of `Vehicle.time`, s."""
    north: float
    east: float
    """`north` and `east`: coefficients of the target."""
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


def pack_request(request: Request) -> bytes:
    """The bytes of a request."""
    vehicle, start = request.vehicle, request.start
    head = _REQUEST_HEAD.pack(
        request.number,
        request.trajectory_time,
        *start.position,
        start.heading_offset,
        vehicle.time,
        *vehicle.position,
        *vehicle.velocity,
        *vehicle.q,
        *vehicle.body_rates,
        *vehicle.disturbance,
        *vehicle.drag,
        vehicle.axis_drag,
    )
    return head + b"".join(_INPUT.pack(*one) for one in request.inputs)


def unpack_request(message: bytes) -> Request:
    """The request in these bytes."""
    number, at, *v = _REQUEST_HEAD.unpack_from(message)
    vehicle = Vehicle(
        v[4],
        (v[5], v[6], v[7]),
        (v[8], v[9], v[10]),
        (v[11], v[12], v[13], v[14]),
        BodyRates(v[15], v[16], v[17]),
        (v[18], v[19], v[20]),
        Drag(v[21], v[22]),
        v[23],
    )
    inputs = tuple(Input(*values) for values in _INPUT.iter_unpack(message[_REQUEST_HEAD.size :]))
    return Request(number, vehicle, at, Start((v[0], v[1], v[2]), v[3]), inputs)


def pack_answer(answer: Answer) -> bytes:
    """The bytes of an answer."""
    return _ANSWER.pack(*answer)


def unpack_answer(message: bytes) -> Answer:
    """The answer in these bytes."""
    number, status, *rest = _ANSWER.unpack(message)
    return Answer(number, Status(status), *rest)
