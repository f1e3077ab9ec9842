"""The body-rate controller: gains, delays and shaping, fitted to PX4 and ArduPilot."""

from math import radians
from typing import Self

from pydantic import model_validator

from sitl_mock.config.section import Finite, NonNegative, Positive, Section, resolve_preset


class AxisShaping(Section):
    """Shaping of one axis's rate setpoint before the controller (ArduPilot)."""

    acceleration_limit_rad_s2: Positive
    """Largest angular acceleration of the shaped rate."""
    attitude_gain_1_s: NonNegative = 4.5
    """Body rate per angle between attitude and attitude target. At large angles the rate is lower,
    so that braking at half the acceleration limit ends at the target."""
    delay_ms: NonNegative = 0.0
    """Delay from the arrival of a rate setpoint to its shaping."""


class AxisGains(Section):
    """One axis of the body-rate controller: PI with feed-forward, and damping."""

    proportional_n_m_s: NonNegative
    """Torque per rate error, N m per rad/s."""
    integral_n_m: NonNegative = 0.0
    """Torque per integrated rate error, N m per rad."""
    feed_forward_n_m_s: Finite = 0.0
    """Torque per rate setpoint, N m per rad/s."""
    damping_n_m_s2: NonNegative = 0.0
    """Torque against the angular acceleration, N m per rad/s^2 (PX4's D term)."""
    integral_limit_n_m: NonNegative = 0.3
    """Largest torque of the integral term."""
    torque_filter_ms: NonNegative = 0.0
    """Time constant of the low pass on this axis's torque (PX4's MC_YAW_TQ_CUTOFF); 0 = none."""
    setpoint_delay_ms: NonNegative = 4.0
    """Delay from the arrival of a rate setpoint, or from its shaping if any, to the controller."""
    shaping: AxisShaping | None = None
    """Shaping before the controller; give it for all three axes or for none."""


# With the 50 ms rotor lag: poles at wn 19.1 rad/s, zeta 0.70, which fit the measured response and
# its overshoot, and a slow pole at 0.5 1/s, which the feed-forward cancels.
TILT_GAINS = AxisGains(
    proportional_n_m_s=0.448, integral_n_m=0.228, feed_forward_n_m_s=0.008, damping_n_m_s2=0.0078
)

# The low pass and the rotor lag make the response slow. There is no integral, so the yaw rate
# stays 8 % below the setpoint, as measured.
YAW_GAINS = AxisGains(proportional_n_m_s=0.064, feed_forward_n_m_s=0.0179, torque_filter_ms=75.0)

# Fitted to ATTITUDE_TARGET and the body's attitude, recorded at 200 Hz: poles at wn 125 rad/s, zeta
# 1.2 (tilt), and 10.8, 0.82 with a third at 53 1/s (yaw). Only 6 ms of the delay lie before the
# attitude target, so the body lags the target, in yaw by up to 7 degrees. The negative feed-forward
# offsets the body rates that the attitude gain adds during this lag.
ARDUPILOT_TILT_GAINS = AxisGains(
    proportional_n_m_s=19.5,
    feed_forward_n_m_s=-0.97,
    damping_n_m_s2=0.349,
    setpoint_delay_ms=0.0,
    shaping=AxisShaping(acceleration_limit_rad_s2=radians(1100.0), delay_ms=6.0),
)
ARDUPILOT_YAW_GAINS = AxisGains(
    proportional_n_m_s=0.161,
    feed_forward_n_m_s=-0.0353,
    torque_filter_ms=20.0,
    setpoint_delay_ms=4.0,
    shaping=AxisShaping(acceleration_limit_rad_s2=radians(270.0), delay_ms=6.0),
)

RATE_LOOPS = {
    "px4": {"roll": TILT_GAINS, "pitch": TILT_GAINS, "yaw": YAW_GAINS},
    "ardupilot": {
        "roll": ARDUPILOT_TILT_GAINS,
        "pitch": ARDUPILOT_TILT_GAINS,
        "yaw": ARDUPILOT_YAW_GAINS,
    },
}
"""Preset name -> gains of all axes."""


class RateLoopConfig(Section):
    """The autopilot's body-rate controller; the defaults reproduce PX4's measured responses.

    The preset names `px4` and `ardupilot` can replace the whole section.
    """

    roll: AxisGains = TILT_GAINS
    pitch: AxisGains = TILT_GAINS
    yaw: AxisGains = YAW_GAINS

    @property
    def shaping(self) -> tuple[AxisShaping, AxisShaping, AxisShaping] | None:
        """Shaping of roll, pitch and yaw setpoints, None if they are not shaped."""
        roll, pitch, yaw = self.roll.shaping, self.pitch.shaping, self.yaw.shaping
        return (roll, pitch, yaw) if roll and pitch and yaw else None

    @classmethod
    def ardupilot(cls) -> Self:
        """Return gains that reproduce ArduPilot's measured responses on the default airframe."""
        return cls(**RATE_LOOPS["ardupilot"])

    @model_validator(mode="before")
    @classmethod
    def _resolve_preset(cls, value: object) -> object:
        return resolve_preset(RATE_LOOPS, value, "rate loops")

    @model_validator(mode="after")
    def _shape_all_axes_or_none(self) -> Self:
        shaped = [axis.shaping is not None for axis in (self.roll, self.pitch, self.yaw)]
        if any(shaped) and not all(shaped):
            raise ValueError("give shaping for all three axes or for none")
        return self
