"""What guidance records of a step: each number in the column of its name, and NaN without one."""

from math import isnan, sqrt

from companion.attitude import BodyRates, Target
from companion.control.guidance_command import GuidanceCommand
from companion.control.heading_frame import HeadingFrame
from companion.control.step_rows import StepEntry, StepFlags, StepInput, StepOutput, StepWriter
from companion.drag import Drag
from companion.guidance import GuidanceInput, Reference, VehicleMotion
from companion.recording.mcap_file import cdr
from companion.vehicle.records import AttitudeTargetThrust, Battery, LocalPosition
from tests.control.kept_messages import KeptMessages

Q = (0.8, 0.4, -0.4, 0.2)  # of length 1
READ = StepInput(
    20.0,
    LocalPosition(19.5, 13.5, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0)),
    -6.0,
    Battery(18.5, 15.5, 0.5),
    AttitudeTargetThrust(19.0, 0.45),
    7.5,
    True,
    StepFlags(True, False, True, False),
)
COMMAND = GuidanceCommand(
    Target(0.1, 0.2, 0.3, 0.4),
    -0.5,
    20.0,
    False,
    True,
    BodyRates(0.5, 0.6, 0.7),
    0.55,
    HeadingFrame(0.8),
    Target(0.11, 0.21, 0.31, 0.41),
    0.02,
)
MADE = StepOutput(
    14.0,
    Q,
    GuidanceInput(
        VehicleMotion((1.5, 2.5, -3.5), (0.1, 0.2, 0.3)),
        VehicleMotion((9.0, 9.0, 9.0), (9.0, 9.0, 9.0)),
        (9.0, 9.0),
        (0.6, 0.7),
        Drag(0.25, 0.03),
        (2.0, 18.0),
    ),
    Reference((4.0, 5.0, -6.0), (0.4, 0.5, 0.6), heading=0.9),
    1.25,
)


def columns(prefix, unit, values):
    names = (f"{prefix}_{axis}_{unit}" for axis in ("north", "east", "down"))
    return dict(zip(names, values, strict=True))


def test_a_step_in_its_columns():
    kept, rows = KeptMessages(), StepWriter()
    rows.step(kept, 88, StepEntry(READ, MADE, COMMAND))
    assert list(kept.messages) == ["/guidance_input", "/target", "/guidance"]
    assert {time for messages in kept.messages.values() for time, _ in messages} == {88}
    assert kept.rows("/guidance_input") == [
        {
            "time_s": 20.0,
            "position_received_s": 19.5,
            "position_vehicle_time_s": 13.5,
            **columns("position", "m", (1.0, 2.0, 3.0)),
            **columns("velocity", "m_s", (4.0, 5.0, 6.0)),
            "clock_offset_s": -6.0,
            "battery_received_s": 18.5,
            "battery_v": 15.5,
            "autopilot_thrust_received_s": 19.0,
            "autopilot_thrust": 0.45,
            "height_m": 7.5,
            "armed": 1,
            "fresh": 1,
            "standing": 0,
            "may_idle": 1,
            "offboard_active": 0,
        }
    ]
    assert kept.rows("/target") == [
        {
            "time_s": 20.0,
            "north": 0.1,
            "east": 0.2,
            "heading_rad": 0.3,
            "heading_rate_rad_s": 0.4,
            "later_north": 0.11,
            "later_east": 0.21,
            "later_heading_rad": 0.31,
            "later_heading_rate_rad_s": 0.41,
            "acceleration_down_m_s2": -0.5,
            "body_roll_rad_s": 0.5,
            "body_pitch_rad_s": 0.6,
            "body_yaw_rad_s": 0.7,
            "thrust": 0.55,
            "turn_rad": 0.8,
            "period_s": 0.02,
            "idle": 0,
            "is_step": 1,
        }
    ]
    assert kept.rows("/guidance") == [
        {
            "time_s": 20.0,
            "vehicle_time_s": 14.0,
            **columns("reference", "m", (4.0, 5.0, -6.0)),
            **columns("reference", "m_s", (0.4, 0.5, 0.6)),
            "reference_heading_rad": 0.9,
            **columns("estimated", "m", (1.5, 2.5, -3.5)),
            **columns("estimated", "m_s", (0.1, 0.2, 0.3)),
            "error_m": 1.25,
            "wind_north_m_s2": 0.6,
            "wind_east_m_s2": 0.7,
            "drag_per_s": 0.25,
            "quadratic_drag_per_m": 0.03,
            "holds_position": 1,
            "holds_height": 1,
            "height_steady": 1,
            "offboard_active": 0,
        }
    ]


def test_what_a_step_does_not_know_is_nan():
    kept, rows = KeptMessages(), StepWriter()
    nothing = StepInput(20.0, None, None, None, None, None, None, READ.flags)
    rows.step(kept, 88, StepEntry(nothing, None, None))
    assert list(kept.messages) == ["/guidance_input"]
    (row,) = kept.rows("/guidance_input")
    assert all(isnan(value) for value in list(row.values())[1:-5])
    assert (row["time_s"], row["armed"]) == (20.0, 0)
    plain = GuidanceCommand(Target(0.1, 0.2, 0.3), -0.5, 20.0)
    rows.step(kept, 88, StepEntry(READ, MADE._replace(tracking_error=None), plain))
    (row,) = kept.rows("/target")
    assert [name for name, value in row.items() if isnan(value)] == [
        "later_north",
        "later_east",
        "later_heading_rad",
        "later_heading_rate_rad_s",
        "body_roll_rad_s",
        "body_pitch_rad_s",
        "body_yaw_rad_s",
        "thrust",
    ]
    assert isnan(kept.rows("/guidance")[0]["error_m"])


def test_each_second_step_draws_the_vehicle_and_its_reference_east_north_up():
    kept, rows = KeptMessages(), StepWriter()
    for _ in range(4):
        rows.step(kept, 88, StepEntry(READ, MADE, COMMAND))
    w, x, y, z = Q
    half = sqrt(0.5)
    turned = half * (x + y), half * (x - y), half * (w - z), half * (w + z)
    here, there = (2.5, 1.5, 3.5, *turned), (5.0, 4.0, 6.0, *turned)
    transform = cdr.pose_message(88, here, "world", "vehicle")
    assert kept.messages["/tf"] == 2 * [(88, transform)]
    assert kept.messages["/pose"] == 2 * [(88, cdr.pose_message(88, here, "world"))]
    assert kept.messages["/reference"] == 2 * [(88, cdr.pose_message(88, there, "world"))]
    level = MADE._replace(q=(1.0, 0.0, 0.0, 0.0))  # towards north: turned left by 90° from east
    rows.step(kept, 88, StepEntry(READ, level, None))
    rows.step(kept, 88, StepEntry(READ, level, None))
    north = cdr.pose_message(88, (2.5, 1.5, 3.5, 0.0, 0.0, half, half), "world")
    assert kept.messages["/pose"][-1] == (88, north)
