"""All channels of numbers in `flight.mcap`, with those of the status a few times a second.

The columns follow the conventions of `companion.recording.mcap_file.loop_channels`.
"""

from companion.recording.mcap_file.fields import Channel, Field
from companion.recording.mcap_file.loop_channels import (
    ACTION,
    ATTITUDE_TARGET,
    GUIDANCE,
    INPUT,
    SAMPLE,
    SETPOINT,
    TARGET,
    VEHICLE_TIME,
)

THRUST = Channel(
    "/thrust",
    "The thrust estimator, ten times a second.",
    (
        Field("time_s", "When, on our clock, s."),
        Field("hover_thrust", "Learned thrust at hover, 0..1."),
        Field("smallest_m_s2", "Smallest specific thrust that is sent, m/s²."),
        Field("largest_m_s2", "Largest specific thrust that is sent, m/s²."),
        Field("sent", "Thrust last sent, 0..1."),
        Field("battery_v", "Battery voltage, V."),
        Field("battery_remaining", "Remaining charge, 0..1."),
    ),
)
MOTION = Channel(
    "/motion",
    "The motion in all phases, ten times a second.",
    (
        Field("time_s", "s since the flight began."),
        VEHICLE_TIME,
        Field("height_m", "Height above home, m."),
        Field("speed_m_s", "Speed, m/s."),
        Field("tilt_deg", "Tilt, degrees."),
        Field("error_m", "Distance from the reference, m."),
    ),
)
RESOURCES = Channel(
    "/resources",
    "What the flight takes from the computer, and the counters of the link, once a second.",
    (
        Field("time_s", "When, on our clock, s."),
        Field("processor_share", "Processor time per time, 1: one core."),
        Field("memory_mb", "Largest memory so far, MB."),
        Field("recording_waiting", "Rows that wait to be written."),
        Field("recording_dropped", "Rows and frames that were not recorded so far."),
        Field("frames", "Frames received so far."),
        Field("frames_lost", "Frames of the vehicle lost so far."),
        Field("sent", "Frames sent so far."),
        Field("round_trip_ms", "Round trip of TIMESYNC, ms."),
        Field("setpoints", "Setpoints sent so far."),
        Field("missed_deadlines", "Setpoints later than deadman.deadline_ms so far."),
    ),
)

CHANNELS = (
    SAMPLE,
    SETPOINT,
    GUIDANCE,
    TARGET,
    INPUT,
    ATTITUDE_TARGET,
    ACTION,
    THRUST,
    MOTION,
    RESOURCES,
)
