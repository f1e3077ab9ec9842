"""A flight whose phases a program asks for, one after the other."""

import asyncio
from collections import deque
from collections.abc import AsyncGenerator, Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any

from companion.flight.context import FlightContext
from companion.flight.phase import Phase
from companion.flight.phases import control_phase, opening_phases
from companion.guidance import ManeuverSequence
from companion.recording.measurements.summary import Summary
from companion.safety.actions import FlightEnded

_WAITING_TEXT = "the program's next call"
_CANCELLED_TEXT = "the program cancelled its request"


@dataclass(slots=True, eq=False)
class PhaseRequest:
    """Phases that the program asked for.

    Attributes:
        phases: function that returns the phases for the flight's context.
        ends_flight: whether the flight ends after these phases.
        done: set when the last of these phases has ended.
    """

    phases: Callable[[FlightContext], Sequence[Phase]]
    ends_flight: bool = False
    done: asyncio.Future[None] = field(
        default_factory=lambda: asyncio.get_running_loop().create_future()
    )


class ProgramPlan:
    """The plan of a flight that runs the phases a program requests, and waits between requests.

    Between requests in the air, the vehicle holds its position if it is under the program's
    control, and the safety monitors stay active.

    Attributes:
        maneuvers: empty, because the program's maneuvers are not known before the flight.
        connected: receives the flight's context when the preflight checks have passed.
        summary: summary of the flight, available after it has ended.
        is_over: whether the flight has no further phases, because the last request is done or the
            flight has ended.
        finished: set when the flight has ended and its files are written.
        interrupt: function that ends the flight; its argument is the reason in words
            (`Session.interrupt`).
        end_reason: function that returns why the flight ends early, or None
            (`Session.end_reason`).
    """

    def __init__(self) -> None:
        self.maneuvers = ManeuverSequence(())
        self.connected: asyncio.Future[FlightContext] = asyncio.get_running_loop().create_future()
        self.summary: Summary | None = None
        self.is_over = False
        self.interrupt: Callable[[str], object] = lambda _: None
        self.end_reason: Callable[[], str | None] = lambda: None
        self._waiting_requests: deque[PhaseRequest] = deque()
        self._running_request: PhaseRequest | None = None
        self._new_request = asyncio.Event()
        self._end_error: Exception | None = None
        self._cancelled = False
        self.finished = asyncio.Event()

    async def phases(self, context: FlightContext) -> AsyncGenerator[Phase, None]:
        """The opening phases, then the requested ones, until the last request is done."""
        if self._running_request is not None:  # the checks are repeated, and then this request
            self._waiting_requests.appendleft(self._running_request)
        for phase in opening_phases(context.config.flight):
            yield phase
        if not self.connected.done():
            self.connected.set_result(context)
        while True:
            if not self._waiting_requests:
                yield self._waiting_phase(context)
            self._running_request = request = self._waiting_requests.popleft()
            for phase in request.phases(context):
                yield phase
            self._running_request, self.is_over = None, request.ends_flight
            if not request.done.done():
                request.done.set_result(None)
            if request.ends_flight:
                return

    async def request(
        self, phases: Callable[[FlightContext], Sequence[Phase]], *, ends_flight: bool = False
    ) -> None:
        """Run phases, given as in `PhaseRequest`, and wait until they have ended.

        Cancelling this call ends the flight, whether the phases run already or not.

        Raises:
            FlightEnded: the flight has ended; the program does not control the vehicle any more.
            RuntimeError: an earlier request has not ended yet.
        """
        if self.end_error is not None:
            await self.finished.wait()
            self.require_flight()
        if self.has_requests:
            raise RuntimeError("another call on this vehicle has not ended yet: await it first")
        request = PhaseRequest(phases, ends_flight)
        self._waiting_requests.append(request)
        self._new_request.set()
        try:
            await request.done
        except asyncio.CancelledError:
            if request in self._waiting_requests:
                self._waiting_requests.remove(request)
            self._cancelled = True
            self.interrupt(_CANCELLED_TEXT)
            raise

    @property
    def end_error(self) -> Exception | None:
        """The exception that every later call raises; None: the flight continues."""
        if self._end_error is not None:
            return self._end_error
        reason = self.end_reason() or (_CANCELLED_TEXT if self._cancelled else None)
        return None if reason is None else FlightEnded(reason)

    def require_flight(self) -> None:
        """Raise `end_error` if the flight is ending or has ended."""
        error = self.end_error
        if error is not None:
            raise error

    @property
    def has_requests(self) -> bool:
        """Whether a request is waiting or running."""
        return self._running_request is not None or bool(self._waiting_requests)

    def end(self, error: Exception) -> None:
        """Note that the flight has ended; calls that wait, and all later ones, raise `error`."""
        self._end_error, self.is_over = error, True
        if not self.connected.done():
            self.connected.set_exception(error)
            self.connected.exception()  # no warning of asyncio if the program was cancelled
        for request in (self._running_request, *self._waiting_requests):
            if request is not None and not request.done.done():
                request.done.set_exception(error)
                request.done.exception()  # no warning of asyncio if nobody waits for it any more

    def _waiting_phase(self, context: FlightContext) -> Phase:
        if context.loop.offboard_active:
            return control_phase("hold", _WAITING_TEXT, self._next_request, inf)
        return Phase("stand by", _WAITING_TEXT, self._next_request, inf)

    async def _next_request(self, context: FlightContext) -> None:
        context.waiting_for = _WAITING_TEXT
        while not self._waiting_requests:
            self._new_request.clear()
            await self._new_request.wait()


def unless_disarmed(phases: Sequence[Phase]) -> Callable[[FlightContext], Sequence[Phase]]:
    """A function for `ProgramPlan.request`: returns `phases`, or none for a disarmed vehicle."""
    return lambda context: () if context.link.state.armed is False else phases


def flight_ended(result: str) -> FlightEnded:
    """The exception for calls after the end of a flight whose summary has this `result`."""
    return FlightEnded("the flight is over" if result == "ok" else result)


def mark_error_retrieved(future: asyncio.Future[Any]) -> None:
    """Done-callback that retrieves the error, so that asyncio does not warn about it."""
    if not future.cancelled():
        future.exception()


def failure_text(name: str, error: BaseException) -> str:
    """A clause that says how the program `name` failed: cancelled, connection dropped, or error."""
    if isinstance(error, asyncio.CancelledError):
        return f"{name} was cancelled"
    if isinstance(error, GeneratorExit):  # as when the cell of a notebook runs once more
        return f"{name} dropped its connection"
    return f"{name} raised {error!r}"
