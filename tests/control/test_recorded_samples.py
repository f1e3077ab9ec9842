"""What the control loop records of a sample: each number in the column of its name."""

from math import isnan, nan

import pytest

from companion.attitude import BodyRates, Limits, Target, make_planner
from companion.attitude.history import PlannedTilt
from companion.control.control_loop import ControlLoop
from companion.control.guidance_command import GuidanceCommand
from companion.control.loop_record import Deadlines, UnansweredReason
from companion.control.sample_rows import Answer, LoopFlags, SampleEntry, SampleWriter
from companion.guidance import HoverThrust, ThrustSettings
from companion.recording.mcap_file.loop_channels import UNANSWERED_CODES
from companion.recording.trace import FlightTrace
from companion.vehicle.clock_jumps import Misfit
from companion.vehicle.records import AttitudeSample, AttitudeTarget
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
    SampleWriter(LIMITS, (0.1, 0.9)).sample(kept, 77, entry)
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
        rates=BodyRates(1.0, 1.0, -1.0),
        thrust=0.1,
        planner_input=None,
        planned_tilt=None,
        is_step=False,
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


@pytest.mark.parametrize("reason", UnansweredReason)
def test_why_a_sample_is_unanswered_has_a_number(reason):
    kept = recorded(SampleEntry(SAMPLE, reason, FLAGS, nan, None))
    assert list(kept.messages) == ["/sample"]
    assert UNANSWERED_CODES[kept.rows("/sample")[0]["unanswered"]] == reason.value


@pytest.mark.parametrize(("misfit", "code"), [(Misfit.NOT_NEWER, 1), (Misfit.AHEAD, 2)])
def test_a_sample_while_the_loop_is_off_and_a_misfit(misfit, code):
    sample, flags = SAMPLE._replace(misfit=misfit), FLAGS._replace(on=False)
    (row,) = recorded(SampleEntry(sample, None, flags, nan, None)).rows("/sample")
    assert (UNANSWERED_CODES[row["unanswered"]], row["misfit"]) == ("control_off", code)


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
    assert (UNANSWERED_CODES[row["unanswered"]], answer) == ("late", None)
    assert isnan(row["checked_s"])  # the check of the sample before does not count
    bench.loop.on = False
    row, answer = bench.sample(SAMPLE._replace(vehicle_time=3.75))
    assert (UNANSWERED_CODES[row["unanswered"]], answer) == ("control_off", None)
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
    _, answer = bench.sample(SAMPLE._replace(vehicle_time=3.75))  # by the planner
    assert (answer["tilt_rate_limited"], answer["yaw_rate_limited"]) == (1, 1)


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
