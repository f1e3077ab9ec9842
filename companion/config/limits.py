"""Configuration sections with the limits of commands, and of the age of data."""

from math import tan
from typing import Annotated, Literal

from pydantic import Field, model_validator

from companion.config.markers import LOWERABLE, TUNABLE
from companion.config.units import Si
from companion.files.yaml_file import Section
from companion.guidance.reference import GRAVITY

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class LimitsConfig(Section):
    """Limits of what the program commands, and the fence."""

    max_tilt_deg: Annotated[float, Field(ge=5.0, le=60.0, json_schema_extra=LOWERABLE)] = 35.0
    """Largest tilt of a target. The tilt of a steeper target is reduced to this limit, without a
    change of its direction. Below the permitted range, wind would carry the vehicle away."""
    max_tilt_rate_deg_s: Annotated[float, Field(ge=20.0, le=1e3, json_schema_extra=LOWERABLE)] = (
        90.0
    )
    """Largest total roll and pitch rate: √(roll² + pitch²). Below the permitted range, a hover
    would swing by metres in a light wind."""
    max_yaw_rate_deg_s: Annotated[float, Field(ge=1.0, le=1000.0, json_schema_extra=LOWERABLE)] = (
        60.0
    )
    """Largest yaw rate."""
    rate_limit: Literal["tight", "paper"] = "tight"
    """tight: scale the tilt rate only where it would exceed max_tilt_rate_deg_s. paper: equation 33
    of Xu & Pei, which makes the response slower."""
    recovery_angle_deg: Annotated[float, Field(gt=0.0, le=80.0)] = 75.0
    """Beyond this tilt the planner first rotates the vehicle towards level by the shortest way.
    The planners quaternion, so3 and euler do not.
    """
    min_thrust: Share = 0.1
    """Smallest normalised thrust commanded in flight."""
    max_thrust: Share = 0.9
    """Largest normalised thrust commanded."""
    max_climb_m_s: Annotated[float, Field(ge=0.1, le=20.0, json_schema_extra=TUNABLE)] = 2.0
    """Largest climb rate that height hold commands."""
    max_descent_m_s: Annotated[float, Field(ge=0.1, le=10.0, json_schema_extra=TUNABLE)] = 1.0
    """Largest descent rate that height hold commands."""
    fence_radius_m: Annotated[float, Field(ge=0.1, le=2000.0)] = 50.0
    """Fence: largest horizontal distance from the place where control began. Beyond this
    distance, safety.fence_action follows.
    """
    fence_ceiling_m: Annotated[float, Field(ge=0.1, le=1000.0)] = 30.0
    """Fence: largest height above the place where control began."""
    fence_floor_m: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0
    """Fence: smallest height above home. Below this height, safety.fence_action follows."""
    min_battery_percent: Annotated[float, Field(ge=0.0, le=100.0)] = 20.0
    """Smallest battery charge. Below this charge the program does not arm; in flight,
    safety.battery_action follows."""

    max_tilt = Si("max_tilt_deg")
    max_tilt_rate = Si("max_tilt_rate_deg_s")
    max_yaw_rate = Si("max_yaw_rate_deg_s")
    recovery_angle = Si("recovery_angle_deg")
    min_battery = Si("min_battery_percent")

    @property
    def max_horizontal_acceleration(self) -> float:
        """Largest horizontal acceleration by `max_tilt` at constant height, m/s²."""
        return GRAVITY * tan(self.max_tilt)

    @model_validator(mode="after")
    def _check_consistency(self) -> "LimitsConfig":
        if self.max_tilt_deg > self.recovery_angle_deg:
            raise ValueError("max_tilt_deg must not exceed recovery_angle_deg")
        if self.min_thrust >= self.max_thrust:
            raise ValueError("min_thrust must be below max_thrust")
        return self


class DeadmanConfig(Section):
    """Largest age of data. The program sends a setpoint only in answer to fresh data."""

    telemetry_stale_ms: Annotated[float, Field(ge=10.0, le=500.0)] = 100.0
    """Largest age of an attitude sample that is answered with a setpoint. Without TIMESYNC the age
    is relative to the sample with the shortest delay.
    """
    target_stale_ms: Annotated[float, Field(ge=20.0, le=500.0)] = 150.0
    """Largest age of the guidance target. With an older target no sample is answered."""
    position_stale_ms: Annotated[float, Field(ge=50.0, le=1000.0)] = 300.0
    """Largest age of the position, since its arrival and since its time stamp. With an older
    position, guidance and setpoints stop.
    """
    silence_limit_ms: Annotated[float, Field(ge=50.0, le=1000.0)] = 500.0
    """After this time without a setpoint the program hands back. Set this limit below that of the
    autopilot (PX4: COM_OF_LOSS_T, 1 s; ArduPilot: GUID_TIMEOUT, 3 s).
    """
    deadline_ms: Annotated[float, Field(gt=0.0, le=100.0)] = 4.0
    """Longest time from the arrival of a sample to its setpoint. Over TCP and serial this time
    begins with reading the sample. A later setpoint counts as a missed deadline.
    """

    telemetry_stale = Si("telemetry_stale_ms")
    target_stale = Si("target_stale_ms")
    position_stale = Si("position_stale_ms")
    silence_limit = Si("silence_limit_ms")
    deadline = Si("deadline_ms")

    @model_validator(mode="after")
    def _check_consistency(self) -> "DeadmanConfig":
        if self.silence_limit_ms < max(self.telemetry_stale_ms, self.target_stale_ms):
            raise ValueError(
                "silence_limit_ms must be at least telemetry_stale_ms and target_stale_ms"
            )
        return self
