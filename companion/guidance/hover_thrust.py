"""Conversion of specific thrust to MAVLink's thrust 0..1, and the learned hover thrust."""

from dataclasses import dataclass

from companion.attitude import BodyRates, Quaternion
from companion.attitude.kinematics import cos_tilt
from companion.guidance.reference import GRAVITY
from companion.guidance.thrust import BatterySag, ThrustCurve, predicted_cos_tilt, specific_thrust
from companion.guidance.thrust_filter import SHORTEST_WINDOW, ThrustFilter

_LONGEST_WINDOW = 0.5
"""Longest time between two velocities from which thrust is learned, s."""

_PLAUSIBLE_THRUST = (0.3 * GRAVITY, 2.5 * GRAVITY)
"""Range of measured specific thrust, m/s²; outside it (free fall, a bump) nothing is learned."""

_DRAG_DEVIATION = 0.5
"""Standard deviation of the linear drag per mass in climb and descent, 1/s."""


@dataclass(frozen=True, slots=True)
class ThrustSettings:
    """Settings of the vehicle's thrust.

    Attributes:
        hover: configured normalised thrust at hover, 0..1.
        correction_limit: limit of learning. The learned hover thrust, as a share of full thrust, is
            at most (1 + correction_limit) times the configured one, and at least 1/(1 +
            correction_limit) of it.
        correction_time: time constant with which the learned hover thrust follows a change, s.
        min_thrust: smallest normalised thrust that is sent, 0..1.
        max_thrust: largest normalised thrust that is sent, 0..1.
        curve_factor: factor of `ThrustCurve`.
        battery_exponent: exponent of `BatterySag`.
        lag: lag of the rotors, s.
        tilt_compensated: whether the autopilot divides the thrust by cos(tilt) itself.
        drag: linear drag per mass in climb and descent, 1/s.
    """

    hover: float
    correction_limit: float
    correction_time: float
    min_thrust: float
    max_thrust: float
    curve_factor: float = 0.0
    battery_exponent: float = 0.0
    lag: float = 0.0
    tilt_compensated: bool = False
    drag: float = 0.0


class HoverThrust:
    """Normalised thrust for a wanted vertical acceleration, from a hover thrust that is learned.

    The caller calls `observe` only in the air, and passes to `note_thrust` the thrust setpoint that
    the vehicle follows: our setpoint in offboard control, the autopilot's own before the takeover.
    """

    def __init__(self, settings: ThrustSettings) -> None:
        self._settings = settings
        self._curve = ThrustCurve(settings.curve_factor)
        self._battery = BatterySag(settings.battery_exponent)
        self._filter = ThrustFilter(
            self._curve.share(settings.hover), settings.correction_limit, settings.correction_time
        )
        self._window_start: tuple[float, float] | None = None
        self._thrust_share_sum = 0.0
        self._thrust_share_count = 0

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest normalised thrust that is sent, 0..1."""
        return self._settings.min_thrust, self._settings.max_thrust

    @property
    def configured_hover(self) -> float:
        """Configured normalised thrust at hover, 0..1."""
        return self._settings.hover

    @property
    def learned_hover(self) -> float:
        """Learned normalised thrust at hover, at the battery voltage just after take-off, 0..1."""
        return self._curve.signal(GRAVITY / self._filter.gain)

    @property
    def measured_hover(self) -> float:
        """As `learned_hover`, but not limited by `correction_limit`."""
        return self._curve.signal(GRAVITY / self._filter.measured_gain)

    @property
    def present_hover(self) -> float:
        """Learned normalised thrust at hover, at the present battery voltage, 0..1."""
        return self._to_normalised(GRAVITY)

    @property
    def largest_specific_thrust(self) -> float:
        """Specific thrust at the largest normalised thrust that is sent, m/s²."""
        return self._to_specific(self._settings.max_thrust)

    @property
    def largest_tilted_thrust(self) -> float:
        """Largest specific thrust along the thrust axis of a tilted vehicle, m/s².

        An autopilot that compensates the tilt itself may give more than `largest_specific_thrust`.
        """
        settings = self._settings
        return self._to_specific(1.0 if settings.tilt_compensated else settings.max_thrust)

    @property
    def smallest_specific_thrust(self) -> float:
        """Specific thrust at the smallest normalised thrust that is sent, m/s²."""
        return self._to_specific(self._settings.min_thrust)

    def normalised_thrust(
        self, acceleration_down: float, q: Quaternion, body_rates: BodyRates
    ) -> float:
        """Normalised thrust for a wanted vertical acceleration, clamped to `limits`.

        `acceleration_down`: wanted acceleration by thrust and gravity, m/s², positive down.
        `body_rates`: measured body rates, rad/s.
        """
        settings = self._settings
        cosine = predicted_cos_tilt(q, body_rates, settings.lag)
        thrust = specific_thrust(acceleration_down, 1.0 if settings.tilt_compensated else cosine)
        return self.within_limits(self._to_normalised(thrust))

    def within_limits(self, normalised: float) -> float:
        """A normalised thrust, clamped to `limits`."""
        return min(max(normalised, self._settings.min_thrust), self._settings.max_thrust)

    def note_thrust(self, normalised: float, q: Quaternion) -> None:
        """Note a normalised thrust that the vehicle follows, and the vehicle's attitude `q`."""
        vertical_share = self._curve.share(normalised) * self._battery.factor
        if not self._settings.tilt_compensated:
            vertical_share *= cos_tilt(q[1], q[2])
        self._thrust_share_sum += vertical_share
        self._thrust_share_count += 1

    def observe(self, time: float, velocity_down: float) -> None:
        """Learn the hover thrust from a vertical velocity (m/s, down) at a vehicle time (s)."""
        if self._window_start is None:
            self._begin_window(time, velocity_down)
            return
        began, earlier_velocity = self._window_start
        duration = time - began
        if 0.0 <= duration < SHORTEST_WINDOW:
            return
        if 0.0 < duration <= _LONGEST_WINDOW and self._thrust_share_count:
            velocity = 0.5 * (earlier_velocity + velocity_down)
            acceleration = (velocity_down - earlier_velocity) / duration
            measured_thrust = GRAVITY - acceleration - self._settings.drag * velocity
            mean_share = self._thrust_share_sum / self._thrust_share_count
            # Upside down the share is negative, and would lead to a negative hover thrust.
            if mean_share > 0.0 and _PLAUSIBLE_THRUST[0] <= measured_thrust <= _PLAUSIBLE_THRUST[1]:
                extra_variance = (_DRAG_DEVIATION * velocity) ** 2
                self._filter.learn(duration, mean_share, measured_thrust, extra_variance)
        self._begin_window(time, velocity_down)

    def pause(self) -> None:
        """Drop the latest velocity, so that nothing is learned across a pause."""
        self._window_start = None

    def note_voltage(self, time: float, voltage: float | None) -> None:
        """Take the battery voltage (V; None: unknown), received at `time`, s of event-loop time."""
        self._battery.note_voltage(time, voltage)

    def on_ground(self) -> None:
        """Note that the vehicle is on the ground: pause learning, forget the take-off voltage."""
        self.pause()
        self._battery.reset()

    def _to_normalised(self, specific: float) -> float:
        return self._curve.signal(specific / (self._filter.gain * self._battery.factor))

    def _to_specific(self, normalised: float) -> float:
        return self._filter.gain * self._battery.factor * self._curve.share(normalised)

    def _begin_window(self, time: float, velocity_down: float) -> None:
        self._window_start = (time, velocity_down)
        self._thrust_share_sum = 0.0
        self._thrust_share_count = 0
