"""Requests to the solver's process and its answers, and their packed form (`struct`)."""

import struct
from enum import IntEnum
from typing import NamedTuple

from companion.attitude import BodyRates, Quaternion
from companion.drag import NO_DRAG, Drag
from companion.guidance.trajectory.sample import Vector
from companion.nmpc.reference import Start

READY = b"ready"
"""First message of the solver's process, once it takes requests."""

_HEAD = struct.Struct("<q24d")
_INPUT = struct.Struct("<5d")
_ANSWER = struct.Struct("<2q9d")


class Vehicle(NamedTuple):
    """State of the vehicle.

    Attributes:
        time: to which the state belongs, s.
        position: m, NED.
        velocity: m/s, NED.
        q: attitude, body → world; must be a unit quaternion.
        body_rates: rad/s, FRD.
        disturbance: acceleration by wind and whatever else is not modelled, m/s², NED.
        drag: as estimated so far.
    """

    time: float
    position: Vector
    velocity: Vector
    q: Quaternion
    body_rates: BodyRates
    disturbance: Vector = (0.0, 0.0, 0.0)
    drag: Drag = NO_DRAG


class Input(NamedTuple):
    """Control input of the vehicle from a time on, by predictive control or by linear guidance.

    Attributes:
        time: when it was commanded, on the clock of `Vehicle.time`, s.
        north, east: coefficients of the target.
        heading: rad.
        thrust: specific, m/s².
    """

    time: float
    north: float
    east: float
    heading: float
    thrust: float


class Request(NamedTuple):
    """A problem to solve.

    Attributes:
        number: of the request; its answer has the same.
        vehicle: its state.
        at: time along the trajectory that belongs to `vehicle.time`, s.
        start: of the trajectory.
        inputs: the latest, in order of time. They must reach back by dead time plus lead; before
            the first one, the same input is assumed.
    """

    number: int
    vehicle: Vehicle
    at: float
    start: Start
    inputs: tuple[Input, ...]


class Status(IntEnum):
    """How a solve ended."""

    SOLVED = 0
    FAILED = 1
    """The solver gave no plan."""
    TILTED_TOO_FAR = 2
    """The vehicle is tilted further than the models cover."""


class Answer(NamedTuple):
    """Answer to a request.

    Attributes:
        number: of the request.
        status: the rest is meaningful only if it is `SOLVED`.
        given_at: when it was computed, on the machine's monotonic clock, s.
        time: when to use it, on the clock of `Vehicle.time`, s.
        north, east: coefficients of the target.
        heading: rad, in (−π, π].
        thrust: specific, m/s².
        seconds: computing time, prediction and reference included.
        solving: processor time of the solver alone, s.
        iterations: of the SQP.
    """

    number: int
    status: Status
    given_at: float
    time: float
    north: float
    east: float
    heading: float
    thrust: float
    seconds: float
    solving: float
    iterations: float


def pack_request(request: Request) -> bytes:
    """The bytes of a request."""
    vehicle, start = request.vehicle, request.start
    head = _HEAD.pack(
        request.number,
        request.at,
        *start.position,
        start.turned,
        vehicle.time,
        *vehicle.position,
        *vehicle.velocity,
        *vehicle.q,
        *vehicle.body_rates,
        *vehicle.disturbance,
        *vehicle.drag,
    )
    return head + b"".join(_INPUT.pack(*one) for one in request.inputs)


def unpack_request(message: bytes) -> Request:
    """The request in these bytes."""
    number, at, *v = _HEAD.unpack_from(message)
    vehicle = Vehicle(
        v[4],
        (v[5], v[6], v[7]),
        (v[8], v[9], v[10]),
        (v[11], v[12], v[13], v[14]),
        BodyRates(v[15], v[16], v[17]),
        (v[18], v[19], v[20]),
        Drag(v[21], v[22]),
    )
    inputs = tuple(Input(*values) for values in _INPUT.iter_unpack(message[_HEAD.size :]))
    return Request(number, vehicle, at, Start((v[0], v[1], v[2]), v[3]), inputs)


def pack_answer(answer: Answer) -> bytes:
    """The bytes of an answer."""
    return _ANSWER.pack(*answer)


def unpack_answer(message: bytes) -> Answer:
    """The answer in these bytes."""
    number, status, *rest = _ANSWER.unpack(message)
    return Answer(number, Status(status), *rest)
