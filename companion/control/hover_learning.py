"""Learns the hover thrust from the motion, the thrust setpoints and the battery voltage."""

from math import sin

from companion.attitude import Quaternion, Target
from companion.control.telemetry import Telemetry
from companion.guidance import GRAVITY, HoverThrust
from companion.guidance.reference import clamp_length
from companion.guidance.thrust import largest_tilt

_MIN_LEARNING_HEIGHT = 1.0
"""Height above home from which there is neither ground contact nor ground effect, m."""

_MAX_THRUST_AGE = 0.3
"""Largest age of an ATTITUDE_TARGET whose thrust is used, s; PX4 sends it at 10 Hz."""

_MAX_TAKEOVER_DIFFERENCE = 0.1
"""Largest relative difference at takeover between the measured hover thrust and the learned one,
which `thrust.correction_limit` bounds."""

_MAX_SMALLEST_THRUST = 0.9
"""Largest share of the weight that the smallest thrust may carry, so the vehicle can descend."""

_MAX_UNREPORTED_ERROR = 0.15
"""Largest relative error of the configured hover thrust that is not reported."""


class HoverLearning:
    """Passes telemetry to the hover-thrust estimate, before and during offboard control.

    Before offboard control ATTITUDE_TARGET reports the autopilot's own thrust. So an error of the
    configured hover thrust is corrected before the takeover. After offboard control nothing is
    learned.

    Attributes:
        hover_thrust: the estimate.
    """

    def __init__(self, hover_thrust: HoverThrust, telemetry: Telemetry) -> None:
        self.hover_thrust = hover_thrust
        self._telemetry = telemetry
        self._had_control = False

    @property
    def thrust_limits(self) -> tuple[float, float]:
        """Smallest and largest available specific thrust, from the learned hover thrust, m/s²."""
        hover_thrust = self.hover_thrust
        return hover_thrust.smallest_specific_thrust, hover_thrust.largest_specific_thrust

    def largest_tilt(self, acceleration_down: float = 0.0) -> float:
        """Largest tilt, rad, at which 95 % of the largest thrust give `acceleration_down`, m/s²."""
        return largest_tilt(GRAVITY - acceleration_down, self.hover_thrust.largest_tilted_thrust)

    def limit_tilt(self, target: Target, acceleration_down: float) -> Target:
        """The target with its tilt limited to `largest_tilt`."""
        max_norm = sin(self.largest_tilt(acceleration_down))
        north, east = clamp_length(target.north, target.east, max_norm)
        return target._replace(north=north, east=east)

    def step(self, now: float, q: Quaternion, *, offboard_active: bool, steady: bool) -> None:
        """Learn from the newest telemetry.

        Args:
            now: event-loop time, s.
            q: newest attitude.
            offboard_active: whether the autopilot obeys the setpoints.
            steady: whether the commanded thrust is steady; the rotors lag behind a changing thrust.
        """
        battery, position = self._telemetry.battery, self._telemetry.position
        if battery is not None:
            self.hover_thrust.note_voltage(battery.received, battery.voltage_v)
        self._had_control = self._had_control or offboard_active
        can_learn = (
            steady
            if offboard_active
            else not self._had_control and self._note_autopilot_thrust(now, q)
        )
        if can_learn and position is not None:
            self.hover_thrust.observe(position.vehicle_time, position.velocity_ned[2])
        else:
            self.hover_thrust.pause()

    def takeover_refusal(self) -> str | None:
        """Why takeover is refused: at this hover thrust the vehicle would climb or sink; or None.

        A refusal is possible only if the autopilot reports its own thrust.
        """
        hover_thrust = self.hover_thrust
        measured_hover, learned_hover, (min_thrust, _) = (
            hover_thrust.measured_hover,
            hover_thrust.learned_hover,
            hover_thrust.limits,
        )
        if (
            hover_thrust.smallest_specific_thrust * learned_hover / measured_hover
            > _MAX_SMALLEST_THRUST * GRAVITY
        ):
            return (
                f"not taken over: the vehicle hovers at a thrust of {measured_hover:.2f}, so with "
                f"limits.min_thrust {min_thrust:g} it cannot descend; set limits.min_thrust to "
                f"{0.4 * measured_hover:.2f}, and thrust.hover_thrust to {measured_hover:.2f}"
            )
        if abs(measured_hover - learned_hover) > _MAX_TAKEOVER_DIFFERENCE * learned_hover:
            return (
                f"not taken over: the vehicle hovers at a thrust of {measured_hover:.2f}, and "
                f"thrust.hover_thrust {hover_thrust.configured_hover:.2f} differs by more than "
                f"thrust.correction_limit allows; set thrust.hover_thrust to {measured_hover:.2f}"
            )
        return None

    def mismatch_warning(self) -> str | None:
        """Advice to set thrust.hover_thrust, if the learned one differs by over 15 %; else None."""
        hover_thrust = self.hover_thrust
        configured_hover, learned_hover = hover_thrust.configured_hover, hover_thrust.measured_hover
        if (
            not self._had_control
            or abs(learned_hover - configured_hover) <= _MAX_UNREPORTED_ERROR * configured_hover
        ):
            return None
        return (
            f"the vehicle hovers at a thrust of {learned_hover:.2f}, but thrust.hover_thrust is "
            f"{configured_hover:.2f}; set it to {learned_hover:.2f}"
        )

    def _note_autopilot_thrust(self, now: float, q: Quaternion) -> bool:
        """Note the autopilot's thrust; return False if unknown, or if the vehicle does not fly."""
        target, height = self._telemetry.attitude_target_thrust, self._telemetry.height
        if target is None or now - target.received > _MAX_THRUST_AGE:
            return False
        if not self._telemetry.armed or height is None or height < _MIN_LEARNING_HEIGHT:
            return False
        self.hover_thrust.note_thrust(target.thrust, q)
        return True
