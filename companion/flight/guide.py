"""Guidance at work: a timer that makes a fresh command from the newest position."""

import asyncio
from collections.abc import Callable
from math import nan

from companion.attitude import Quaternion, Target, heading, is_unit
from companion.flight.control_loop import Command, ControlLoop
from companion.guidance import (
    HoverThrust,
    Pose,
    PositionHold,
    Programme,
    Reference,
    VehicleMotion,
)
from companion.mavlink.samples import AttitudeSample
from companion.mavlink.state import VehicleState
from companion.recording.trace import FlightTrace

_LEVEL = Target(0.0, 0.0, 0.0)


class Guide:
    """Leaves a new `Command` with the control loop at a steady rate, while position is fresh.

    On the ground the command is idle. In the air and without a programme it damps the motion where
    the vehicle is; `hold` keeps a pose; `follow` flies a programme from it.

    Attributes:
        begun_at: when the programme began, s on our clock, or None.
        pose: the pose that is held, or None.
    """

    def __init__(
        self,
        loop: ControlLoop,
        hold: PositionHold,
        hover_thrust: HoverThrust,
        state: VehicleState,
        trace: FlightTrace,
        *,
        period: float,
        position_stale: float,
        clock: Callable[[], float],
    ) -> None:
        self.begun_at: float | None = None
        self.pose: Pose | None = None
        self._loop = loop
        self._hold = hold
        self._hover_thrust = hover_thrust
        self._state = state
        self._trace = trace
        self._period = period
        self._position_stale = position_stale
        self._clock = clock
        self._programme: Programme | None = None
        self._q: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def note_attitude(self, sample: AttitudeSample) -> None:
        """Keep the newest attitude that has a heading."""
        if is_unit(sample.q):
            self._q = sample.q

    def stand_by(self) -> None:
        """Hold nothing: idle on the ground, damp the motion in the air."""
        self.pose, self._programme, self.begun_at = None, None, None

    def hold_here(self) -> None:
        """Hold the present position and heading."""
        self.stand_by()
        self.pose = Pose(self._motion().position_ned, self._heading())

    def follow(self, programme: Programme) -> None:
        """Fly `programme` from the pose that is held."""
        if self.pose is None:
            self.hold_here()
        self._programme = programme
        self.begun_at = self._clock()

    @property
    def finished(self) -> bool:
        """Whether the programme has come to its end."""
        if self._programme is None or self.begun_at is None:
            return False
        return self._clock() - self.begun_at >= self._programme.duration

    async def run(self) -> None:
        """Make commands for ever; late ones are not made up for."""
        due = self._clock()
        while True:
            self.step()
            due = max(due + self._period, self._clock())
            await asyncio.sleep(due - self._clock())

    def step(self) -> None:
        """Make one command, unless position is too old to make it from."""
        now = self._clock()
        position = self._state.position
        if position is None or now - position.received > self._position_stale:
            self._hover_thrust.pause()
            return
        # In control a vehicle that says it has landed is the watch's matter: no thrust would make
        # it true.
        if self._state.landed and not self._loop.guarded:
            self._hover_thrust.pause()
            self._loop.command = Command(_LEVEL, 0.0, now, idle=True)
            return
        motion = self._motion()
        reference = self._reference(now, motion)
        target, down = self._hold.command(reference, motion)
        self._loop.command = Command(target, down, now, is_step=reference.coefficients is not None)
        if self._loop.guarded:
            self._hover_thrust.observe(position.vehicle_time, position.velocity_ned[2])
            measured_at = position.vehicle_time + (now - position.received)
            self._note_tracking(measured_at, reference, motion)
        else:
            self._hover_thrust.pause()  # nobody obeys our thrust: nothing to learn from it

    def _heading(self) -> float:
        return heading(self._q)

    def _motion(self) -> VehicleMotion:
        """The newest position, moved on by its age."""
        position = self._state.position
        if position is None:
            raise RuntimeError("guidance was asked to hold before any position came")
        age = self._clock() - position.received
        north, east, down = position.position_ned
        v_north, v_east, v_down = velocity = position.velocity_ned
        return VehicleMotion(
            (north + age * v_north, east + age * v_east, down + age * v_down), velocity
        )

    def _reference(self, now: float, motion: VehicleMotion) -> Reference:
        if self.pose is None:
            return Reference(motion.position_ned, heading=self._heading())
        if self._programme is None or self.begun_at is None:
            return Reference(self.pose.position_ned, heading=self.pose.heading)
        return self._programme.at(now - self.begun_at, self.pose)

    def _note_tracking(
        self, vehicle_time: float, reference: Reference, motion: VehicleMotion
    ) -> None:
        north, east, down = reference.position_ned
        if reference.coefficients is not None:
            north = east = nan  # open loop: only the height is meant
        self._trace.add_tracking(vehicle_time, (north, east, down), motion.position_ned)
