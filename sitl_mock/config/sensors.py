"""Errors of what the autopilot measures and estimates."""

from typing import Annotated

from pydantic import Field, field_validator

from sitl_mock.config.section import Finite, NonNegative, Positive, Section, preset

Gains = tuple[NonNegative, NonNegative]
"""Of a state: per position innovation, and per velocity innovation."""


class EkfConfig(Section):
    """Errors of the navigation filter: what drives them, and how it holds them down.

    The filter integrates an acceleration that is off by its attitude's error, and corrects itself
    by satellite fixes, some time later. Standard deviations; the defaults are PX4's.
    """

    fix_period_ms: Annotated[float, Field(ge=20.0, le=1000.0)] = 125.0
    """Time between two satellite fixes."""
    fix_delay_ms: Annotated[float, Field(ge=0.0, le=500.0)] = 110.0
    """Age of the motion that the filter corrects itself by."""
    position_late_ms: Finite = 0.0
    """A fix's position is older than the filter believes by this."""
    velocity_late_ms: Finite = 0.0
    """The same of its velocity."""
    position_noise_m: NonNegative = 0.0246
    """Of a fix's horizontal position."""
    velocity_noise_m_s: NonNegative = 0.0238
    """Of a fix's horizontal velocity."""
    noise_time_s: Positive = 0.25
    """Correlation time of both."""
    tilt_noise_deg: NonNegative = 0.028
    """By this the attitude's roll and pitch wander within a second; the fixes hold them down."""
    yaw_error_deg: NonNegative = 0.3
    """Of the heading; it rotates the acceleration that is integrated."""
    yaw_time_s: Positive = 15.0
    """Correlation time of the heading's error, and that with which a turn changes it."""
    turn_yaw_ms: Finite = -4.0
    """In a turn the heading is learned wrongly, from fixes that are late: by minus the course's
    turn rate times this."""
    acceleration_lead_ms: Finite = 0.0
    """The acceleration that is integrated leads the true one by this."""
    acceleration_scale: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.002
    """It is larger than the true one by this share."""
    vertical_share: NonNegative = 0.3
    """Noise of the vertical direction, per noise of a horizontal one."""
    height_offset_m: Finite = 0.0
    """The estimated height is lower than the true one by this."""
    height_sag_s4_per_m: Finite = 0.0024
    """And by this times the square of the horizontal acceleration, some seconds later."""
    position_gains: Gains = (0.0774, 0.0494)
    """Of the position, m per m and m per m/s."""
    velocity_gains: Gains = (0.0316, 0.0411)
    """Of the velocity, m/s per m and m/s per m/s."""
    acceleration_gains: Gains = (0.0056, 0.0102)
    """Of the acceleration's error, m/s^2 per m and m/s^2 per m/s."""
    predictor_ms: Positive = 250.0
    """Time constant with which a correction reaches the output."""


EKFS: dict[str, EkfConfig | None] = {
    "none": None,
    "px4": EkfConfig(),
    # Gains, lateness and lead fit circles of 2, 5 and 8 m/s and a figure-eight of 5 m/s within
    # 1.4 ms (root mean square of position and velocity errors per speed, complex).
    "ardupilot": EkfConfig(
        fix_period_ms=200.0,
        fix_delay_ms=220.0,
        position_late_ms=32.2,
        velocity_late_ms=16.5,
        position_noise_m=0.005,
        velocity_noise_m_s=0.005,
        tilt_noise_deg=0.006,
        yaw_error_deg=0.3,
        turn_yaw_ms=24.0,
        acceleration_lead_ms=3.1,
        acceleration_scale=0.0019,
        height_offset_m=0.1,
        height_sag_s4_per_m=0.0004,
        position_gains=(0.0853, 0.1278),
        velocity_gains=(0.0291, 0.1134),
        acceleration_gains=(0.0057, 0.0433),
    ),
}
"""What the words that may stand for a whole navigation filter mean."""


class SensorConfig(Section):
    """Errors of what the autopilot believes: white noise (standard deviations) and delays."""

    ekf: EkfConfig | None = None
    """Errors of the navigation filter, added to the rest: px4, ardupilot, none, or keys."""
    attitude_noise_deg: NonNegative = 0.02
    rate_noise_rad_s: NonNegative = 0.002
    position_noise_m: NonNegative = 0.01
    velocity_noise_m_s: NonNegative = 0.01
    acceleration_noise_m_s2: NonNegative = 0.05
    attitude_delay_ms: NonNegative = 2.0
    """Age of the estimated attitude, body rates and specific force."""
    position_delay_ms: NonNegative = 10.0
    """Age of the estimated position and velocity."""

    @field_validator("ekf", mode="before")
    @classmethod
    def _named(cls, value: object) -> object:
        return preset(EKFS, value, "navigation filters")
