"""The commands of the guidance loop, on the ground, in a hold, and while a maneuver flies."""

import asyncio
from math import cos, inf, nan, radians, sin
from types import SimpleNamespace

import pytest

from companion.attitude import BodyRates, Target
from companion.config import Config
from companion.control.estimator_resets import EstimatorResets
from companion.control.guidance_command import GuidanceCommand
from companion.control.guidance_loop import GuidanceLoop
from companion.control.heading_frame import HeadingFrame
from companion.control.outer_loop import make_guidance, motion_estimate
from companion.control.telemetry import GuidedVehicle
from companion.guidance import Doublets, ManeuverSequence, Pose
from companion.guidance.braking import AssumedBraking
from companion.guidance.linear import LinearCommand
from companion.guidance.source import ManeuverSource
from companion.recording.trace import FlightTrace
from companion.vehicle.clock import VehicleClock
from companion.vehicle.records import AttitudeSample, LocalPosition
from tests.control.kept_messages import KeptMessages

DOUBLETS = Doublets(
    1.0, 0.25, 0.8, 1.0, climb_acceleration=2.0, climb_step_time=0.25, settle_time=1.0
)
IN_FIRST_DOUBLET, IN_HOLD, IN_CLIMB = 1.1, 3.0, DOUBLETS.duration - 1.5
HERE = (3.0, 4.0, -5.0)


class HoverSpy:
    """Counts its calls."""

    smallest_specific_thrust, largest_specific_thrust, largest_tilted_thrust = 2.0, 18.0, 18.0

    def __init__(self):
        self.observed = self.paused = 0

    def observe(self, time, velocity_down):
        self.observed += 1

    def note_voltage(self, time, voltage):
        raise AssertionError("no voltage is known here")

    def pause(self):
        self.paused += 1

    def on_ground(self):
        """Ignore it."""


class Bench:
    """A guidance loop that flies the doublets, with a clock set by hand."""

    def __init__(self, recorder=None, *, begun=True):
        self.now, self.clock = 10.0, VehicleClock()
        self.hover = HoverSpy()
        self.loop = SimpleNamespace(command=None, offboard_active=True, resets=EstimatorResets())
        self.state = SimpleNamespace(
            position=None, battery=None, attitude_target_thrust=None, height=5.0, armed=True
        )
        self.ground = SimpleNamespace(standing=False, may_idle=True)
        self.guidance_loop = GuidanceLoop(
            self.loop,
            make_guidance(Config()),
            motion_estimate(Config(), lambda: None),
            self.hover,
            GuidedVehicle(self.state, self.ground, self.clock),
            FlightTrace(recorder=recorder),
            max_tilt=radians(30.0),
            assumed_braking=AssumedBraking(0.3, 2.5),
            period=0.02,
            max_position_age=0.3,
            clock=lambda: self.now,
        )
        if begun:
            self.fly(0.0, HERE)
            self.guidance_loop.hold_here()
            self.guidance_loop.follow(ManeuverSource(ManeuverSequence([DOUBLETS])))

    def fly(self, after, position=HERE, tilt=0.0):
        """One step of guidance, `after` s into the maneuver, at a position and roll angle (°)."""
        self.now = 10.0 + after
        self.state.position = LocalPosition(self.now, self.now, position, (0.0, 0.0, 0.0))
        half = 0.5 * radians(tilt)
        q, still = (cos(half), sin(half), 0.0, 0.0), BodyRates(0.0, 0.0, 0.0)
        reading = self.clock.take(round(1000 * self.now), self.now)
        sample = AttitudeSample(0, self.now, self.now, 0, q, still, *reading[1:])
        self.guidance_loop.note_attitude(sample)
        self.guidance_loop.step()
        return self.loop.command


def test_a_doublets_rates_go_to_the_loop_and_hold_gives_it_a_target():
    bench = Bench()
    assert bench.fly(IN_FIRST_DOUBLET).body_rates == BodyRates(0.5, 0.0, 0.0)
    command = bench.fly(IN_HOLD, position=(0.0, 4.0, -5.0))
    assert command.body_rates is None
    assert command.target.north > 0.1


def test_a_doublet_that_tilts_too_far_is_given_up_for_good():
    bench = Bench()
    bench.fly(IN_FIRST_DOUBLET, tilt=29.0)
    assert bench.guidance_loop.hold.give_up_reason is None
    command = bench.fly(IN_FIRST_DOUBLET + 0.02, tilt=31.0)
    assert command.body_rates is None
    assert bench.guidance_loop.hold.give_up_reason == (
        "identify was ended, because the vehicle tilts by 31°, more than limits.max_tilt_deg = 30"
    )
    assert bench.guidance_loop.flown_source.pose.position_ned == pytest.approx(HERE, abs=0.01)
    assert bench.fly(IN_FIRST_DOUBLET + 0.04).body_rates is None
    assert not bench.guidance_loop.finished


def test_on_the_way_back_from_a_doublet_the_vehicle_is_not_off_its_course():
    bench = Bench()
    bench.fly(IN_FIRST_DOUBLET, position=(9.0, 4.0, -5.0))
    assert bench.guidance_loop.tracking_error is None
    bench.fly(IN_HOLD - 0.3, position=(9.0, 4.0, -5.0))
    assert bench.guidance_loop.tracking_error is None
    bench.fly(IN_HOLD + 0.3)  # so much later that it is no jump of the estimate
    assert bench.guidance_loop.tracking_error < 1.0


def test_a_vehicle_that_never_comes_back_from_open_loop_is_off_its_course():
    """A doublet pushes it away, and the hold that follows does not bring it nearer."""
    bench, away = Bench(), (9.0, 4.0, -5.0)
    bench.fly(IN_FIRST_DOUBLET, position=away)
    bench.guidance_loop.flown_source.clear()
    bench.guidance_loop.flown_source.pose = Pose(HERE, 0.0)
    held_from = IN_FIRST_DOUBLET + 0.02
    for step in range(24):
        bench.fly(held_from + 0.4 * step, position=away)
        assert bench.guidance_loop.tracking_error is None
    bench.fly(held_from + 10.1, position=away)
    assert bench.guidance_loop.tracking_error > 5.0
    bench.fly(held_from + 13.0)  # so much later that it is no jump of the estimate
    assert bench.guidance_loop.tracking_error < 1.0


def test_jumps_on_the_ground_are_corrections_and_are_not_kept_out():
    """A compass or GPS that settles before take-off improves the estimate: no reset to hide."""
    bench = Bench()
    bench.loop.resets.frame, bench.loop.resets.position_shift = HeadingFrame(0.5), (3.0, 0.0, 0.0)
    bench.ground.standing = True
    bench.fly(IN_HOLD)
    assert bench.loop.resets.frame.offset == 0.5  # in control "landed" is not believed
    bench.loop.offboard_active = False
    bench.fly(IN_HOLD)
    assert (bench.loop.resets.frame, bench.loop.resets.position_shift) == (
        HeadingFrame(0.0),
        (0.0, 0.0, 0.0),
    )


def test_a_position_that_lags_the_attitude_is_as_old_as_it_says():
    bench = Bench()
    bench.fly(IN_HOLD)
    late = LocalPosition(bench.now, bench.now - 0.31, HERE, (0.0, 0.0, 0.0))
    bench.state.position, made_at = late, bench.loop.command.made_at
    bench.now += 0.01
    bench.guidance_loop.step()
    assert bench.guidance_loop.fresh_position() is None
    assert bench.loop.command.made_at == made_at
    bench.state.position = late._replace(vehicle_time=bench.now - 0.29)
    bench.guidance_loop.step()
    assert bench.loop.command.made_at == bench.now


def test_an_old_attitude_does_not_replace_a_newer_one():
    bench = Bench()
    bench.fly(IN_FIRST_DOUBLET)
    tilted, still = (cos(0.5), sin(0.5), 0.0, 0.0), BodyRates(0.0, 0.0, 0.0)
    reading = bench.clock.take(round(1000 * bench.now) - 100, bench.now)
    old = AttitudeSample(0, reading.vehicle_time, bench.now, 0, tilted, still, *reading[1:])
    bench.guidance_loop.note_attitude(old)
    bench.guidance_loop.step()
    assert bench.guidance_loop.hold.give_up_reason is None


def test_position_hold_may_tilt_as_it_must():
    bench = Bench()
    bench.fly(IN_HOLD, tilt=31.0)
    assert bench.guidance_loop.hold.give_up_reason is None


@pytest.mark.parametrize(
    ("after", "learns"), [(IN_HOLD, True), (IN_FIRST_DOUBLET, False), (IN_CLIMB, False)]
)
def test_the_hover_thrust_is_learned_in_hold_only(after, learns):
    bench = Bench()
    observed, paused = bench.hover.observed, bench.hover.paused
    bench.fly(after)
    assert bench.hover.observed - observed == int(learns)
    assert bench.hover.paused - paused == int(not learns)


def test_on_the_ground_the_command_is_idle_only_while_that_is_safe():
    bench = Bench()
    bench.ground.standing, bench.loop.offboard_active = True, False
    idle = GuidanceCommand(Target(0.0, 0.0, 0.0), 0.0, 13.0, idle=True)
    assert bench.fly(IN_HOLD) == idle
    bench.ground.may_idle = False
    assert not bench.fly(IN_HOLD).idle
    bench.ground.standing, bench.ground.may_idle = False, True
    assert not bench.fly(IN_HOLD).idle
    bench.ground.standing, bench.loop.offboard_active = True, True  # "landed" is not believed
    assert not bench.fly(IN_HOLD).idle


def test_a_command_tells_when_it_was_made_and_where_its_target_moves():
    bench = Bench()
    bench.loop.resets.frame = HeadingFrame(0.25)
    command = bench.fly(IN_HOLD)
    assert (command.made_at, command.period, command.frame.offset) == (13.0, 0.02, 0.25)
    assert (command.idle, command.is_step, command.thrust) == (False, False, None)
    assert command.later_target is not None


@pytest.mark.parametrize(("east", "down"), [(nan, 0.0), (0.0, inf)])
def test_a_command_that_is_not_finite_is_told_and_the_one_before_grows_old(east, down):
    bench = Bench()
    before = bench.fly(IN_HOLD)
    usual = bench.guidance_loop.command_maker.guidance
    assert not bench.guidance_loop.command_not_finite
    target, later = Target(0.0, 0.0, 0.0), Target(0.0, east, 0.0)
    bench.guidance_loop.command_maker.guidance = SimpleNamespace(
        effect_delay=0.1, command=lambda *_: LinearCommand(target, later, down)
    )
    assert bench.fly(IN_HOLD + 0.02) is before
    assert bench.guidance_loop.command_not_finite
    bench.guidance_loop.command_maker.guidance = usual
    assert bench.fly(IN_HOLD + 0.04) is not before
    assert not bench.guidance_loop.command_not_finite


def test_what_a_phase_tells_guidance():
    bench, elsewhere = Bench(), (0.0, 4.0, -5.0)
    guidance = bench.guidance_loop
    assert (guidance.gave_up, guidance.hold.give_up_reason) == (False, None)
    source = guidance.flown_source.source
    bench.fly(IN_HOLD, elsewhere)
    assert guidance.motion_now().position_ned == pytest.approx(elsewhere, abs=0.01)
    guidance.hold_reference()
    assert guidance.flown_source.source is None
    assert guidance.flown_source.pose.position_ned == pytest.approx(HERE)
    guidance.stand_by()
    assert guidance.flown_source.pose is None
    guidance.follow(source)  # from where it is, because no pose is held
    assert guidance.flown_source.pose.position_ned == pytest.approx(elsewhere, abs=0.01)
    assert (guidance.flown_source.source, guidance.flown_source.begun_at) == (source, bench.now)
    guidance.hold_here()
    assert guidance.flown_source.source is None
    guidance.flown_source.pose = guidance.flown_source.pose._replace(position_ned=HERE)
    guidance.follow(source)  # from the held pose
    assert guidance.flown_source.pose.position_ned == HERE
    guidance.give_up()
    assert guidance.gave_up is True
    guidance.follow(source)
    assert guidance.flown_source.source is None
    assert guidance.flown_source.pose.position_ned == pytest.approx(elsewhere, abs=0.01)


def test_a_guidance_loop_knows_nothing_before_its_first_step():
    guidance = Bench(begun=False).guidance_loop
    with pytest.raises(RuntimeError, match="before any position had come"):
        guidance.hold_here()
    assert (guidance.motion, guidance.tracking_error, guidance.hold.give_up_reason) == (
        None,
        None,
        None,
    )
    assert guidance.attitude() == (1.0, 0.0, 0.0, 0.0)


def test_actions_and_steps_are_recorded():
    bench = Bench(kept := KeptMessages())
    guidance, offset = bench.guidance_loop, bench.clock.offset
    assert kept.actions == [(10.0, "hold_here", offset), (10.0, "follow", offset)]
    kept.actions.clear()
    for name in ("hold_reference", "give_up", "stand_by"):
        getattr(guidance, name)()
    assert kept.actions == [
        (10.0, name, offset) for name in ("hold_reference", "give_up", "stand_by")
    ]
    seen, kept.messages = [], KeptMessages().messages
    guidance.before_step = seen.append
    bench.fly(IN_HOLD)
    assert seen == [13.0]
    (read,) = kept.rows("/guidance_input")
    assert (read["time_s"], read["height_m"], read["armed"], read["clock_offset_s"]) == (
        13.0,
        5.0,
        1,
        pytest.approx(bench.clock.offset),
    )
    flags = ("fresh", "standing", "may_idle", "offboard_active")
    assert [read[name] for name in flags] == [1, 0, 0, 1]
    assert [row["time_s"] for row in kept.rows("/target")] == [13.0]
    (made,) = kept.rows("/guidance")
    assert (made["time_s"], made["estimated_north_m"]) == (13.0, pytest.approx(3.0, abs=0.01))
    bench.now += 1.0  # the position is stale: no command, and nothing was computed
    guidance.step()
    assert [len(kept.messages[name]) for name in ("/guidance_input", "/target", "/guidance")] == [
        2,
        1,
        1,
    ]
    assert [kept.rows("/guidance_input")[-1][name] for name in flags] == [0, 0, 0, 1]
    bench.ground.standing, bench.loop.offboard_active = True, False
    bench.fly(IN_HOLD + 2.0)
    assert [kept.rows("/guidance_input")[-1][name] for name in flags] == [1, 1, 1, 0]
    assert (kept.rows("/target")[-1]["idle"], len(kept.messages["/guidance"])) == (1, 1)


async def test_it_steps_in_its_period_and_at_once_when_asked():
    guidance, steps = Bench().guidance_loop, []
    guidance.step = lambda: steps.append(1)
    running = asyncio.create_task(guidance.run())
    await asyncio.sleep(0)
    assert len(steps) == 1
    guidance.step_at_once()
    for _ in range(5):
        await asyncio.sleep(0)
    assert len(steps) == 2
    await asyncio.sleep(0.1)
    assert len(steps) >= 3
    running.cancel()
