"""What the mock's vehicle is made of: typed, frozen, units in the key names.

The defaults reproduce the PX4 SIH quadrotor (1 kg) as measured over MAVLink; see README.
"""

from math import radians
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, field_validator, model_validator

from sitl_mock.config.ekf import EKFS, EkfConfig
from sitl_mock.config.section import Finite, Fraction, NonNegative, Positive, Section, meaning

AIRFRAMES: dict[str, dict[str, object]] = {
    "sih": {},
    # PX4's SIH with SIH_MASS 1.2, SIH_IXX 0.04, SIH_IYY 0.03, SIH_KDV 0.5: the same rotors.
    "unlike-axes": {
        "mass_kg": 1.2,
        "inertia_kg_m2": (0.04, 0.03, 0.03),
        "drag_n_s_per_m": 0.5,
        "thrust_slope_m_s2": 19.55 / 1.2,
        "thrust_offset_m_s2": 0.22 / 1.2,
    },
}
"""What the words that may stand for a whole airframe mean: what differs from the defaults."""


class AirframeConfig(Section):
    """Body and rotors of an X quadrotor, and how it meets the ground.

    The word `sih` or `unlike-axes` in its place stands for all of it.
    """

    physics_rate_hz: Annotated[int, Field(ge=1000, le=10000)] = 1000
    """Physics steps per second of vehicle time."""
    mass_kg: Positive = 1.0
    inertia_kg_m2: tuple[Positive, Positive, Positive] = (0.025, 0.025, 0.030)
    """Principal moments of inertia about body x, y, z."""
    gravity_m_s2: Positive = 9.80665
    drag_n_s_per_m: NonNegative = 1.0
    """Linear drag against the air: force in N per m/s, equal in all directions."""
    quadratic_drag_n_s2_per_m2: NonNegative = 0.0
    """The same with the square of the airspeed: force in N per (m/s)^2."""
    rotational_drag_n_m_s: NonNegative = 0.025
    """Aerodynamic damping torque in N m per rad/s, equal about all axes."""
    thrust_slope_m_s2: Positive = 19.55
    """Specific thrust (T/m) gained from throttle 0 to 1, on the linear part."""
    thrust_offset_m_s2: NonNegative = 0.22
    """Specific thrust the linear part would have at throttle 0."""
    thrust_linear_from: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.15
    """Throttle from which the thrust is linear; below, a straight line through 0."""
    rotor_lag_ms: Positive = 50.0
    """Time constant of each rotor's thrust (first order)."""
    rotor_arm_m: Positive = 0.2
    """Distance of each rotor from the body x axis, and from the body y axis."""
    rotor_drag_ratio_m: Positive = 0.02
    """Reaction torque about body z per thrust of a rotor, N m per N."""
    crash_tilt_deg: Annotated[float, Field(gt=0.0, le=180.0)] = 45.0
    """Touching the ground at more tilt than this tips the vehicle over."""
    crash_speed_m_s: Positive = 5.0
    """Touching the ground faster than this (down) breaks the vehicle."""
    ground_levelling_ms: Positive = 50.0
    """Time constant with which the landing gear levels the standing vehicle."""

    @model_validator(mode="before")
    @classmethod
    def _named(cls, value: object) -> object:
        return meaning(AIRFRAMES, value, "airframes")


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
        return meaning(RATE_LOOPS, value, "rate loops")

    @model_validator(mode="after")
    def _shaped_whole(self) -> Self:
        shaped = [axis.shaping is not None for axis in (self.roll, self.pitch, self.yaw)]
        if any(shaped) and not all(shaped):
            raise ValueError("shaping must be given for all three axes or for none")
        return self


class WindConfig(Section):
    """Wind: a steady mean, and gusts as first-order coloured noise about it."""

    speed_m_s: NonNegative = 0.0
    from_deg: Finite = 0.0
    """Direction the mean wind blows from, clockwise from north."""
    gust_m_s: NonNegative = 0.0
    """Standard deviation of each horizontal gust component."""
    vertical_gust_m_s: NonNegative = 0.0
    """Standard deviation of the vertical gust component."""
    gust_time_s: Positive = 2.0
    """Correlation time of the gusts."""


class BatteryConfig(Section):
    """A lithium-polymer pack whose voltage, and with it the thrust, sags."""

    cells: Annotated[int, Field(ge=1, le=14)] = 4
    capacity_ah: Positive = 5.0
    initial_remaining: Fraction = 1.0
    """Charge at boot as a fraction of the capacity."""
    full_cell_v: Positive = 4.2
    """Open-circuit voltage of a full cell."""
    empty_cell_v: Positive = 3.6
    """Open-circuit voltage of an empty cell; linear in the charge between."""
    resistance_ohm: NonNegative = 0.005
    """Internal resistance of the pack."""
    idle_current_a: NonNegative = 0.5
    """Drawn by the electronics, always."""
    hover_current_a: NonNegative = 10.0
    """Drawn by the rotors in a hover; grows with thrust to the power 1.5."""
    thrust_exponent: NonNegative = 2.0
    """Thrust goes with (voltage / voltage of the full pack in a hover) to this power."""


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
        return meaning(EKFS, value, "navigation filters")


class SigningConfig(Section):
    """MAVLink 2 signing, on every link of the vehicle."""

    passphrase_file: Path
    """Its first line is the passphrase; the key is its SHA-256, as ground stations make it."""
    accept_unsigned: bool | None = None
    """Obey frames without a signature, too; wrongly signed ones never. Null: as the autopilot does,
    ArduPilot on the companion's link (its SERIAL0), PX4 on none."""
    link_id: Annotated[int, Field(ge=0, le=254)] = 0
    """Of the companion's link in our signatures; the ground station's has the next."""
