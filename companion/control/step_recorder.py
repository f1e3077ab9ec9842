"""Records the steps of guidance, and names what guidance reads of the vehicle."""

from typing import Protocol

from companion.control.guidance_command import GuidanceCommand
from companion.control.step_rows import StepEntry, StepFlags, StepInput, StepOutput, StepRows
from companion.recording.recorder import FlightRecorder
from companion.vehicle.records import AttitudeTargetThrust, Battery, LocalPosition


class Telemetry(Protocol):
    """The telemetry that guidance reads; attributes as in `VehicleState`."""

    @property
    def position(self) -> LocalPosition | None:
        """The newest position."""
        ...

    @property
    def battery(self) -> Battery | None:
        """The newest state of the battery."""
        ...

    @property
    def attitude_target_thrust(self) -> AttitudeTargetThrust | None:
        """The newest thrust of the autopilot."""
        ...

    @property
    def height(self) -> float | None:
        """Height above home, m."""
        ...

    @property
    def armed(self) -> bool | None:
        """Whether the vehicle is armed; None: unknown."""
        ...


class Ground(Protocol):
    """Whether the vehicle stands on the ground, as `GroundContact` tells it."""

    @property
    def standing(self) -> bool:
        """Whether it stands on the ground."""
        ...

    @property
    def may_idle(self) -> bool:
        """Whether zero thrust is safe."""
        ...


class Clock(Protocol):
    """The vehicle's clock, as `VehicleClock` tells it."""

    @property
    def offset(self) -> float | None:
        """Vehicle time minus event-loop time, s, or None."""
        ...

    def age(self, vehicle_time: float, now: float) -> float | None:
        """Age at the event-loop time `now` of a message stamped with `vehicle_time`, s."""
        ...


class StepRecorder:
    """Records what each step of guidance read and made, if the flight is recorded.

    Args:
        recorder: of the flight, or None.
        state: telemetry that the steps read.
        vehicle_clock: the vehicle's clock.
    """

    def __init__(
        self, recorder: FlightRecorder | None, state: Telemetry, vehicle_clock: Clock
    ) -> None:
        self._recorder, self._state, self._vehicle_clock = recorder, state, vehicle_clock
        self._rows = StepRows()

    def step(
        self,
        flags: StepFlags,
        now: float,
        made: StepOutput | None,
        command: GuidanceCommand | None,
    ) -> None:
        """Record a step that began at `now`, s of event-loop time."""
        if self._recorder is None:
            return
        state = self._state
        read = StepInput(
            now,
            state.position,
            self._vehicle_clock.offset,
            state.battery,
            state.attitude_target_thrust,
            state.height,
            state.armed,
            flags,
        )
        self._recorder.add(now, self._rows.step, StepEntry(read, made, command))

    def action(self, now: float, name: str) -> None:
        """Record what a phase tells guidance to do at `now`, s of event-loop time."""
        if self._recorder is not None:
            self._recorder.action(now, name, self._vehicle_clock.offset)
