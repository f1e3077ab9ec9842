"""Command the vehicle from a coroutine: accelerations, references, attitudes or body rates."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import asynccontextmanager
from math import inf, isnan

from companion.api.commanded import checked_copy
from companion.api.program import failure_text, mark_error_retrieved
from companion.api.state import ConnectedFlight, State
from companion.attitude import BodyRates, Coefficients
from companion.guidance.finite import finite_vector
from companion.guidance.reference import (
    HorizontalCommand,
    HorizontalMode,
    Reference,
    TiltCommand,
    Vector,
    VerticalMode,
)
from companion.guidance.source import CommandedSource
from companion.safety.actions import FlightEnded

_ZERO_VECTOR = (0.0, 0.0, 0.0)


class Control:
    """The commands of a program while it has control; only the newest command is in force.

    Consecutive commands may be at most `deadman.target_stale_ms` apart. If commands stop, the
    autopilot holds the vehicle and control ends. Frames are world NED and body FRD, in SI units.

    Args:
        flight: the flight of the `Vehicle` whose method `control` makes this object.
        source: receives the references.
        control_end: done when control has ended.
    """

    def __init__(
        self, flight: ConnectedFlight, source: CommandedSource, control_end: asyncio.Future[None]
    ) -> None:
        self._flight, self._source, self._control_end = flight, source, control_end
        self._command: tuple[Reference, float, Vector | None] | None = None
        self._callback_posted = False
        self._start_state = self.state

    @property
    def state(self) -> State:
        """The newest state of the vehicle."""
        return self._flight.newest_state.state()

    async def states(self, seconds: float = inf) -> AsyncIterator[State]:
        """Yield the state at each new attitude sample; skip samples while the caller works.

        Args:
            seconds: time after which the iteration ends, s.

        Raises:
            FlightEnded: control has ended.
            ValueError: `seconds` is NaN.
        """
        if isnan(seconds):  # it would end the iteration before it begins
            raise ValueError("seconds must be a number, not nan")
        new_state = asyncio.Event()

        def wake(_: object) -> None:
            new_state.set()

        unsubscribe = self._flight.newest_state.subscribe(new_state.set)
        self._control_end.add_done_callback(wake)
        end_time = self._flight.loop.time() + seconds
        try:
            while self._flight.loop.time() < end_time:
                self._require_control()
                yield self.state
                new_state.clear()
                await new_state.wait()
        finally:
            unsubscribe()
            self._control_end.remove_done_callback(wake)

    def accelerate(self, acceleration_ned: Vector, heading: float | None = None) -> None:
        """Command an acceleration, which the vehicle reaches with its known linear response.

        Drag and wind are compensated. Neither position nor height is held: the caller must do that.

        Args:
            acceleration_ned: without gravity, m/s²; (0, 0, 0) keeps the velocity.
            heading: rad; None: the heading at which control began.

        Raises:
            ValueError: a number is missing or not finite; the previous command stays in force.
            FlightEnded: control has ended.
        """
        self.follow(
            Reference(
                self.state.position_ned,
                self.state.velocity_ned,  # the drag at this velocity is compensated
                acceleration_ned,
                heading=self._heading(heading),
                horizontal=HorizontalMode.ACCELERATION,
                vertical=VerticalMode.ACCELERATION,
            ),
            _ZERO_VECTOR,
        )

    def follow(self, reference: Reference, jerk_ned: Vector | None = None) -> None:
        """Command a reference: the position, velocity and acceleration wanted now.

        The vehicle follows it without lag. The reference is extrapolated until the next one comes.
        A vehicle far from the reference tilts as far as the limits allow; to fly to a distant
        place, use `Vehicle.go_to`.

        Args:
            reference: state that the vehicle should have now.
            jerk_ned: derivative of the reference's acceleration, m/s³; None: computed from the last
                two references.

        Raises:
            TypeError: the reference is no `Reference`.
            ValueError: a number is missing or not finite; the previous command stays in force.
            FlightEnded: control has ended.
        """
        # A program may write into its arrays after this call, so both are copied.
        reference = checked_copy(reference)
        jerk_ned = None if jerk_ned is None else finite_vector("jerk_ned", jerk_ned)
        self._require_control()
        self._command = reference, self._flight.loop.time(), jerk_ned
        if not self._callback_posted:  # else the callback posted before will take this command
            self._callback_posted = True
            self._flight.loop.post(self._post_command)

    def _post_command(self) -> None:
        """Give the newest command to guidance; called in the flight's loop."""
        self._callback_posted = False
        if self._command is not None:
            self._source.give(*self._command)
            self._flight.context.guidance_loop.step_at_once()

    def tilt(self, north: float, east: float, heading: float | None = None) -> None:
        """Command acceleration coefficients, and hold the height at which control began.

        Args:
            north: acceleration to the north divided by specific thrust (thrust per mass).
            east: acceleration to the east divided by specific thrust; sin(tilt) is
                √(north² + east²).
            heading: rad; None: the heading at which control began.

        Raises:
            ValueError: a number is missing or not finite; the previous command stays in force.
            FlightEnded: control has ended.
        """
        tilt = TiltCommand(Coefficients(north, east))
        self.follow(self._open_loop_reference(tilt, heading))

    def rotate(self, body_rates: BodyRates) -> None:
        """Command body rates, within the limits, and hold the height at which control began.

        Args:
            body_rates: roll, pitch, yaw, rad/s.

        Raises:
            ValueError: a number is missing or not finite; the previous command stays in force.
            FlightEnded: control has ended.
        """
        rates = BodyRates(*finite_vector("body_rates", body_rates))
        self.follow(self._open_loop_reference(rates, None))

    def _open_loop_reference(self, command: HorizontalCommand, heading: float | None) -> Reference:
        north, east, _ = self.state.position_ned
        return Reference(
            (north, east, self._start_state.position_ned[2]),
            heading=self._heading(heading),
            horizontal=command,
        )

    def _heading(self, heading: float | None) -> float:
        return self._start_state.heading if heading is None else heading

    def _require_control(self) -> None:
        self._flight.program.require_flight()
        if self._control_end.done():
            self._control_end.result()
            raise FlightEnded("this control has ended; begin another with `vehicle.control()`")


@asynccontextmanager
async def program_control(
    flight: ConnectedFlight, source: CommandedSource, control_end: asyncio.Future[None]
) -> AsyncGenerator[Control, None]:
    """Let the program command the vehicle while the block runs; see `Control`.

    Raises:
        FlightEnded: the flight ended before control began, or control ended early.
    """
    control_end.add_done_callback(mark_error_retrieved)
    try:
        while source.pose is None:  # guidance does not fly it yet
            done, _ = await asyncio.wait({control_end}, timeout=0.01)
            if done:
                control_end.result()
        yield Control(flight, source, control_end)
    except BaseException as error:
        if not isinstance(error, FlightEnded):
            flight.loop.post(source.fail, failure_text(source.name, error))
        raise
    finally:
        flight.loop.post(source.end)
        await asyncio.wait({control_end})
    control_end.result()
