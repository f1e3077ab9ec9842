"""The body-rate controller: gains, delays and shaping, fitted to PX4 and ArduPilot."""

from math import radians
from typing import Self

from pydantic import model_validator

from sitl_mock.config.section import Finite, NonNegative, Positive, Section, preset


class AxisShaping(Section):
    """How one axis shapes its rate setpoint before the controller sees it (ArduPilot)."""

    acceleration_limit_rad_s2: Positive
    """The shaped rate changes no faster."""
    attitude_gain_1_s: NonNegative = 4.5
    """Body rate per angle from the attitude to the attitude target, for small angles; larger ones
    are closed as half the acceleration limit allows."""
    delay_ms: NonNegative = 0.0
    """From a rate setpoint's arrival to the shaping, which turns the attitude target."""


class AxisGains(Section):
    """One axis of the body-rate controller: PI with feed-forward, and damping."""

    proportional_n_m_s: NonNegative
    """Torque per rate error, N m per rad/s."""
    integral_n_m: NonNegative = 0.0
    """Torque gained per second and rate error, N m per rad."""
    feed_forward_n_m_s: Finite = 0.0
    """Torque per rate setpoint, N m per rad/s."""
    damping_n_m_s2: NonNegative = 0.0
    """Torque against the angular acceleration, N m per rad/s^2 (PX4's D term)."""
    integral_limit_n_m: NonNegative = 0.3
    """Largest torque the integral may hold."""
    torque_filter_ms: NonNegative = 0.0
    """Time constant of the low pass on this axis's torque (PX4's MC_YAW_TQ_CUTOFF); 0 = none."""
    setpoint_delay_ms: NonNegative = 7.0
    """From a rate setpoint's arrival (or its shaping) to the controller using it."""
    shaping: AxisShaping | None = None
    """Before the controller: none, or for all three axes."""


# Poles at wn 19.1 rad/s, zeta 0.70 (with the 50 ms rotor lag; fits the measured response together
# with its overshoot), and a slow one at 0.5 1/s that the feed-forward cancels.
TILT_GAINS = AxisGains(
    proportional_n_m_s=0.448,
    integral_n_m=0.228,
    feed_forward_n_m_s=0.008,
    damping_n_m_s2=0.0078,
)


# The low pass and the rotor lag make the slow response. Without an integral the yaw rate stays
# 8 % short, as measured.
YAW_GAINS = AxisGains(
    proportional_n_m_s=0.064,
    feed_forward_n_m_s=0.0179,
    torque_filter_ms=75.0,
)


# Fitted to ATTITUDE_TARGET and the body's attitude, recorded at 200 Hz: poles at wn 94 rad/s, zeta
# 1.4 (tilt) and 9.4, 0.87 (yaw). All but 6 ms of the delay lies behind the attitude target, so the
# body lags it, in yaw by up to 7 degrees. The negative feed-forward makes the rates fall short by
# what the attitude gain adds while the body lags.
ARDUPILOT_TILT_GAINS = AxisGains(
    proportional_n_m_s=11.0,
    feed_forward_n_m_s=-0.9,
    damping_n_m_s2=0.3,
    setpoint_delay_ms=0.0,
    shaping=AxisShaping(acceleration_limit_rad_s2=radians(1100.0), delay_ms=6.0),
)


ARDUPILOT_YAW_GAINS = AxisGains(
    proportional_n_m_s=0.146,
    feed_forward_n_m_s=-0.032,
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
"""What the words that may stand for a whole rate loop mean."""


class RateLoopConfig(Section):
    """The autopilot's body-rate controller, tuned to PX4's measured responses.

    The word `px4` or `ardupilot` in its place stands for all of it.
    """

    roll: AxisGains = TILT_GAINS
    pitch: AxisGains = TILT_GAINS
    yaw: AxisGains = YAW_GAINS

    @property
    def shaping(self) -> tuple[AxisShaping, AxisShaping, AxisShaping] | None:
        """How roll, pitch and yaw setpoints are shaped before the controller, if they are."""
        roll, pitch, yaw = self.roll.shaping, self.pitch.shaping, self.yaw.shaping
        return (roll, pitch, yaw) if roll and pitch and yaw else None

    @classmethod
    def ardupilot(cls) -> Self:
        """Tuned to ArduPilot's measured responses, on the default airframe."""
        return cls(**RATE_LOOPS["ardupilot"])

    @model_validator(mode="before")
    @classmethod
    def _named(cls, value: object) -> object:
        return preset(RATE_LOOPS, value, "rate loops")

    @model_validator(mode="after")
    def _shaped_whole(self) -> Self:
        shaped = [axis.shaping is not None for axis in (self.roll, self.pitch, self.yaw)]
        if any(shaped) and not all(shaped):
            raise ValueError("shaping must be given for all three axes or for none")
        return self
