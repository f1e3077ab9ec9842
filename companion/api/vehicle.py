"""A vehicle that a program flies: each call runs phases of the flight and waits for their end."""

import asyncio
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path

from companion.api.control import Control, program_control
from companion.api.flight_loop import call_in_thread
from companion.api.program import unless_disarmed
from companion.api.state import ConnectedFlight, State
from companion.api.straight_path import straight_path
from companion.config import trajectory_file
from companion.flight.context import FlightContext
from companion.flight.control_phases import fly_commanded, fly_maneuvers
from companion.flight.maneuver_checks import (
    naming_trajectory_errors,
    require_followable,
    slowed_from,
)
from companion.flight.phase import Phase
from companion.flight.phases import (
    HAND_BACK,
    LANDING_PHASES,
    control_phase,
    handover_phases,
    takeoff_phases,
)
from companion.guidance import Maneuver, ManeuverSequence, Pose
from companion.guidance.finite import finite_number, finite_vector
from companion.guidance.follow import Follow, HeldHeadingManeuver, hover
from companion.guidance.reference import Vector, minus
from companion.guidance.source import CommandedSource
from companion.guidance.trajectory import Hover, Trajectory
from companion.guidance.trajectory.own_trajectory import checked_trajectory
from companion.recording.measurements.summary import Summary
from companion.safety.actions import Exit, FlightEnded

_START_TIMEOUT = 1.0
"""Longest time from the beginning of control to the first command, s."""


class Vehicle:
    """One vehicle for one flight; `companion.connect` makes it.

    Every coroutine raises `FlightEnded` once the flight has ended early, as by a pilot or a safety
    monitor. The vehicle is then handed back or landed. A call during another one raises
    `RuntimeError`.
    """

    def __init__(self, flight: ConnectedFlight) -> None:
        self._flight = flight

    @property
    def state(self) -> State:
        """The newest state of the vehicle.

        Raises:
            RuntimeError: no position or no attitude has come yet.
        """
        return self._flight.newest_state.state()

    @property
    def summary(self) -> Summary | None:
        """What was flown and measured, after the block of `connect`; None before."""
        return self._flight.program.summary

    async def take_off(self) -> None:
        """Arm where `flight.arm` allows it (else wait for the pilot), climb, and take over.

        The height is `flight.takeoff_height_m`. The preflight checks run before each step.

        Raises:
            FlightEnded: the flight has ended early, or the vehicle is already in the air; a
                vehicle in the air flies on.
        """
        self._flight.program.require_flight()
        if self._flight.context.loop.offboard_active or self._flight.context.link.state.flying:
            raise FlightEnded("the vehicle flies already", Exit.LEAVE)
        await self._request(
            lambda context: takeoff_phases(context.config.flight, context.link.autopilot)
        )

    async def take_over(self) -> None:
        """Wait until the pilot hands over in the air; check the vehicle, and take over.

        The pilot, or an earlier program, has left the vehicle in hold (GUIDED on ArduPilot) at
        `flight.takeoff_height_m` or higher. The wait is limited by `flight.arming_timeout_s`.

        Raises:
            FlightEnded: the flight has ended early, or the program controls the vehicle already
                (the vehicle then flies on).
        """
        self._flight.program.require_flight()
        if self._flight.context.loop.offboard_active:
            raise FlightEnded("the vehicle is under our control already", Exit.LEAVE)
        await self._request(lambda context: handover_phases(context.config.flight))

    async def hold(self, seconds: float) -> None:
        """Hold the position and the heading for a time, s.

        Raises:
            FlightEnded: the vehicle is not under the program's control.
            ValueError: the time is negative or not finite; nothing was flown.
        """
        if not finite_number("seconds", seconds) >= 0.0:
            raise ValueError(f"the time to hold must be 0 s or more, not {seconds:g}")
        await self._fly(hover(float(seconds)))

    async def go_to(
        self,
        position_ned: Vector,
        *,
        heading: float | None = None,
        speed: float | None = None,
        acceleration: float = 2.0,
        jerk: float = 4.0,
    ) -> None:
        """Fly a straight line to a position, from rest to rest, within the limits given here.

        If the vehicle is there already, it only turns to the heading.

        Args:
            position_ned: m, in the frame of `State.position_ned`.
            heading: rad; the vehicle turns to it before it leaves; None: the present heading.
            speed: largest speed, m/s; None: 2 m/s, or what the limits of climb, descent and speed
                allow in this direction if that is less.
            acceleration: largest acceleration, m/s².
            jerk: largest jerk, m/s³.

        Raises:
            ConfigError: the configured limits or the fence forbid the line; nothing was flown.
            FlightEnded: the vehicle is not under the program's control.
            TrajectoryError: a limit given here is not positive.
            ValueError: an argument is not finite, or the heading exceeds two turns.
        """
        displacement_ned = minus(
            finite_vector("position_ned", position_ned), self._held_pose().position_ned
        )
        config = self._flight.context.config
        path = straight_path(config, displacement_ned, heading, speed, acceleration, jerk)
        if heading is not None or isinstance(path, Hover):
            await self.follow(path)
        else:
            await self._fly(HeldHeadingManeuver(path))

    async def follow(self, trajectory: Trajectory | Path | str, *, slow_down: bool = False) -> None:
        """Follow a trajectory from the present position.

        Unless the trajectory holds the heading, the vehicle first turns to its initial heading.

        Args:
            trajectory: a trajectory, or the path of its file (the format of `flight.trajectory`).
            slow_down: fly slower where the trajectory breaks a limit, on the same path.

        Raises:
            ConfigError: the trajectory is unreadable, inconsistent, or breaks a limit or the fence.
            FlightEnded: the vehicle is not under the program's control.
            TypeError: `trajectory` is no trajectory.
            UserCodeError: code of the trajectory raised an error during the checks; nothing was
                flown.
        """
        if isinstance(trajectory, Path | str):
            trajectory = await call_in_thread(trajectory_file.load, Path(trajectory))
        else:
            with naming_trajectory_errors(str(getattr(trajectory, "name", ""))):
                trajectory = await call_in_thread(checked_trajectory, trajectory)
        if slow_down:
            config, drag = self._flight.context.config, self._flight.context.known_drag
            trajectory = await call_in_thread(
                slowed_from, config, trajectory, self._trajectory_start(), drag
            )
        await self._fly(Follow(trajectory, self._flight.context.config.limits.max_yaw_rate))

    @asynccontextmanager
    async def control(self, name: str = "the program") -> AsyncGenerator[Control, None]:
        """Command the vehicle from this coroutine while the block runs.

        After the block the vehicle stops and holds. If commands stop for longer than
        `deadman.target_stale_ms` or the block raises, the vehicle is handed back; the flight ends.

        Args:
            name: name of the commanding program in the list of events.

        Raises:
            FlightEnded: the vehicle is not under the program's control when the block begins.
        """
        self._held_pose()  # raises if the vehicle is not under our control
        source = CommandedSource(
            name, self._flight.context.config.deadman.target_stale, _START_TIMEOUT
        )
        work = partial(fly_commanded, commands=source)
        phase = control_phase("control", f"{name} to end its control", work)
        control_end = self._request(lambda _: (phase,))
        async with program_control(self._flight, source, control_end) as control:
            yield control

    async def land(self) -> None:
        """Let the autopilot land where the vehicle is; after touchdown the flight ends.

        A disarmed vehicle is left as it is: a program may land in its `finally`.
        """
        await self._request(unless_disarmed(LANDING_PHASES), ends_flight=True)

    async def hand_back(self) -> None:
        """Let the autopilot hold the vehicle, unless it is disarmed; the flight ends."""
        await self._request(unless_disarmed((HAND_BACK,)), ends_flight=True)

    def _request(
        self, phases: Callable[[FlightContext], Sequence[Phase]], *, ends_flight: bool = False
    ) -> asyncio.Future[None]:
        """Request phases; the future is done when they have ended."""
        return self._flight.loop.start(
            self._flight.program.request(phases, ends_flight=ends_flight)
        )

    async def _fly(self, maneuver: Maneuver) -> None:
        context, start = self._flight.context, self._trajectory_start()
        await call_in_thread(
            require_followable, context.config, maneuver, start, context.known_drag
        )
        sequence = ManeuverSequence((maneuver,))
        work = partial(fly_maneuvers, sequence=sequence)
        await self._request(
            lambda _: (control_phase("maneuvers", "the maneuver to end", work, sequence.duration),)
        )

    def _trajectory_start(self) -> Vector:
        """Where the next trajectory begins, relative to the centre of the fence, m NED."""
        centre = self._flight.context.snapshot_builder.fence_centre_ned or (0.0, 0.0, 0.0)
        return minus(self._held_pose().position_ned, centre)

    def _held_pose(self) -> Pose:
        """The pose that guidance holds, or at which its present maneuver began.

        Raises:
            FlightEnded: the flight has ended, or the vehicle is not under the program's control.
        """
        self._flight.program.require_flight()
        pose = self._flight.context.guidance_loop.flown_source.pose
        if pose is None or not self._flight.context.loop.offboard_active:
            raise FlightEnded(
                "the vehicle is not under our control: take off first, or take over", Exit.LEAVE
            )
        return pose
