"""The channels with the inputs and outputs of the loops; `companion replay` reads them.

This module documents the columns of the channels. Times end with `_s`. `time_s` and `received_s`
are on our clock (event-loop time). `vehicle_time_s` is the vehicle's clock without its jumps.
Positions are NED, in the frame of LOCAL_POSITION_NED. The jumps of the autopilot's estimator are
removed, except in INPUT, in ATTITUDE_TARGET and in the attitude of SAMPLE, which are recorded as
received. Rates are about the axes of the body (FRD).
"""

from companion.recording.mcap_file.fields import Channel, CodeField, Field

UNANSWERED_CODES = (
    "answered",
    "control_off",
    "another_vehicle",
    "not_newer",
    "stamped_ahead",
    "late",
    "no_target",
    "old_target",
    "awaiting_mode",
    "invalid_attitude",
    "invalid_setpoint",
    "not_sent",
    "invalid_rates",
)
"""Names of the codes in the column "unanswered"; from "another_vehicle" on, the values of
`UnansweredReason`."""
ACTION_NAMES = (
    "stand_by",
    "hold_here",
    "hold_reference",
    "give_up",
    "follow",
    "drop_command",
    "restart_planner",
    "drag_prior",
    "stop_turning",
    "move_upwind",
)
"""Names of the codes in the column "action": how a phase controls guidance or the control loop."""
QUATERNION = ("q_w", "q_x", "q_y", "q_z")
"""Names of the columns of an attitude."""
_NED, _AXES = ("north", "east", "down"), ("roll", "pitch", "yaw")


def vector_names(prefix: str, unit: str) -> tuple[str, ...]:
    """Names of the columns of a vector: north, east, down."""
    return tuple(f"{prefix}_{axis}_{unit}" for axis in _NED)


def rate_names(prefix: str) -> tuple[str, ...]:
    """Names of the columns of body rates: roll, pitch, yaw."""
    return tuple(f"{prefix}_{axis}_rad_s" for axis in _AXES)


def _vector_fields(prefix: str, unit: str, meaning: str) -> tuple[Field, ...]:
    axes = zip(vector_names(prefix, unit), _NED, strict=True)
    shown_unit = unit.replace("_s", "/s")
    return tuple(Field(name, f"{meaning}, {axis}, {shown_unit}.") for name, axis in axes)


def _rate_fields(prefix: str, meaning: str) -> tuple[Field, ...]:
    axes = zip(rate_names(prefix), _AXES, strict=True)
    return tuple(Field(name, f"{meaning} about {axis}, rad/s.") for name, axis in axes)


VEHICLE_TIME = Field("vehicle_time_s", "Time on the vehicle's clock, s.")

SAMPLE = Channel(
    "/sample",
    "One ATTITUDE_QUATERNION that reached the control loop, and whether it was answered.",
    (
        Field("received_s", "When it arrived, on our clock, s."),
        VEHICLE_TIME,
        Field("time_boot_ms", "The vehicle's time stamp as received, ms."),
        Field("age_s", "Age at arrival, s. NaN: the time stamp does not fit the vehicle's clock."),
        *(Field(name, "Attitude, body FRD to world NED.") for name in QUATERNION),
        *_rate_fields("measured", "Measured rate"),
        Field("checked_s", "When the age was checked again before sending, on our clock, s."),
    ),
    (
        CodeField("unanswered", "Why it is unanswered; 0: it was answered.", UNANSWERED_CODES),
        CodeField(
            "misfit", "Why its time stamp does not fit the clock.", ("none", "not_newer", "ahead")
        ),
        CodeField(
            "age_known", "Whether `age_s` is absolute; else relative to the quickest sample."
        ),
        CodeField("on", "Whether the control loop is on; while it is off, no sample is answered."),
        CodeField("taking_over", "Whether offboard was requested."),
        CodeField("offboard_active", "Whether the autopilot obeys the setpoints."),
        CodeField("awaiting_mode", "Whether the mode must be confirmed after a gap."),
        CodeField("same_vehicle", "Whether it comes from the vehicle that was checked."),
    ),
)
SETPOINT = Channel(
    "/setpoint",
    "One setpoint that was sent in answer to a sample, and the inputs of the planner.",
    (
        Field("received_s", "When its sample arrived, on our clock, s."),
        VEHICLE_TIME,
        *_rate_fields("commanded", "Commanded body rate"),
        Field("thrust", "Collective thrust, 0..1."),
        Field("latency_us", "From the sample's arrival to the setpoint, µs. 0 in virtual time."),
        Field("target_north", "Acceleration coefficient that the planner flies to, north."),
        Field("target_east", "Acceleration coefficient that the planner flies to, east."),
        Field("target_heading_rad", "Heading that the planner flies to, rad."),
        Field("target_heading_rate_rad_s", "Feedforward of the heading, rad/s."),
        *(Field(name, "Attitude as the planner sees it, body FRD to NED.") for name in QUATERNION),
        Field("measured_north", "Acceleration coefficient of this attitude, north."),
        Field("measured_east", "Acceleration coefficient of this attitude, east."),
        Field("planned_north", "Coefficient planned for this moment, north; NaN: no plan."),
        Field("planned_east", "Coefficient planned for this moment, east; NaN: no plan."),
    ),
    (
        CodeField(
            "tilt_rate_limited", "Whether the roll-pitch rate is at limits.max_tilt_rate_deg_s."
        ),
        CodeField("yaw_rate_limited", "Whether the yaw rate is at limits.max_yaw_rate_deg_s."),
        CodeField("thrust_limited", "Whether the thrust is at one of its limits."),
        CodeField("offboard_active", "Whether the autopilot obeys the setpoints."),
        CodeField("is_step", "Whether it is part of an open-loop step whose response is measured."),
        CodeField("idle", "Whether it is the idle setpoint on the ground."),
    ),
)
GUIDANCE = Channel(
    "/guidance",
    "One step of guidance in flight: reference, estimate, wind, drag.",
    (
        Field("time_s", "Time on our clock, s."),
        VEHICLE_TIME,
        *_vector_fields("reference", "m", "Position of the reference"),
        *_vector_fields("reference", "m_s", "Velocity of the reference"),
        Field("reference_heading_rad", "Heading of the reference, rad."),
        *_vector_fields("estimated", "m", "Estimated position now"),
        *_vector_fields("estimated", "m_s", "Estimated velocity now"),
        Field("error_m", "Distance from the reference, m. NaN: no reference, or open loop."),
        Field("wind_north_m_s2", "Acceleration by wind and bias, north, m/s²."),
        Field("wind_east_m_s2", "Acceleration by wind and bias, east, m/s²."),
        Field("drag_per_s", "Linear drag per mass, as learned so far, 1/s."),
        Field("quadratic_drag_per_m", "Quadratic drag per mass, as learned so far, 1/m."),
    ),
    (
        CodeField("holds_position", "Whether guidance holds the reference horizontally."),
        CodeField("holds_height", "Whether guidance holds the height of the reference."),
        CodeField(
            "height_steady",
            "Whether the thrust is steady: no climb doublet, no rates or thrust from a program.",
        ),
        CodeField("offboard_active", "Whether the autopilot obeys the setpoints."),
    ),
)
TARGET = Channel(
    "/target",
    "One command of guidance to the control loop; it holds until the next one.",
    (
        Field("time_s", "When it was made, on our clock, s."),
        Field("north", "Target coefficient, north."),
        Field("east", "Target coefficient, east."),
        Field("heading_rad", "Target heading, rad."),
        Field("heading_rate_rad_s", "Feedforward of the heading, rad/s."),
        Field("later_north", "Target one period later, north; NaN: the target is constant."),
        Field("later_east", "Target one period later, east; NaN: the target is constant."),
        Field("later_heading_rad", "Target heading one period later, rad."),
        Field("later_heading_rate_rad_s", "Feedforward of the heading one period later, rad/s."),
        Field("acceleration_down_m_s2", "Wanted vertical acceleration, down, m/s²."),
        *_rate_fields("body", "Body rate to send instead of the planner's (NaN: the planner's)"),
        Field("thrust", "Thrust, 0..1, that replaces the computed one; NaN: not replaced."),
        Field("turn_rad", "Sum of the heading resets when it was made, rad."),
        Field("period_s", "Period of guidance, s."),
    ),
    (
        CodeField("idle", "Zero rates and zero thrust, on the ground."),
        CodeField("is_step", "Whether it is an open-loop step whose response is measured."),
    ),
)
INPUT = Channel(
    "/guidance_input",
    "The telemetry that one step of guidance read; `companion replay` needs it.",
    (
        Field("time_s", "When the step began, on our clock, s."),
        Field("position_received_s", "When the newest position arrived, on our clock, s."),
        Field("position_vehicle_time_s", "Time stamp of this position on the vehicle's clock, s."),
        *_vector_fields("position", "m", "LOCAL_POSITION_NED, position"),
        *_vector_fields("velocity", "m_s", "LOCAL_POSITION_NED, velocity"),
        Field("clock_offset_s", "Vehicle time minus our time, s; NaN: not known."),
        Field("battery_received_s", "When the battery was reported, on our clock, s."),
        Field("battery_v", "Battery voltage, V."),
        Field("autopilot_thrust_received_s", "When ATTITUDE_TARGET arrived, on our clock, s."),
        Field("autopilot_thrust", "Thrust in ATTITUDE_TARGET, 0..1."),
        Field("height_m", "Height above home, m."),
    ),
    (
        CodeField("armed", "Whether the vehicle is armed."),
        CodeField("fresh", "Whether the position is fresh."),
        CodeField("standing", "Whether the vehicle stands on the ground."),
        CodeField("may_idle", "Whether zero thrust is safe."),
        CodeField("offboard_active", "Whether the autopilot obeys the setpoints."),
    ),
)
ATTITUDE_TARGET = Channel(
    "/attitude_target",
    "A new ATTITUDE_TARGET of an autopilot that takes body rates along its axes.",
    (
        Field("time_boot_ms", "The vehicle's time stamp as received, ms."),
        *(Field(name, "Attitude target, body FRD to world NED.") for name in QUATERNION),
    ),
)
ACTION = Channel(
    "/action",
    "A call by which a phase controls guidance or the control loop; for `companion replay`.",
    (
        Field("time_s", "Time on our clock, s."),
        Field("clock_offset_s", "Vehicle time minus our time, s; NaN: not known."),
        Field("drag_per_s", "For `drag_prior`: linear drag of an earlier flight, 1/s."),
        Field("quadratic_drag_per_m", "For `drag_prior`: its quadratic drag, 1/m."),
    ),
    (CodeField("action", "The name of the call.", ACTION_NAMES),),
)
