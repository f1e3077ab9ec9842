"""Stops a client's motion in front of the fence, so that the client stays in control.

Without this guard, the monitor `braking` would end the client's control, and land the vehicle where
it is.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import hypot, inf
from typing import NamedTuple

from companion.config import Config
from companion.guidance.fence import Breach, Fence, FenceCentre
from companion.guidance.reference import NorthEast, Reference, Vector, VehicleMotion, minus
from companion.safety.table import fence_of
from companion.serve.setpoints.motion import VERTICAL_ACCELERATION
from companion.serve.setpoints.request import AxisDemand, MotionRequest

_MARGIN = 0.5
"""Distance inside the fence at which the vehicle stops, m; covers the tracking error at rest."""
_BRAKING_LEAD = 0.7
"""Time by which the vehicle brakes earlier than the monitor `braking` requires, s. The deceleration
needs this time to build up, because the jerk is limited and the vehicle follows late. With the
errors of ArduPilot's estimator at 8 m/s, 0.6 s were too few."""
_REST_SPEED = 0.2
"""Speed below which a stop is complete, m/s. While a request leads outward, a stop once begun is
completed, because the vehicle would brake too late if stop and request alternated."""
_BRAKING_SHARE = 0.8
"""Deceleration assumed for a client's motions, as a share of their acceleration limit."""
_LOOKAHEAD = 10.0
"""Time over which a commanded velocity is extrapolated to a destination, s."""
_STEP_LENGTH = 0.1
"""Length of the step towards the destination that shows whether a request leads outward, m."""
_REPORT_PAUSE = 3.0
"""Time without a stop after which the next stop is reported, s."""

_HORIZONTAL_STOP = AxisDemand(None, (0.0, 0.0), None)
_VERTICAL_STOP = AxisDemand(None, (0.0,), None)


class FenceGuard:
    """Replaces the part of a request that would lead beyond the fence by a stop.

    Each step of guidance calls `keep_inside`. The vehicle comes to rest in front of the fence, and
    moves again as soon as a request leads back. Horizontal and vertical motion stop independently.

    Args:
        config: limits of the fence, and of clients' motions.
        centre: returns the centre of the fence in the frame without estimator resets; None: unknown
            yet.
        height: returns the height above home, m; None: unknown.
        wind: returns the acceleration that the wind gives a vehicle at rest, m/s², north and east.
        tell: called with a sentence when the vehicle is stopped.
    """

    def __init__(
        self,
        config: Config,
        centre: Callable[[], FenceCentre | None],
        height: Callable[[], float | None],
        wind: Callable[[], NorthEast],
        tell: Callable[[str], None],
    ) -> None:
        fence, acceleration = fence_of(config), config.serve.max_acceleration_m_s2
        self._horizontal_part = _FencePart(fence.walls, acceleration)
        self._vertical_part = _FencePart(fence.levels, min(acceleration, VERTICAL_ACCELERATION))
        self._centre, self._height, self._wind, self._tell = centre, height, wind, tell
        self._stopped_at = -inf

    def keep_inside(
        self, request: MotionRequest, reference: Reference, actual: VehicleMotion, now: float
    ) -> MotionRequest:
        """Return the request; a stop replaces each part that would lead beyond the fence.

        Args:
            request: command of the client.
            reference: state that is flown now.
            actual: motion of the vehicle.
            now: event-loop time, s.
        """
        centre, height = self._centre(), self._height()
        if centre is None:
            return request
        home_down = None if height is None else actual.position_ned[2] + height
        frame = _FenceFrame(centre, home_down, self._wind())
        north, east, _ = reference.acceleration_ned
        flown_state = _MotionState(reference.position_ned, reference.velocity_ned, (north, east))
        states = flown_state, _MotionState(*actual, (0.0, 0.0))
        horizontal_breach = self._horizontal_part.breach(
            [each.horizontal() for each in states],
            _destination(request.horizontal, flown_state.position, 0),
            frame,
        )
        vertical_breach = self._vertical_part.breach(
            [each.vertical() for each in states],
            _destination(request.vertical, flown_state.position, 2),
            frame,
        )
        breach = horizontal_breach or vertical_breach
        if breach is None:
            return request
        if now - self._stopped_at > _REPORT_PAUSE:
            self._tell(f"stopped in front of the fence: the setpoints lead to {breach}")
        self._stopped_at = now
        return request._replace(
            horizontal=request.horizontal if horizontal_breach is None else _HORIZONTAL_STOP,
            vertical=request.vertical if vertical_breach is None else _VERTICAL_STOP,
        )


class _FenceFrame(NamedTuple):
    """Where the fence lies."""

    centre: FenceCentre
    home_down: float | None
    """Coordinate down of home, m; None: unknown."""
    wind: NorthEast
    """Acceleration that the wind gives a vehicle at rest, m/s², north and east."""

    def breach(self, fence: Fence, position: Vector, margin: float) -> Breach | None:
        """The breach at a position, NED in the frame of `centre`; None: no breach."""
        return fence.breach(*self._fence_coordinates(position), self.centre.lat_lon, margin)

    def breach_of_stop(self, fence: Fence, state: "_MotionState", margin: float) -> Breach | None:
        """The breach at the place where the vehicle would stop from a state; None: no breach."""
        offset, height = self._fence_coordinates(state.position)
        return fence.breach_at_stopping_point(
            offset,
            state.velocity,
            height,
            self.centre.lat_lon,
            margin,
            state.acceleration,
            self.wind,
        )

    def _fence_coordinates(self, position: Vector) -> tuple[Vector, float | None]:
        height = None if self.home_down is None else self.home_down - position[2]
        return minus(position, self.centre.position_ned), height


class _MotionState(NamedTuple):
    """Position, velocity (NED) and horizontal acceleration; SI units."""

    position: Vector
    velocity: Vector
    acceleration: tuple[float, float]

    def horizontal(self) -> "_MotionState":
        """The state without its vertical motion."""
        north, east, _ = self.velocity
        return self._replace(velocity=(north, east, 0.0))

    def vertical(self) -> "_MotionState":
        """The state without its horizontal motion."""
        return _MotionState(self.position, (0.0, 0.0, self.velocity[2]), (0.0, 0.0))


class _Destination(NamedTuple):
    """The position to which a request leads, m NED."""

    position: Vector
    is_commanded: bool
    """Whether the request commands the position; otherwise the position is extrapolated."""


class _FencePart:
    """The horizontal limits of the fence (walls), or the vertical ones (floor and ceiling).

    Args:
        fence: the fence with only these limits.
        acceleration: largest horizontal or vertical acceleration of clients' motions, m/s².
    """

    def __init__(self, fence: Fence, acceleration: float) -> None:
        self._fence = replace(
            fence,
            deceleration=min(fence.deceleration, _BRAKING_SHARE * acceleration),
            reaction_time=fence.reaction_time + _BRAKING_LEAD,
        )
        self._breach_of_stop: Breach | None = None

    def breach(
        self, states: Sequence[_MotionState], destination: _Destination, frame: _FenceFrame
    ) -> Breach | None:
        """The breach to which a request leads, if the vehicle must stop now; None: no stop needed.

        Args:
            states: the state that is flown, and that of the vehicle.
            destination: where the request leads.
            frame: where the fence lies.
        """
        fence = self._fence
        leads_inside = frame.breach(fence, destination.position, 0.0) is None
        margin = 0.0 if destination.is_commanded and leads_inside else _MARGIN
        is_moving = hypot(*states[0].velocity) > _REST_SPEED
        if self._breach_of_stop is not None and is_moving and not leads_inside:
            return self._breach_of_stop
        breach = None
        for state in states:
            if frame.breach(fence, state.position, margin) is None:
                state_breach = frame.breach_of_stop(fence, state, margin)
            else:  # outside already, such as below the floor after a take-off
                state_breach = _worsened_breach(frame, fence, state.position, destination.position)
            breach = breach or state_breach
        self._breach_of_stop = breach
        return breach


def _worsened_breach(
    frame: _FenceFrame, fence: Fence, position: Vector, destination: Vector
) -> Breach | None:
    """The breach after a step towards the destination, if the step makes a breach worse."""
    offset = minus(destination, position)
    step_share = _STEP_LENGTH / max(hypot(*offset), _STEP_LENGTH)
    north, east, down = (a + step_share * b for a, b in zip(position, offset, strict=True))
    breach_here = frame.breach(fence, position, _MARGIN)
    breach_after_step = frame.breach(fence, (north, east, down), _MARGIN)
    if (
        breach_here is None
        or breach_after_step is None
        or breach_after_step.distance_outside <= breach_here.distance_outside
    ):
        return None
    return breach_after_step


def _destination(demand: AxisDemand, flown_position: Vector, first_axis: int) -> _Destination:
    """Position to which a demand leads along its axes, from `first_axis` (0: north, 2: down) on."""
    position = list(flown_position)
    if demand.position is not None:
        position[first_axis : first_axis + len(demand.position)] = demand.position
    else:
        for axis, value in enumerate(demand.velocity or demand.acceleration or (), first_axis):
            position[axis] += _LOOKAHEAD * value
    return _Destination((position[0], position[1], position[2]), demand.position is not None)
