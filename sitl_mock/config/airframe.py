"""Airframe, battery and wind of the vehicle. The key names carry the units.

The defaults reproduce the PX4 SIH quadrotor (1 kg) as measured over MAVLink: docs/mock-vehicle.md.
"""

from typing import Annotated

from pydantic import Field, model_validator

from sitl_mock.config.section import (
    Finite,
    Fraction,
    NonNegative,
    Positive,
    Section,
    resolve_preset,
)

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
"""Preset name -> the keys that differ from the defaults."""


class AirframeConfig(Section):
    """Body and rotors of an X quadrotor, and its limits at touchdown.

    The preset names `sih` and `unlike-axes` can replace the whole section.
    """

    physics_rate_hz: Annotated[int, Field(ge=1000, le=10000)] = 1000
    """Physics steps per second of vehicle time."""
    mass_kg: Positive = 1.0
    inertia_kg_m2: tuple[Positive, Positive, Positive] = (0.025, 0.025, 0.030)
    """Principal moments of inertia about body x, y, z."""
    gravity_m_s2: Positive = 9.80665
    drag_n_s_per_m: NonNegative = 1.0
    """Linear drag: force in N per m/s of airspeed, equal in all directions."""
    quadratic_drag_n_s2_per_m2: NonNegative = 0.0
    """Quadratic drag: force in N per (m/s)^2 of airspeed."""
    axis_drag_n_s2_per_m2: tuple[NonNegative, NonNegative, NonNegative] = (0.0, 0.0, 0.0)
    """Quadratic drag along body x, y, z: force in N per (m/s)^2 of the airspeed along that axis."""
    momentum_drag_n_s_per_m: tuple[NonNegative, NonNegative, NonNegative] = (0.0, 0.0, 0.0)
    """Momentum drag of the rotors along body x, y, z, at hover thrust: force in N per m/s of
    airspeed. The force grows with the square root of the thrust.
    """
    rotational_drag_n_m_s: NonNegative = 0.025
    """Aerodynamic damping torque in N m per rad/s, equal about all axes."""
    thrust_slope_m_s2: Positive = 19.55
    """Slope of the thrust curve's linear part: specific thrust (thrust / mass) per throttle."""
    thrust_offset_m_s2: NonNegative = 0.22
    """Specific thrust at throttle 0 if the linear part of the thrust curve is extrapolated."""
    thrust_linear_from: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.15
    """Throttle above which ``thrust_slope_m_s2`` and ``thrust_offset_m_s2`` give the thrust curve.
    Below, the curve is a straight line from zero thrust at throttle 0."""
    rotor_lag_ms: Positive = 50.0
    """Time constant of each rotor's thrust (first order)."""
    rotor_arm_m: Positive = 0.2
    """Distance of each rotor from the body x axis, and from the body y axis."""
    rotor_drag_ratio_m: Positive = 0.02
    """Reaction torque about body z per thrust of a rotor, N m per N."""
    crash_tilt_deg: Annotated[float, Field(gt=0.0, le=180.0)] = 45.0
    """Tilt above which a touchdown is a crash."""
    crash_speed_m_s: Positive = 5.0
    """Sink speed above which a touchdown is a crash."""
    ground_levelling_ms: Positive = 50.0
    """Time constant with which the vehicle levels on the ground."""

    @model_validator(mode="before")
    @classmethod
    def _resolve_preset(cls, value: object) -> object:
        return resolve_preset(AIRFRAMES, value, "airframes")


class WindConfig(Section):
    """Wind: a steady mean plus gusts (first-order coloured noise)."""

    speed_m_s: NonNegative = 0.0
    from_deg: Finite = 0.0
    """Direction from which the mean wind blows, clockwise from north."""
    gust_m_s: NonNegative = 0.0
    """Standard deviation of each horizontal gust component."""
    vertical_gust_m_s: NonNegative = 0.0
    """Standard deviation of the vertical gust component."""
    gust_time_s: Positive = 2.0
    """Correlation time of the gusts."""


class BatteryConfig(Section):
    """A lithium-polymer battery; when its voltage sags, the thrust falls."""

    cells: Annotated[int, Field(ge=1, le=14)] = 4
    capacity_ah: Positive = 5.0
    initial_remaining: Fraction = 1.0
    """Charge at boot as a fraction of the capacity."""
    full_cell_v: Positive = 4.2
    """Open-circuit voltage of a full cell."""
    empty_cell_v: Positive = 3.6
    """Open-circuit voltage of an empty cell; the voltage is linear in the charge."""
    resistance_ohm: NonNegative = 0.005
    """Internal resistance of the pack."""
    idle_current_a: NonNegative = 0.5
    """Current of the electronics."""
    hover_current_a: NonNegative = 10.0
    """Current of the rotors in a hover; it grows with thrust to the power 1.5."""
    thrust_exponent: NonNegative = 2.0
    """The thrust is proportional to (V / V0) to this power, with the battery's voltage V. V0 is the
    voltage of the full battery in a hover."""
