"""Linear guidance: follows a reference without lag, because it compensates the tilt's delay."""

from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple, Protocol

from companion.attitude import Coefficients, Target
from companion.drag import ROUND_BODY, AxisDrag, Drag
from companion.guidance.feedback import HeightGains, HorizontalGains, acceleration_down
from companion.guidance.inner_response import InnerResponse
from companion.guidance.reference import (
    GRAVITY,
    HorizontalMode,
    NorthEast,
    Reference,
    ReferenceAt,
    TiltCommand,
    Vector,
    VehicleMotion,
    clamp_length,
)
from companion.guidance.thrust import acceleration_within_thrust


@dataclass(frozen=True, slots=True)
class LinearSettings:
    """Settings of linear guidance.

    Attributes:
        gains: gains of the horizontal feedback.
        height: gains of the height hold.
        tilt: response of the acceleration coefficients to their targets.
        heading: response of the heading to its target.
        max_horizontal_acceleration: largest horizontal acceleration that is commanded, m/s².
        thrust_lag: lag of the rotors, s.
        period: period of the guidance loop, s; within it the target moves, but the feedback is
            constant.
    """

    gains: HorizontalGains
    height: HeightGains
    tilt: InnerResponse
    heading: InnerResponse
    max_horizontal_acceleration: float
    thrust_lag: float
    period: float = 0.0


class GuidanceInput(NamedTuple):
    """Input of one guidance step.

    Attributes:
        present: present motion.
        predicted: motion predicted for the time when the present command takes effect.
        thrust: horizontal acceleration by the present thrust, m/s², NED.
        disturbance: horizontal acceleration by wind and bias, m/s², NED.
        drag: drag of the vehicle.
        thrust_limits: smallest and largest specific thrust available, m/s².
        axis_drag: how the drag along the body's axes differs from `drag`.
    """

    present: VehicleMotion
    predicted: VehicleMotion
    thrust: NorthEast
    disturbance: NorthEast
    drag: Drag
    thrust_limits: tuple[float, float]
    axis_drag: AxisDrag = ROUND_BODY

    @property
    def acceleration(self) -> NorthEast:
        """Present horizontal acceleration by thrust, wind and drag, m/s², NED."""
        north, east = self.deceleration(self.present.velocity_ned)
        return (
            self.thrust[0] + self.disturbance[0] - north,
            self.thrust[1] + self.disturbance[1] - east,
        )

    def deceleration(self, velocity: Vector) -> NorthEast:
        """Horizontal deceleration by drag, m/s², at a velocity in m/s, NED."""
        north, east, _ = self.drag.deceleration(velocity)
        axis_north, axis_east = self.axis_drag.deceleration(velocity[0], velocity[1])
        return north + axis_north, east + axis_east


class LinearCommand(NamedTuple):
    """Output of one guidance step.

    Attributes:
        target: the planner's target now.
        later_target: the target one period later; between the two the target moves on a straight
            line.
        acceleration_down: wanted vertical acceleration by thrust and gravity, m/s², positive down.
    """

    target: Target
    later_target: Target
    acceleration_down: float


class Guidance(Protocol):
    """Turns a reference into a target and a vertical acceleration, once in each period."""

    @property
    def effect_delay(self) -> float:
        """Mean delay from computing a command until its feedback takes effect, s.

        `GuidanceInput.predicted` is the motion after this delay.
        """

    def command(
        self, reference_at: ReferenceAt, time: float, inputs: GuidanceInput
    ) -> LinearCommand:
        """Compute the command of one guidance step; see `LinearGuidance.command`."""


class Trim:
    """Mean of the planner's target coefficients in the latest pause of the position hold.

    In a pause the reference's `horizontal` is `HorizontalMode.ACCELERATION`. The mean balances wind
    and the error of the estimated attitude. Guidance adds the mean to an open-loop command, so that
    the vehicle gets the commanded acceleration in spite of wind and attitude error.
    """

    def __init__(self) -> None:
        self._sum = 0j
        self._count = 0
        self._was_pausing = False

    def add(self, target: Target, *, is_pausing: bool) -> None:
        """Take the target of a closed-loop guidance step; each new pause begins a new mean."""
        if is_pausing:
            if not self._was_pausing:
                self._sum, self._count = 0j, 0
            self._sum += complex(target.north, target.east)
            self._count += 1
        self._was_pausing = is_pausing

    def coefficients(self, command: TiltCommand) -> Coefficients:
        """The open-loop coefficients to fly: those commanded, plus the mean if `trimmed`."""
        self._was_pausing = False
        if not command.trimmed or self._count == 0:
            return command.coefficients
        mean = self._sum / self._count
        north, east = command.coefficients
        return Coefficients(north + mean.real, east + mean.imag)


class LinearGuidance:
    """Commands the reference's acceleration, plus feedback of position, velocity and acceleration.

    Drag and the observed disturbance are fed forward. The result is a path of coefficients.
    `InnerResponse.target` leads the target, so that the coefficients follow this path. Coefficients
    that the reference commands open loop become the target without lead and without feedback.
    """

    def __init__(self, settings: LinearSettings) -> None:
        self._settings = settings
        self._trim = Trim()

    def retune(self, settings: LinearSettings) -> None:
        """Use other settings from the next step on."""
        self._settings = settings

    @property
    def effect_delay(self) -> float:
        """Mean delay from computing a command until its feedback takes effect, s."""
        return self._settings.tilt.dead_time + 0.5 * self._settings.period

    def command(
        self, reference_at: ReferenceAt, time: float, inputs: GuidanceInput
    ) -> LinearCommand:
        """Compute the target and the vertical acceleration of one guidance step.

        `reference_at`: the reference over time; it is also read shortly before and after `time`.
        `time`: the present time, s.
        """
        reference, settings = reference_at(time), self._settings
        future_reference = reference_at(time + settings.thrust_lag)
        down = acceleration_down(
            settings.height, reference, inputs.present, future_reference, inputs.drag
        )
        period_ends = time, time + settings.period
        if isinstance(reference.horizontal, TiltCommand):
            north, east = self._trim.coefficients(reference.horizontal)
            target, later = (
                Target(north, east, *self._heading(reference_at, at)) for at in period_ends
            )
            return LinearCommand(target, later, down)
        feedback = self._feedback(reference, reference_at(time + self.effect_delay), inputs)

        def path(at: float) -> Coefficients:
            return self._coefficients(reference_at(at), feedback, down, inputs)

        target, later = (
            Target(*settings.tilt.target(path, at), *self._heading(reference_at, at))
            for at in period_ends
        )
        is_pausing = reference.horizontal is HorizontalMode.ACCELERATION
        self._trim.add(target, is_pausing=is_pausing)
        return LinearCommand(target, later, down)

    def _feedback(
        self, reference: Reference, at_effect: Reference, inputs: GuidanceInput
    ) -> NorthEast:
        """Horizontal acceleration that corrects errors and disturbance, m/s².

        `at_effect` is the reference at the time when the feedback takes effect.
        """
        settings, gains, wind = self._settings, self._settings.gains, inputs.disturbance
        if reference.horizontal is HorizontalMode.ACCELERATION:
            return clamp_length(-wind[0], -wind[1], settings.max_horizontal_acceleration)
        feedback, drag = [], inputs.deceleration(inputs.present.velocity_ned)
        for axis in (0, 1):
            position_error = inputs.predicted.position_ned[axis] - at_effect.position_ned[axis]
            velocity_error = inputs.predicted.velocity_ned[axis] - at_effect.velocity_ned[axis]
            acceleration = inputs.thrust[axis] - drag[axis] + wind[axis]
            feedback.append(
                -gains.position * position_error
                - gains.velocity * velocity_error
                - gains.acceleration * (acceleration - reference.acceleration_ned[axis])
                - wind[axis]
            )
        return clamp_length(feedback[0], feedback[1], settings.max_horizontal_acceleration)

    def _coefficients(
        self, reference: Reference, feedback: NorthEast, down: float, inputs: GuidanceInput
    ) -> Coefficients:
        """Coefficients for the acceleration of the reference plus `feedback` (m/s²).

        The drag at the velocity of the reference is compensated. `down` is the vertical
        acceleration of the command, m/s².
        """
        drag = inputs.deceleration(reference.velocity_ned)
        north, east = clamp_length(
            reference.acceleration_ned[0] + drag[0] + feedback[0],
            reference.acceleration_ned[1] + drag[1] + feedback[1],
            self._settings.max_horizontal_acceleration,
        )
        north, east, down = acceleration_within_thrust((north, east, down), *inputs.thrust_limits)
        # The vertical part of the thrust is g − a_D.
        vertical = GRAVITY - down
        thrust = sqrt(north * north + east * east + vertical * vertical)
        return Coefficients(north / thrust, east / thrust)

    def _heading(self, reference_at: ReferenceAt, time: float) -> tuple[float, float]:
        """Target heading (rad) and its rate (rad/s) that make the heading follow the reference."""
        return self._settings.heading.heading_target(lambda at: reference_at(at).heading, time)
