"""Command the vehicle from a coroutine: accelerations, references, attitudes or body rates."""

import asyncio
from collections.abc import AsyncIterator
from itertools import chain
from math import inf, isfinite

from companion.api.state import State, state_of
from companion.attitude import BodyRates, Coefficients
from companion.flight.context import FlightContext
from companion.guidance.reference import Reference, Vector
from companion.guidance.source import CommandedSource
from companion.safety.actions import FlightEnded

_NOWHERE = (0.0, 0.0, 0.0)
_AXES = 3


class Control:
    """What a program commands while it has control; the newest command counts.

    Each command must follow the one before within `deadman.target_stale_ms`. If they stop, the
    vehicle is held and handed back. Frames are world NED and body FRD, in SI units.

    Args:
        context: of the flight.
        source: takes the references.
        flown: is done when control has ended.
    """

    def __init__(
        self, context: FlightContext, source: CommandedSource, flown: asyncio.Task[None]
    ) -> None:
        self._context, self._source, self._flown = context, source, flown
        self._clock = asyncio.get_running_loop().time
        self._began = self.state

    @property
    def state(self) -> State:
        """The newest state of the vehicle."""
        return state_of(self._context, self._clock())

    async def states(self, seconds: float = inf) -> AsyncIterator[State]:
        """The state at each new attitude sample, for a time; samples that come meanwhile are left.

        Args:
            seconds: after which the iteration ends.

        Raises:
            FlightEnded: control has ended.
        """
        news = asyncio.Event()

        def wake(_: object) -> None:
            news.set()

        unsubscribe = self._context.link.subscribe("ATTITUDE_QUATERNION", wake)
        self._flown.add_done_callback(wake)
        until = self._clock() + seconds
        try:
            while self._clock() < until:
                self._require_control()
                yield self.state
                news.clear()
                await news.wait()
        finally:
            unsubscribe()
            self._flown.remove_done_callback(wake)

    def accelerate(self, acceleration_ned: Vector, heading: float | None = None) -> None:
        """Command an acceleration, which the vehicle reaches with its known linear response.

        Drag and wind are compensated. Neither position nor height is held: that is up to you.

        Args:
            acceleration_ned: without gravity, m/s²; (0, 0, 0) keeps the velocity.
            heading: rad; None: the one with which control began.

        Raises:
            ValueError: a number is not finite or missing; the newest command still counts.
            FlightEnded: control has ended.
        """
        self.follow(
            Reference(
                self.state.position_ned,
                self.state.velocity_ned,  # its drag is compensated
                acceleration_ned,
                heading=self._heading(heading),
                drifting=True,
                holds_height=False,
            ),
            _NOWHERE,
        )

    def follow(self, reference: Reference, jerk_ned: Vector | None = None) -> None:
        """Command a reference: position, velocity and acceleration as they should be now.

        It is followed without lag, and moves on by itself until the next one comes. A reference
        far from the vehicle makes it turn as hard as the limits allow: `Vehicle.go_to` is for that.

        Args:
            reference: for now.
            jerk_ned: rate of its acceleration, m/s³; None: by the difference from the one before.

        Raises:
            ValueError: a number is not finite or missing; the newest command still counts.
            FlightEnded: control has ended.
        """
        _require_usable(reference, jerk_ned or _NOWHERE)
        self._require_control()
        self._source.give(reference, self._clock(), jerk_ned)
        self._context.guidance_loop.step_soon()

    def tilt(self, north: float, east: float, heading: float | None = None) -> None:
        """Command acceleration coefficients, and hold the height at which control began.

        Args:
            north: horizontal acceleration to the north per specific thrust.
            east: likewise to the east; sin(tilt) is √(north² + east²).
            heading: rad; None: the one with which control began.

        Raises:
            ValueError: a number is not finite or missing; the newest command still counts.
            FlightEnded: control has ended.
        """
        self.follow(self._open_loop(heading)._replace(coefficients=Coefficients(north, east)))

    def rotate(self, body_rates: BodyRates) -> None:
        """Command body rates, within the limits, and hold the height at which control began.

        Args:
            body_rates: roll, pitch, yaw, rad/s.

        Raises:
            ValueError: a number is not finite or missing; the newest command still counts.
            FlightEnded: control has ended.
        """
        self.follow(self._open_loop(None)._replace(body_rates=BodyRates(*body_rates)))

    def _open_loop(self, heading: float | None) -> Reference:
        north, east, _ = self.state.position_ned
        return Reference((north, east, self._began.position_ned[2]), heading=self._heading(heading))

    def _heading(self, heading: float | None) -> float:
        return self._began.heading if heading is None else heading

    def _require_control(self) -> None:
        if self._flown.done():
            self._flown.result()
            raise FlightEnded("the program has ended its control")


def _require_usable(reference: Reference, jerk_ned: Vector) -> None:
    """Check that vectors have three components, and that all numbers are finite.

    Raises:
        ValueError: one has not, or is not.
    """
    vectors = [
        reference.position_ned,
        reference.velocity_ned,
        reference.acceleration_ned,
        reference.body_rates or _NOWHERE,
        jerk_ned,
    ]
    if any(len(vector) != _AXES for vector in vectors):
        raise ValueError(f"a vector must have three components, not as in {reference}")
    values = [
        *chain.from_iterable(vectors),
        reference.heading,
        reference.heading_rate,
        *(reference.coefficients or ()),
        *(() if reference.thrust is None else (reference.thrust,)),
    ]
    if not all(map(isfinite, values)):
        raise ValueError(f"a command must be finite, not {reference}")
