"""The vehicle: response of its rate loop, and hover thrust."""

from math import radians
from typing import Annotated, NamedTuple

from pydantic import Field

from companion.config.limits import Share
from companion.config.units import converted, seconds
from companion.files.yaml_file import Section

Milliseconds = Annotated[float, Field(ge=0.0, le=1000.0)]
Damping = Annotated[float, Field(ge=0.3, le=10.0)]
AccelerationLimit = Annotated[float, Field(ge=10.0, le=100_000.0)]


class AxisKeys(NamedTuple):
    """Response of one axis of the rate loop, as keys of `vehicle`.

    A `lag_ms` or `dead_time_ms` of None is unknown. If `acceleration_limit_deg_s2` is None, the
    rate has no slew limit. If `damping` is None, the response is first order.
    """

    lag_ms: float | None
    dead_time_ms: float | None
    acceleration_limit_deg_s2: float | None
    damping: float | None

    @property
    def lag(self) -> float | None:
        """Time constant, s."""
        return converted(self.lag_ms, seconds)

    @property
    def dead_time(self) -> float | None:
        """Dead time, s."""
        return converted(self.dead_time_ms, seconds)

    @property
    def acceleration_limit(self) -> float | None:
        """Slew limit of the rate, rad/s²."""
        return converted(self.acceleration_limit_deg_s2, radians)

    def overridden_by(self, *keys: float | None) -> "AxisKeys":
        """A copy with `keys`, in the order of the fields; None keeps the present value.

        A new lag without a damping makes the response first order.
        """
        base_axis = self if keys[0] is None else self._replace(damping=None)
        return AxisKeys(*(a if b is None else b for a, b in zip(base_axis, keys, strict=True)))


class VehicleConfig(Section):
    """Response of the vehicle's rate loop, from which `model-following` plans."""

    identified: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """Flight in which `companion identify` measured the keys below; it writes this key. null: the
    keys are estimated or from another vehicle, and `companion doctor` warns.
    """
    autopilot: Annotated[str, Field(min_length=1, max_length=40)] | None = None
    """Autopilot of the vehicle on which `companion identify` measured the keys below; it writes
    this key. `companion doctor` and every flight warn if the vehicle has another one. null:
    unknown."""
    lag_ms: Milliseconds | None = None
    """Time constant of the roll rate after its dead time. For a second-order response it is
    2·damping/frequency."""
    dead_time_ms: Milliseconds | None = None
    """Time from an attitude sample to the first effect of its setpoint on the roll rate."""
    acceleration_limit_deg_s2: AccelerationLimit | None = None
    """Slew limit of the autopilot's roll rate target (ArduPilot). null: none (PX4)."""
    damping: Damping | None = None
    """Damping ratio of a second-order roll rate response. null: first order."""
    pitch_lag_ms: Milliseconds | None = None
    """As lag_ms, for pitch. null: as roll."""
    pitch_dead_time_ms: Milliseconds | None = None
    """As dead_time_ms, for pitch. null: as roll."""
    pitch_acceleration_limit_deg_s2: AccelerationLimit | None = None
    """As acceleration_limit_deg_s2, for pitch. null: as roll."""
    pitch_damping: Damping | None = None
    """As damping, for pitch. null: as roll where pitch_lag_ms is null, else first order."""
    yaw_lag_ms: Milliseconds | None = None
    """As lag_ms, for yaw. null: as roll."""
    yaw_dead_time_ms: Milliseconds | None = None
    """As dead_time_ms, for yaw. null: as roll."""
    yaw_acceleration_limit_deg_s2: AccelerationLimit | None = None
    """As acceleration_limit_deg_s2, for yaw. null: as roll."""
    yaw_frame_lead_ms: Milliseconds | None = None
    """ArduPilot applies body rates about the axes of its attitude target. In yaw the target leads
    the body by this time. Used only while ATTITUDE_TARGET is missing. null: derived from the keys
    above if there is a slew limit (ArduPilot), else 0 (PX4)."""

    @property
    def response_known(self) -> bool:
        """Whether the response is known, so that `model-following` can plan with it."""
        return self.lag_ms is not None and self.dead_time_ms is not None

    @property
    def axes(self) -> "dict[str, AxisKeys]":
        """The response of roll, pitch and yaw.

        A key of pitch or yaw that is null has the value of roll. Yaw is always first order.
        """
        roll = AxisKeys(
            self.lag_ms, self.dead_time_ms, self.acceleration_limit_deg_s2, self.damping
        )
        pitch = (
            self.pitch_lag_ms,
            self.pitch_dead_time_ms,
            self.pitch_acceleration_limit_deg_s2,
            self.pitch_damping,
        )
        yaw = self.yaw_lag_ms, self.yaw_dead_time_ms, self.yaw_acceleration_limit_deg_s2, None
        first_order = roll._replace(damping=None)
        return {
            "roll": roll,
            "pitch": roll.overridden_by(*pitch),
            "yaw": first_order.overridden_by(*yaw),
        }

    @property
    def response(self) -> dict[str, float]:
        """The response as options of `make_planner`, in SI units, without unknown values."""
        options = {"frame_lead": converted(self.yaw_frame_lead_ms, seconds)}
        for name, axis in self.axes.items():
            prefix = "" if name == "roll" else f"{name}_"
            options[f"{prefix}lag"] = axis.lag
            options[f"{prefix}dead_time"] = axis.dead_time
            options[f"{prefix}acceleration"] = axis.acceleration_limit
            options[f"{prefix}damping"] = axis.damping
        return {name: value for name, value in options.items() if value is not None}


class ThrustConfig(Section):
    """Conversion of specific thrust in m/s² to the normalised thrust 0..1 of MAVLink."""

    hover_thrust: Annotated[float, Field(gt=0.05, lt=0.95)] = 0.5
    """Normalised thrust at which the vehicle hovers (PX4: MPC_THR_HOVER, ArduPilot:
    MOT_THST_HOVER)."""
    correction_limit: Annotated[float, Field(ge=0.0, le=2.0)] = 0.8
    """Largest correction of hover_thrust in flight: 0.8 permits a factor from 1/1.8 to 1.8."""
    correction_time_s: Annotated[float, Field(ge=0.2, le=60.0)] = 1.5
    """Time constant with which the corrected hover thrust follows a change in flight. An initial
    error is corrected at once."""
    curve_factor: Share = 0.0
    """f in thrust = f·u² + (1 − f)·u, where u is the normalised thrust sent. 0 where the autopilot
    linearises the thrust itself (PX4: THR_MDL_FAC, ArduPilot: MOT_THST_EXPO)."""
    battery_exponent: Annotated[float, Field(ge=0.0, le=3.0)] = 2.0
    """Thrust is proportional to the battery voltage to this power. 0: the autopilot compensates the
    voltage, or does not measure it."""
    lag_ms: Milliseconds | None = None
    """Time constant of the rotors' thrust, which guidance compensates. null: unknown."""
    autopilot_compensates_tilt: bool = False
    """Whether the autopilot divides thrust by cos(tilt) itself (ArduPilot: ATC_ANGLE_BOOST). PX4
    does not."""

    @property
    def lag(self) -> float:
        """Time constant of the rotors' thrust, s; 0 where it is not known."""
        return converted(self.lag_ms, seconds) or 0.0
