"""All channels of `flight.mcap`.

The status channels, with a message once or ten times a second, are defined here.

The columns follow the conventions of `companion.recording.mcap_file.loop_channels`, but `time_s` of
MOTION counts from the beginning of the flight.
"""

from companion.recording.mcap_file import cdr
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
from companion.recording.mcap_file.scene import SCENE_UPDATE

THRUST = Channel(
    "/thrust",
    "The thrust estimator, ten times a second.",
    (
        Field("time_s", "Time on our clock, s."),
        Field("hover_thrust", "Learned thrust at hover at the battery's initial voltage, 0..1."),
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
        Field("time_s", "Time since the flight began, s."),
        VEHICLE_TIME,
        Field("height_m", "Height above home, m."),
        Field("speed_m_s", "Speed, m/s."),
        Field("tilt_deg", "Tilt, degrees."),
        Field("error_m", "Distance from the reference, m. NaN: no reference, or open loop."),
    ),
)
RESOURCES = Channel(
    "/resources",
    "The flight's use of the computer, and the counters of the link, once a second.",
    (
        Field("time_s", "Time on our clock, s."),
        Field("processor_share", "Processor load of the program; 1: one core fully used."),
        Field("memory_mb", "Largest memory so far, MB."),
        Field("recording_waiting", "Entries of this file that wait to be written."),
        Field("recording_dropped", "Entries of this file that were not recorded so far."),
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
"""The channels of numbers."""
TOPICS = {
    **{channel.topic: channel.type for channel in CHANNELS},
    "/phase": cdr.PHASE,
    "/maneuver": cdr.MANEUVER,
    "/alarm": cdr.ALARM,
    "/change": cdr.CHANGE,
    "/log": cdr.LOG,
    "/tf": cdr.FRAME_TRANSFORM,
    "/pose": cdr.POSE_IN_FRAME,
    "/reference": cdr.POSE_IN_FRAME,
    "/scene": SCENE_UPDATE,
    "/paths": SCENE_UPDATE,
    "/fence": SCENE_UPDATE,
}
"""All channels, and the types of their messages, as the file and the live stream announce them."""
ENCODING, SCHEMA_ENCODING = "cdr", "ros2msg"
"""Encoding of the messages, and of their definitions, as MCAP names them."""
