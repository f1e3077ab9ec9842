"""The map from specific thrust to MAVLink's 0..1, and its correction from how the vehicle moved."""

from dataclasses import dataclass

from companion.attitude import BodyRates, Quaternion
from companion.attitude.kinematics import cos_tilt
from companion.guidance.reference import GRAVITY
from companion.guidance.thrust import BatterySag, ThrustCurve, cos_tilt_ahead, specific_thrust
from companion.guidance.thrust_filter import SHORTEST, ThrustFilter

_LONGEST_WINDOW = 0.5
"""Beyond it the thrust in between is not known well enough to learn from, s."""

_PLAUSIBLE = (0.3 * GRAVITY, 2.5 * GRAVITY)
"""Measured specific thrust outside this is not learned from (free fall, a bump), m/s²."""

_UNKNOWN_DRAG = 0.5
"""Standard deviation of the linear drag per mass in climb and descent, 1/s."""


@dataclass(frozen=True, slots=True)
class ThrustSettings:
    """What is known of the vehicle's thrust.

    Attributes:
        hover: normalised thrust at hover, 0..1.
        correction_limit: by which share the hover thrust is corrected at most.
        correction_time: time constant with which a slow change is followed, s.
        lowest: smallest normalised thrust given out.
        highest: largest normalised thrust given out.
        curve_factor: of `ThrustCurve`.
        battery_exponent: of `BatterySag`.
        lag: of the rotors, s.
        tilt_compensated: whether the autopilot divides by cos(tilt) itself.
        drag: linear drag per mass, 1/s.
    """

    hover: float
    correction_limit: float
    correction_time: float
    lowest: float
    highest: float
    curve_factor: float = 0.0
    battery_exponent: float = 0.0
    lag: float = 0.0
    tilt_compensated: bool = False
    drag: float = 0.0


class HoverThrust:
    """Normalised thrust for a wanted vertical acceleration, by a hover thrust that is learned.

    It is learned only while `observe` is called, which is only in the air, from the thrust that was
    `sent`: ours while we are in control, the autopilot's own before.
    """

    def __init__(self, settings: ThrustSettings) -> None:
        self._settings = settings
        self._curve = ThrustCurve(settings.curve_factor)
        self._battery = BatterySag(settings.battery_exponent)
        self._filter = ThrustFilter(
            self._curve.share(settings.hover), settings.correction_limit, settings.correction_time
        )
        self._began: tuple[float, float] | None = None
        self._sum = 0.0
        self._count = 0

    @property
    def configured(self) -> float:
        """Normalised thrust at hover by the settings."""
        return self._settings.hover

    @property
    def learned(self) -> float:
        """Normalised thrust at hover by what was learned, with the battery as it was at first."""
        return self._curve.signal(GRAVITY / self._filter.gain)

    @property
    def largest(self) -> float:
        """Largest specific thrust that is given out, m/s²."""
        return self._specific(self._settings.highest)

    @property
    def largest_tilted(self) -> float:
        """The same along the axis of a tilted vehicle: an autopilot may make up for tilt itself."""
        settings = self._settings
        return self._specific(1.0 if settings.tilt_compensated else settings.highest)

    @property
    def smallest(self) -> float:
        """Smallest specific thrust that is given out, m/s²."""
        return self._specific(self._settings.lowest)

    def normalised(self, acceleration_down: float, q: Quaternion, body_rates: BodyRates) -> float:
        """Normalised thrust, inside the bounds, for a wanted vertical acceleration.

        Args:
            acceleration_down: m/s².
            q: attitude.
            body_rates: rad/s.
        """
        settings = self._settings
        cosine = cos_tilt_ahead(q, body_rates, settings.lag)
        thrust = specific_thrust(acceleration_down, 1.0 if settings.tilt_compensated else cosine)
        return self.within_limits(self._signal(thrust))

    def within_limits(self, normalised: float) -> float:
        """The nearest normalised thrust inside the bounds."""
        return min(max(normalised, self._settings.lowest), self._settings.highest)

    def sent(self, normalised: float, q: Quaternion) -> None:
        """Note a thrust that the vehicle follows, and its attitude then."""
        vertical = self._curve.share(normalised) * self._battery.factor
        if not self._settings.tilt_compensated:
            vertical *= cos_tilt(q[1], q[2])
        self._sum += vertical
        self._count += 1

    def observe(self, time: float, velocity_down: float) -> None:
        """Learn from a measured vertical velocity (m/s) at a vehicle time (s)."""
        if self._began is None:
            self._begin(time, velocity_down)
            return
        began, before = self._began
        span = time - began
        if 0.0 <= span < SHORTEST:
            return
        if span <= _LONGEST_WINDOW and self._count:
            velocity = 0.5 * (before + velocity_down)
            acceleration = (velocity_down - before) / span
            measured = GRAVITY - acceleration - self._settings.drag * velocity
            if _PLAUSIBLE[0] <= measured <= _PLAUSIBLE[1]:
                extra_variance = (_UNKNOWN_DRAG * velocity) ** 2
                self._filter.learn(span, self._sum / self._count, measured, extra_variance)
        self._begin(time, velocity_down)

    def pause(self) -> None:
        """Drop the current window: nothing is learned across a pause."""
        self._began = None

    def note_voltage(self, time: float, voltage: float | None) -> None:
        """Take the battery's voltage in V, at a time in s; None where it is not known."""
        self._battery.note(time, voltage)

    def on_ground(self) -> None:
        """On the ground: learn nothing, and take the next voltage in the air as the first."""
        self.pause()
        self._battery.reset()

    def _signal(self, thrust: float) -> float:
        return self._curve.signal(thrust / (self._filter.gain * self._battery.factor))

    def _specific(self, normalised: float) -> float:
        return self._filter.gain * self._battery.factor * self._curve.share(normalised)

    def _begin(self, time: float, velocity_down: float) -> None:
        self._began = (time, velocity_down)
        self._sum = 0.0
        self._count = 0
