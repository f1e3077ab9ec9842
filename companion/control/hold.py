"""Ends a maneuver or a commanded motion by a hold: the vehicle brakes, and holds where it stops."""

from dataclasses import dataclass, field
from math import degrees, tan

from companion.attitude import Quaternion
from companion.attitude.kinematics import tilt_angle
from companion.control.command_maker import CommandMaker
from companion.control.flown_source import FlownSource
from companion.control.hover_learning import HoverLearning
from companion.guidance import GRAVITY, VehicleMotion
from companion.guidance.braking import (
    AssumedBraking,
    Braking,
    acceleration_beside_wind,
    brake,
    brake_upwind,
)
from companion.guidance.reference import NorthEast


@dataclass(eq=False)
class Hold:
    """Begins a hold on request, or when open-loop body rates tilt the vehicle too far."""

    _flown_source: FlownSource
    """What guidance flies; the hold replaces it."""
    _command_maker: CommandMaker
    """Provides the estimated motion of the vehicle."""
    _learning: HoverLearning
    """Learns the hover thrust, which limits the tilt at which the height is held."""
    max_tilt: float
    """Largest tilt in open loop, rad."""
    _assumed_braking: AssumedBraking
    """Reaction time and deceleration that the monitors of the fence assume."""
    give_up_reason: str | None = field(default=None, init=False)
    """Why a source was given up because of its tilt, or None."""

    def begin(self, now: float, heading: float) -> None:
        """Brake, and hold this heading (rad) at the place where the vehicle stops.

        If the vehicle already brakes for a hold, that hold and its heading are kept.

        Raises:
            RuntimeError: no position has come yet.
        """
        if self._flown_source.remaining_braking_time(now) > 0.0:
            return  # a new braking would stop the vehicle further away
        inputs = self._command_maker.guidance_input(now)
        motion, (north, east, _) = inputs.present, inputs.present.velocity_ned
        acceleration_by_tilt = GRAVITY * tan(self._largest_tilt())
        acceleration = acceleration_beside_wind(
            acceleration_by_tilt, (north, east), inputs.disturbance
        )
        self._flown_source.hold(brake(now, motion, heading, acceleration, self._assumed_braking))

    def move_upwind(self, now: float, wind: NorthEast) -> None:
        """Move the hold upwind by the drift to expect when the autopilot takes over.

        The drift is that of `handover_drift`. Nothing changes if no hold has begun, or if the hold
        moves upwind already.
        """
        braking = self._flown_source.braking
        if isinstance(braking, Braking):
            self._flown_source.hold(brake_upwind(now, braking, wind))

    def begin_if_tilted(
        self, now: float, motion: VehicleMotion, q: Quaternion, heading: float
    ) -> None:
        """Give up a source that commands body rates, and hold, if `q` is tilted too far."""
        name = self._flown_source.source_commanding_rates(now, motion)
        if name is None:
            return
        tilt, largest_tilt = tilt_angle(q[1], q[2]), self._largest_tilt()
        if tilt <= largest_tilt:
            return
        limit = f"limits.max_tilt_deg = {degrees(largest_tilt):.0f}"
        if largest_tilt < self.max_tilt:
            limit = (
                f"the {degrees(largest_tilt):.0f}° at which limits.max_thrust just holds the height"
            )
        self.give_up_reason = (
            f"{name} was ended, because the vehicle tilts by {degrees(tilt):.0f}°, more than "
            f"{limit}"
        )
        self.begin(now, heading)

    def _largest_tilt(self) -> float:
        return min(self.max_tilt, self._learning.largest_tilt())
