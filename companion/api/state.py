"""The state of the vehicle as a program sees it."""

from collections.abc import Callable
from typing import NamedTuple

from companion.api.flight_loop import FlightLoop
from companion.api.program import ProgramPlan
from companion.attitude import BodyRates, Quaternion
from companion.attitude.representation import heading
from companion.flight.context import FlightContext
from companion.guidance.reference import Vector


class State(NamedTuple):
    """The vehicle at one instant.

    The jumps by estimator resets are removed from position and heading, but not from the tilt.

    Attributes:
        time: event-loop time of the flight, s.
        position_ned: position from the origin of the autopilot's local frame, m.
        velocity_ned: m/s.
        q: attitude, body to world, w first.
        body_rates: rad/s, about body x, y, z (FRD).
        heading: heading, rad, clockwise from north: the rotation about the vertical that remains
            without the tilt; it differs from the Euler yaw in tilted attitudes.
        height: height above home, m, as the autopilot reports it, so it may jump; None: unknown.
    """

    time: float
    position_ned: Vector
    velocity_ned: Vector
    q: Quaternion
    body_rates: BodyRates
    heading: float
    height: float | None


class NewestState:
    """Publishes each new state; made in the flight's loop, read in any thread."""

    def __init__(self, context: FlightContext, loop: FlightLoop) -> None:
        self._newest_state: State | None = None
        self._context, self._loop = context, loop
        self._pending_calls: tuple[_PendingCall, ...] = ()
        context.link.subscribe("ATTITUDE_QUATERNION", self._publish)

    def state(self) -> State:
        """The newest state.

        Raises:
            RuntimeError: no position or no attitude has come yet.
        """
        if self._newest_state is None:
            raise RuntimeError("no position or no attitude has come from the vehicle yet")
        return self._newest_state

    def subscribe(self, callback: Callable[[], object]) -> Callable[[], None]:
        """Call `callback` in the program's loop after each new state; return a function to stop it.

        States do not queue up while the program is busy.
        """
        pending_call = _PendingCall(self._loop, callback)
        self._pending_calls = (*self._pending_calls, pending_call)

        def unsubscribe() -> None:
            self._pending_calls = tuple(
                each for each in self._pending_calls if each is not pending_call
            )

        return unsubscribe

    def _publish(self, _: object) -> None:
        context, guidance = self._context, self._context.guidance_loop
        sample = context.loop.resets.newest_attitude
        try:
            motion = guidance.motion_now()
        except RuntimeError:  # no position yet
            return
        if sample is None:
            return
        q = guidance.attitude()
        self._newest_state = State(
            self._loop.time(),
            motion.position_ned,
            motion.velocity_ned,
            q,
            sample.body_rates,
            heading(q),
            context.link.state.height,
        )
        for wake in self._pending_calls:
            wake()


class ConnectedFlight(NamedTuple):
    """A flight after its preflight checks, as `Vehicle` and `Control` use it."""

    program: ProgramPlan
    """Takes the program's requests."""
    context: FlightContext
    """Context of the flight; the program only reads it."""
    newest_state: NewestState
    loop: FlightLoop


class _PendingCall:
    """Calls a function in the program's loop; a call is dropped while an earlier one is pending."""

    def __init__(self, loop: FlightLoop, callback: Callable[[], object]) -> None:
        self._loop, self._callback, self._pending = loop, callback, False

    def __call__(self) -> None:
        if not self._pending:
            self._pending = True
            self._loop.post_to_program(self._run)

    def _run(self) -> None:
        self._pending = False
        self._callback()
