"""Errors of the autopilot's measurements and estimates."""

from typing import Annotated

from pydantic import Field, field_validator

from sitl_mock.config.section import Finite, NonNegative, Positive, Section, resolve_preset

InnovationGains = tuple[NonNegative, NonNegative]
"""Gains of one state of the filter: for the position innovation, for the velocity innovation."""


class EkfConfig(Section):
    """Errors of the navigation filter, and the gains with which satellite fixes correct them.

    Errors of the filter's attitude become errors of the acceleration that it integrates. Delayed
    fixes correct the errors. Noise is given as standard deviation; the defaults are PX4's.
    """

    fix_period_ms: Annotated[float, Field(ge=20.0, le=1000.0)] = 125.0
    """Time between two satellite fixes."""
    fix_delay_ms: Annotated[float, Field(ge=0.0, le=500.0)] = 110.0
    """Time from a fix until the filter fuses it; the fix corrects the state at the time of the fix.
    A value below ``position_delay_ms`` has the effect of ``position_delay_ms``."""
    position_late_ms: Finite = 0.0
    """Mean delay of a fix's position beyond ``fix_delay_ms``; the filter neglects this delay."""
    velocity_late_ms: Finite = 0.0
    """Mean delay of a fix's velocity beyond ``fix_delay_ms``; the filter neglects this delay."""
    fix_slip_ms: NonNegative = 0.0
    """Peak-to-peak amplitude of a sawtooth in ``position_late_ms`` and ``velocity_late_ms``. Both
    delays fall steadily, then jump back. The time of the first jump is random."""
    fix_slip_time_s: Positive = 14.0
    """Period of the sawtooth of ``fix_slip_ms``."""
    position_noise_m: NonNegative = 0.0246
    """Standard deviation of the noise of a fix's horizontal position, on each axis."""
    velocity_noise_m_s: NonNegative = 0.0238
    """Standard deviation of the noise of a fix's horizontal velocity, on each axis."""
    noise_time_s: Positive = 0.25
    """Correlation time of the noise of a fix's position and velocity."""
    tilt_noise_deg: NonNegative = 0.028
    """Standard deviation of the random walk of roll and pitch in 1 s; the fixes limit it."""
    tilt_bias_deg: tuple[Finite, Finite] = (0.0, 0.0)
    """Constant error of the attitude, as a rotation about north and east. The estimated bias of the
    accelerometer hides it in level flight; a horizontal acceleration causes a climb rate error."""
    yaw_error_deg: NonNegative = 0.3
    """Standard deviation of the heading error, which rotates the integrated acceleration."""
    yaw_time_s: Positive = 15.0
    """Correlation time of the heading error."""
    turn_yaw_ms: Finite = -4.0
    """In a turn, delayed fixes cause a heading error of -``turn_yaw_ms`` times the turn rate of the
    course. The error builds up over seconds, faster at a larger acceleration."""
    compass_error_deg: Finite = 0.0
    """Heading error that the compass causes without acceleration; an acceleration reduces it."""
    yaw_rate_bias_deg_s: Finite = 0.0
    """Error of the yaw rate in telemetry."""
    acceleration_lead_ms: Finite = 0.0
    """Lead of the integrated acceleration over the true one."""
    acceleration_scale: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.002
    """Scale error of the integrated acceleration."""
    vertical_share: NonNegative = 0.75
    """Ratio of vertical to horizontal noise, of the fixes and of the integrated acceleration."""
    height_offset_m: Finite = 0.0
    """Constant error of the height: true minus estimated."""
    height_sag_s4_per_m: Finite = 0.0009
    """Error of the measured height (true minus measured) per squared horizontal acceleration."""
    sink_per_acceleration_ms: Finite = 4.0
    """Error of the vertical velocity (estimated minus true, down) per horizontal acceleration. The
    error follows the acceleration over seconds; the position has no such error."""
    sink_noise_m_s: NonNegative = 0.015
    """Standard deviation of a slow noise of the vertical velocity; the position integrates it."""
    sink_noise_time_s: Positive = 2.0
    """Correlation time of the slow noise of the vertical velocity."""
    height_time_s: Annotated[float, Field(ge=0.5)] = 2.0
    """Time constant with which the estimated height follows the measured height."""
    height_noise_m: NonNegative = 0.017
    """Standard deviation of a slow noise of the measured height, like that of a barometer."""
    height_noise_time_s: Positive = 6.0
    """Correlation time of the slow noise of the measured height."""
    position_gains: InnovationGains = (0.0774, 0.0494)
    """Gains of the position for an innovation of position and velocity, m per m and m per m/s."""
    velocity_gains: InnovationGains = (0.0316, 0.0411)
    """Gains of the velocity for an innovation of position and velocity, 1/s and m/s per m/s."""
    acceleration_gains: InnovationGains = (0.0056, 0.0102)
    """Gains of the acceleration error for an innovation of position and velocity, 1/s^2 and 1/s."""
    predictor_ms: Positive = 250.0
    """Time constant with which the output predictor corrects the position and the velocity."""
    heading_predictor_ms: Positive = 250.0
    """Time constant with which the output predictor corrects the heading."""


EKFS: dict[str, EkfConfig | None] = {
    "none": None,
    "px4": EkfConfig(),
    # Fitted to the errors of position and velocity, sample by sample, in 17 flights of circles at 5
    # and 8 m/s and figure-eights at 5 and 8 m/s. The fit leaves position errors of 3 to 7 ms times
    # the speed unexplained.
    "ardupilot": EkfConfig(
        fix_period_ms=200.0,
        fix_delay_ms=447.0,
        position_late_ms=26.3,
        velocity_late_ms=17.6,
        # In recorded circles the delay of the position falls by 8 ms, then rises again, every 8 to
        # 14 s.
        fix_slip_ms=8.0,
        position_noise_m=0.005,
        velocity_noise_m_s=0.005,
        tilt_noise_deg=0.006,
        # Chosen so that the height error equals that of the recorded circles at 5 and 8 m/s. Real
        # flights had a total tilt of 0.05 to 0.3 degrees; here it is 0.14.
        tilt_bias_deg=(0.12, 0.07),
        yaw_error_deg=0.1,
        turn_yaw_ms=15.4,
        compass_error_deg=1.03,
        yaw_rate_bias_deg_s=0.05,
        acceleration_lead_ms=-0.9,
        acceleration_scale=0.0007,
        vertical_share=0.6,
        height_offset_m=0.1,
        height_sag_s4_per_m=0.0001,
        sink_per_acceleration_ms=0.0,
        sink_noise_m_s=0.006,
        height_time_s=1.1,
        height_noise_m=0.0065,
        position_gains=(0.0367, 0.1088),
        velocity_gains=(0.116, 0.1706),
        acceleration_gains=(0.0082, 0.0323),
        predictor_ms=258.0,
    ),
}
"""Preset name -> navigation filter."""


class SensorConfig(Section):
    """Errors of the autopilot's estimate: white noise (standard deviations) and delays.

    With a navigation filter the defaults of ``position_noise_m``, ``velocity_noise_m_s`` and
    ``position_delay_ms`` are 0 (`settings.SENSORS_WITH_FILTER`).
    """

    ekf: EkfConfig | None = None
    """Navigation filter whose errors are added: px4, ardupilot, none, or the keys of `EkfConfig`.
    `MockSettings` sets the filter of the vehicle's autopilot as the default."""
    attitude_noise_deg: NonNegative = 0.02
    rate_noise_rad_s: NonNegative = 0.002
    position_noise_m: NonNegative = 0.01
    velocity_noise_m_s: NonNegative = 0.01
    acceleration_noise_m_s2: NonNegative = 0.05
    attitude_delay_ms: NonNegative = 0.0
    """Age of the estimated attitude and specific force."""
    rate_lag_ms: NonNegative = 5.0
    """Age of the estimated body rates minus the age of the attitude: the delay of the gyro's low
    pass. The default is PX4's; ArduPilot's is 11."""
    position_delay_ms: NonNegative = 10.0
    """Age of the estimated position and velocity."""
    stamp_slips_hz: Annotated[float, Field(ge=0.0, le=20.0)] = 0.0
    """How often per second the time stamp of LOCAL_POSITION_NED slips by 1 ms against its position,
    back or forth. ArduPilot takes the time, in whole ms, when it writes the message; the
    default for ArduPilot is 1.6."""

    @field_validator("ekf", mode="before")
    @classmethod
    def _resolve_preset(cls, value: object) -> object:
        return resolve_preset(EKFS, value, "navigation filters")
