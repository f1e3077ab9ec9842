"""A client's setpoints as a source of guidance."""

from collections.abc import Callable
from contextlib import suppress

from companion.attitude import coefficients, heading
from companion.control.estimator_resets import EstimatorResets
from companion.guidance.reference import (
    Pose,
    Reference,
    ReferenceAt,
    ThrustCommand,
    TiltCommand,
    VehicleMotion,
)
from companion.serve.fence_guard import FenceGuard
from companion.serve.ownership import ControlState, Ownership
from companion.serve.setpoints.approach import UnplannableError
from companion.serve.setpoints.motion import CommandedMotion
from companion.serve.setpoints.request import (
    AttitudeRequest,
    AxisDemand,
    MotionRequest,
    RatesRequest,
    Request,
)

_FLOWN_STATES = frozenset({ControlState.LIVE, ControlState.HOLDING})


class ServedSource:
    """Flies the requests of the client in control; stops and holds while the client is silent.

    Requests are in the autopilot's frame, references in the frame without estimator resets.

    Attributes:
        name: shown to the user.
        start_pose: pose of the vehicle when control began; None before.
        resets: jumps of the autopilot's estimate, which are removed from requests.
        fence_guard: stops motions in front of the fence; None: motions are not stopped.
        failure: always None; a silent client does not count as a failure.
    """

    failure: str | None = None

    def __init__(
        self,
        name: str,
        motion: CommandedMotion,
        ownership: Ownership,
        heading_now: Callable[[], float],
    ) -> None:
        self.name = name
        self.start_pose: Pose | None = None
        self.resets = EstimatorResets()
        self.fence_guard: FenceGuard | None = None
        self._motion, self._ownership, self._heading_now = motion, ownership, heading_now
        self._vehicle_motion = VehicleMotion((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._open_loop_reference: Reference | None = None  # a commanded attitude or body rates
        self._waiting_request: Request | None = None
        self._motion_request: MotionRequest | None = None
        self._allowed_request: MotionRequest | None = None  # `_motion_request` inside the fence
        self._is_stopped = False

    def begin(self, now: float, pose: Pose) -> None:
        """Start from `pose`, with the newest request unless the client is silent."""
        self.start_pose = pose
        is_live = self._ownership.state(now) is ControlState.LIVE
        self._ownership.begin(now)
        self._vehicle_motion = VehicleMotion(pose.position_ned, (0.0, 0.0, 0.0))
        self._motion.begin(pose.position_ned, (0.0, 0.0, 0.0), pose.heading, now)
        if self._waiting_request is not None and is_live:
            with suppress(UnplannableError):  # hold; the client's next setpoint gets a refusal
                self.give(self._waiting_request, now)

    def give(self, request: Request, now: float) -> None:
        """Fly a request from now on; before `begin`, keep it.

        Raises:
            UnplannableError: no motion fulfils the request; the previous request stays in force.
        """
        if self.start_pose is None:
            self._waiting_request = request
            return
        if isinstance(request, MotionRequest):
            reference_before = self._open_loop_reference
            self._end_open_loop(now)
            request_without_jumps = self._without_jumps(request)
            try:
                self._command(self._allowed_by_fence(request_without_jumps, now), now)
            except UnplannableError:
                self._open_loop_reference = reference_before
                raise
            self._motion_request = request_without_jumps
        else:
            self._motion_request = None
            self._open_loop_reference = self._make_open_loop_reference(request)
        self._is_stopped = False

    def reference(self, now: float, motion: VehicleMotion) -> ReferenceAt:
        """The reference over time; if the client is silent, the reference comes to rest."""
        self._vehicle_motion = motion
        if self._ownership.state(now) is not ControlState.LIVE and not self._is_stopped:
            self._end_open_loop(now)
            self._motion.stop(now, motion)
            self._is_stopped, self._motion_request = True, None
        self._keep_inside_fence(now)
        reference = self._open_loop_reference
        return self._motion.reference if reference is None else lambda _: reference

    def finished(self, now: float) -> bool:
        """Whether no client is in control any more: it released control, or was silent too long."""
        return self._ownership.state(now) not in _FLOWN_STATES

    def _command(self, allowed_request: MotionRequest, now: float) -> None:
        """Command the motion to a request that the fence allows."""
        self._motion.command(allowed_request, now, self._vehicle_motion)
        self._allowed_request = allowed_request

    def _keep_inside_fence(self, now: float) -> None:
        """Stop in front of the fence, or go on if the request leads back."""
        if self._motion_request is None:
            return
        allowed_request = self._allowed_by_fence(self._motion_request, now)
        if allowed_request != self._allowed_request:
            with suppress(UnplannableError):  # the previous motion stays in force
                self._command(allowed_request, now)

    def _allowed_by_fence(self, request: MotionRequest, now: float) -> MotionRequest:
        if self.fence_guard is None:
            return request
        reference = self._motion.reference(now)
        return self.fence_guard.keep_inside(request, reference, self._vehicle_motion, now)

    def _end_open_loop(self, now: float) -> None:
        """If an attitude or rates were flown, begin the commanded motion where the vehicle is."""
        if self._open_loop_reference is not None:
            self._open_loop_reference = None
            position, velocity = self._vehicle_motion
            self._motion.begin(position, velocity, self._heading_now(), now)

    def _make_open_loop_reference(self, request: AttitudeRequest | RatesRequest) -> Reference:
        position, heading_now = self._vehicle_motion.position_ned, self._heading_now()
        thrust = ThrustCommand(request.thrust)
        if isinstance(request, RatesRequest):
            return Reference(
                position, heading=heading_now, horizontal=request.rates, vertical=thrust
            )
        return Reference(
            position,
            heading=self.resets.frame.heading(heading(request.q)),
            heading_rate=request.yaw_rate,
            horizontal=TiltCommand(coefficients(request.q)),
            vertical=thrust,
        )

    def _without_jumps(self, request: MotionRequest) -> MotionRequest:
        """The request in the frame without estimator resets."""
        north, east, down = self.resets.position_shift
        return request._replace(
            horizontal=_without_shift(request.horizontal, (north, east)),
            vertical=_without_shift(request.vertical, (down,)),
            yaw=None if request.yaw is None else self.resets.frame.heading(request.yaw),
        )


def _without_shift(demand: AxisDemand, shift: tuple[float, ...]) -> AxisDemand:
    if demand.position is None:
        return demand
    position = tuple(a - b for a, b in zip(demand.position, shift, strict=True))
    return demand._replace(position=position)
