"""What the loops record: each number is in the column of its name, and NaN where there is none."""

from math import isnan, nan, sqrt

import pytest

from companion.attitude import BodyRates, Limits, Target, make_planner
from companion.attitude.history import PlannedTilt
from companion.control.control_loop import ControlLoop
from companion.control.guidance_command import GuidanceCommand
from companion.control.loop_record import Deadlines, Unanswered
from companion.control.sample_rows import Answer, LoopFlags, SampleEntry, SampleRows
from companion.control.step_rows import StepEntry, StepFlags, StepInput, StepOutput, StepRows
from companion.drag import Drag
from companion.guidance import GuidanceInput, HoverThrust, Reference, ThrustSettings, VehicleMotion
from companion.recording.mcap_file import cdr
from companion.recording.mcap_file.loop_channels import REASONS
from companion.recording.trace import FlightTrace
from companion.vehicle.clock_jumps import Misfit
from companion.vehicle.records import (
    AttitudeSample,
    AttitudeTarget,
    AttitudeTargetThrust,
    Battery,
    LocalPosition,
)
from tests.control.kept_messages import KeptMessages

LIMITS = Limits(0.6, 1.5, 1.0)
Q = (0.8, 0.4, -0.4, 0.2)  # of length 1
SAMPLE = AttitudeSample(3004, 3.25, 10.5, 2000, Q, BodyRates(0.1, 0.2, 0.3), 0.01, None, True)
FLAGS = LoopFlags(True, False, True, False, True)
ANSWER = Answer(
    BodyRates(0.9, -1.2, 0.5),
    0.9,
    1500,
    ((1.0, 0.0, 0.0, 0.0), Target(0.1, 0.2, 0.3, 0.4)),
    PlannedTilt(0.5, 0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    True,
    False,
)


def recorded(entry):
    kept = KeptMessages()
    SampleRows(LIMITS, (0.1, 0.9)).sample(kept, 77, entry)
    assert {time for rows in kept.messages.values() for time, _ in rows} == {77}
    return kept


def names_of(q):
    return dict(zip(("q_w", "q_x", "q_y", "q_z"), q, strict=True))


def test_a_sample_and_its_setpoint_in_their_columns():
    kept = recorded(SampleEntry(SAMPLE, None, FLAGS, 10.75, ANSWER))
    assert list(kept.messages) == ["/sample", "/setpoint"]
    assert kept.rows("/sample") == [
        {
            "received_s": 10.5,
            "vehicle_time_s": 3.25,
            "time_boot_ms": 3004,
            "age_s": 0.01,
            **names_of(Q),
            "measured_roll_rad_s": 0.1,
            "measured_pitch_rad_s": 0.2,
            "measured_yaw_rad_s": 0.3,
            "checked_s": 10.75,
            "unanswered": 0,
            "misfit": 0,
            "age_known": 1,
            "on": 1,
            "taking_over": 0,
            "offboard_active": 1,
            "awaiting_mode": 0,
            "same_vehicle": 1,
        }
    ]
    assert kept.rows("/setpoint") == [
        {
            "received_s": 10.5,
            "vehicle_time_s": 3.25,
            "commanded_roll_rad_s": 0.9,
            "commanded_pitch_rad_s": -1.2,
            "commanded_yaw_rad_s": 0.5,
            "thrust": 0.9,
            "latency_us": 1.5,
            "target_north": 0.1,
            "target_east": 0.2,
            "target_heading_rad": 0.3,
            "target_heading_rate_rad_s": 0.4,
            **names_of((1.0, 0.0, 0.0, 0.0)),
            "measured_north": 0.0,
            "measured_east": 0.0,
            "planned_north": 0.5,
            "planned_east": 0.6,
            "tilt_rate_limited": 1,
            "yaw_rate_limited": 0,
            "thrust_limited": 1,
            "offboard_active": 1,
            "is_step": 1,
            "idle": 0,
        }
    ]


def test_rates_of_guidance_have_no_target_and_no_plan():
    answer = ANSWER._replace(
        rates=BodyRates(1.0, 1.0, -1.0), thrust=0.1, asked=None, planned=None, is_step=False
    )
    off = FLAGS._replace(offboard_active=False)
    (row,) = recorded(SampleEntry(SAMPLE, None, off, nan, answer)).rows("/setpoint")
    assert [name for name, value in row.items() if isnan(value)] == [
        "target_north",
        "target_east",
        "target_heading_rad",
        "target_heading_rate_rad_s",
        "planned_north",
        "planned_east",
    ]
    assert {name: row[name] for name in ("q_w", "q_x", "q_y", "q_z")} == names_of(Q)
    w, x, y, z = Q  # thrust along -z of the body: the third column of the rotation matrix
    assert row["measured_north"] == pytest.approx(-2.0 * (x * z + w * y))
    assert row["measured_east"] == pytest.approx(2.0 * (w * x - y * z))
    assert (row["tilt_rate_limited"], row["yaw_rate_limited"]) == (0, 1)
    assert (row["thrust_limited"], row["offboard_active"], row["is_step"]) == (1, 0, 0)
    idle = answer._replace(thrust=0.1, idle=True)
    (row,) = recorded(SampleEntry(SAMPLE, None, FLAGS, nan, idle)).rows("/setpoint")
    assert (row["thrust_limited"], row["idle"]) == (0, 1)


@pytest.mark.parametrize("reason", Unanswered)
def test_why_a_sample_is_unanswered_has_a_number(reason):
    kept = recorded(SampleEntry(SAMPLE, reason, FLAGS, nan, None))
    assert list(kept.messages) == ["/sample"]
    assert REASONS[kept.rows("/sample")[0]["unanswered"]] == reason.value


@pytest.mark.parametrize(("misfit", "code"), [(Misfit.NOT_NEWER, 1), (Misfit.AHEAD, 2)])
def test_a_sample_while_the_loop_is_off_and_a_misfit(misfit, code):
    sample, flags = SAMPLE._replace(misfit=misfit), FLAGS._replace(on=False)
    (row,) = recorded(SampleEntry(sample, None, flags, nan, None)).rows("/sample")
    assert (REASONS[row["unanswered"]], row["misfit"]) == ("control_off", code)


class Loop:
    """A control loop that is recorded."""

    def __init__(self):
        self.kept, self.now, self.sent = KeptMessages(), 10.5, []
        self.loop = ControlLoop(
            make_planner("first-order", limits=LIMITS),
            HoverThrust(ThrustSettings(0.5, 0.4, 1.5, 0.1, 0.9)),
            self.send,
            Deadlines(telemetry_stale=0.1, target_stale=0.15, deadline=0.004),
            FlightTrace(recorder=self.kept),
            LIMITS,
            lambda: self.now,
            lambda: 5000,
        )
        self.loop.on = True

    def send(self, stamp, rates, thrust):
        self.sent.append((*rates, thrust))
        return True

    def sample(self, sample=SAMPLE, **command):
        """The rows of one sample; `command`: changes of a level one."""
        level = GuidanceCommand(Target(0.0, 0.0, 0.0), 0.0, 10.5)
        self.loop.command = level._replace(**command)
        before = len(self.kept.messages["/setpoint"])
        self.loop.on_sample(sample)
        answers = self.kept.rows("/setpoint")[before:]
        return self.kept.rows("/sample")[-1], answers[0] if answers else None


def test_the_loop_records_what_it_took_and_sent():
    bench = Loop()
    bench.loop.taking_over = True
    target = Target(0.1, -0.2, 0.3)
    sample, answer = bench.sample(target=target, is_step=True)
    assert bench.kept.messages["/sample"][0][0] == 10_500_000_000
    assert (sample["unanswered"], sample["checked_s"], sample["received_s"]) == (0, 10.5, 10.5)
    flags = [sample[name] for name in LoopFlags._fields]
    assert flags == [1, 1, 0, 0, 1]
    assert (answer["target_north"], answer["target_east"]) == (0.1, -0.2)
    assert (answer["latency_us"], answer["is_step"], answer["idle"]) == (3.0, 1, 0)
    assert isnan(answer["planned_north"])
    commanded = ("commanded_roll_rad_s", "commanded_pitch_rad_s", "commanded_yaw_rad_s", "thrust")
    assert tuple(answer[name] for name in commanded) == bench.sent[0]
    _, answer = bench.sample(SAMPLE._replace(vehicle_time=3.5), body_rates=BodyRates(0.0, 0.3, 0.0))
    assert (answer["commanded_pitch_rad_s"], answer["is_step"]) == (0.3, 0)
    assert isnan(answer["target_north"])
    _, answer = bench.sample(SAMPLE._replace(vehicle_time=3.75), idle=True)
    assert (answer["idle"], answer["thrust"]) == (1, 0.0)
    assert isnan(answer["target_north"])


def test_the_loop_records_what_it_does_not_answer():
    bench = Loop()
    bench.sample()
    late = SAMPLE._replace(vehicle_time=3.5, age=0.2)
    row, answer = bench.sample(late)
    assert (REASONS[row["unanswered"]], answer) == ("late", None)
    assert isnan(row["checked_s"])  # the check of the sample before does not count
    bench.loop.on = False
    row, answer = bench.sample(SAMPLE._replace(vehicle_time=3.75))
    assert (REASONS[row["unanswered"]], answer) == ("control_off", None)
    bench.loop.is_same_vehicle = lambda: False
    assert bench.sample(late)[0]["same_vehicle"] == 0


def test_limits_that_changed_in_flight_count_for_the_flags():
    bench = Loop()
    rates = BodyRates(0.0, 0.5, 0.25)
    _, answer = bench.sample(body_rates=rates)
    assert (answer["tilt_rate_limited"], answer["yaw_rate_limited"]) == (0, 0)
    constants = make_planner("first-order", limits=LIMITS).constants
    bench.loop.retune(constants, Limits(0.6, 0.5, 0.25))
    _, answer = bench.sample(SAMPLE._replace(vehicle_time=3.5), body_rates=rates)
    assert (answer["tilt_rate_limited"], answer["yaw_rate_limited"]) == (1, 1)
    assert answer["thrust_limited"] == 0


def test_what_a_phase_tells_the_loop_and_a_new_attitude_target_are_recorded():
    bench = Loop()
    bench.sample()
    bench.now = 11.0
    bench.loop.drop_command()
    bench.loop.restart_planner()
    assert bench.loop.command is None
    assert bench.kept.actions == [(11.0, "drop_command", None), (11.0, "restart_planner", None)]
    target = AttitudeTarget(3000, Q)
    bench.loop.planner.attitude_target = lambda: target
    bench.now = 11.25
    bench.sample(SAMPLE._replace(vehicle_time=3.5))
    bench.sample(SAMPLE._replace(vehicle_time=3.75))
    assert bench.kept.rows("/attitude_target") == [{"time_boot_ms": 3000, **names_of(Q)}]
    assert bench.kept.messages["/attitude_target"][0][0] == 11_250_000_000


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
    0.8,
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
    kept, rows = KeptMessages(), StepRows()
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
    kept, rows = KeptMessages(), StepRows()
    nothing = StepInput(20.0, None, None, None, None, None, None, READ.flags)
    rows.step(kept, 88, StepEntry(nothing, None, None))
    assert list(kept.messages) == ["/guidance_input"]
    (row,) = kept.rows("/guidance_input")
    assert all(isnan(value) for value in list(row.values())[1:-5])
    assert (row["time_s"], row["armed"]) == (20.0, 0)
    plain = GuidanceCommand(Target(0.1, 0.2, 0.3), -0.5, 20.0)
    rows.step(kept, 88, StepEntry(READ, MADE._replace(error=None), plain))
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
    kept, rows = KeptMessages(), StepRows()
    for _ in range(4):
        rows.step(kept, 88, StepEntry(READ, MADE, COMMAND))
    w, x, y, z = Q
    half = sqrt(0.5)
    turned = half * (x + y), half * (x - y), half * (w - z), half * (w + z)
    here, there = (2.5, 1.5, 3.5, *turned), (5.0, 4.0, 6.0, *turned)
    world = cdr.PoseEncoder("world")
    transform = cdr.PoseEncoder("world", "vehicle").message(88, here)
    assert kept.messages["/tf"] == 2 * [(88, transform)]
    assert kept.messages["/pose"] == 2 * [(88, world.message(88, here))]
    assert kept.messages["/reference"] == 2 * [(88, world.message(88, there))]
    level = MADE._replace(q=(1.0, 0.0, 0.0, 0.0))  # towards north: turned left by 90° from east
    rows.step(kept, 88, StepEntry(READ, level, None))
    rows.step(kept, 88, StepEntry(READ, level, None))
    north = world.message(88, (2.5, 1.5, 3.5, 0.0, 0.0, half, half))
    assert kept.messages["/pose"][-1] == (88, north)
