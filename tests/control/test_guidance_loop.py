"""The commands of the guidance loop while a maneuver commands body rates."""

from math import cos, radians, sin
from types import SimpleNamespace

import pytest

from companion.attitude import BodyRates
from companion.config import Config
from companion.control.estimator_resets import EstimatorResets
from companion.control.guidance_loop import GuidanceLoop
from companion.control.outer_loop import make_guidance, motion_estimate
from companion.guidance import Doublets, ManeuverSequence
from companion.guidance.source import ManeuverSource
from companion.recording.trace import FlightTrace
from companion.vehicle.clock import VehicleClock
from companion.vehicle.records import AttitudeSample, LocalPosition

DOUBLETS = Doublets(1.0, 0.25, 0.8, 1.0, climb=2.0, climb_step=0.25, settle=1.0)
IN_FIRST_DOUBLET, IN_HOLD, IN_CLIMB = 1.1, 3.0, DOUBLETS.duration - 1.5
HERE = (3.0, 4.0, -5.0)


class HoverSpy:
    """Counts its calls."""

    smallest, largest, largest_tilted = 2.0, 18.0, 18.0

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

    def __init__(self):
        self.now, self.clock = 10.0, VehicleClock()
        self.hover = HoverSpy()
        self.loop = SimpleNamespace(command=None, offboard_active=True, resets=EstimatorResets())
        self.state = SimpleNamespace(position=None, battery=None)
        self.ground = SimpleNamespace(standing=False, may_idle=True)
        self.guidance_loop = GuidanceLoop(
            self.loop,
            make_guidance(Config()),
            motion_estimate(Config()),
            self.hover,
            self.state,
            self.ground,
            FlightTrace(),
            max_tilt=radians(30.0),
            period=0.02,
            position_stale=0.3,
            clock=lambda: self.now,
            vehicle_clock=self.clock,
        )
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
    assert bench.guidance_loop.given_up is None
    command = bench.fly(IN_FIRST_DOUBLET + 0.02, tilt=31.0)
    assert command.body_rates is None
    assert (
        bench.guidance_loop.given_up
        == "identify was given up at 31° of tilt, more than limits.max_tilt_deg"
    )
    assert bench.guidance_loop.flown.pose.position_ned == pytest.approx(HERE, abs=0.01)
    assert bench.fly(IN_FIRST_DOUBLET + 0.04).body_rates is None
    assert not bench.guidance_loop.finished


def test_on_the_way_back_from_a_doublet_the_vehicle_is_not_off_its_course():
    bench = Bench()
    bench.fly(IN_FIRST_DOUBLET, position=(9.0, 4.0, -5.0))
    assert bench.guidance_loop.off_course is None
    bench.fly(IN_HOLD - 0.3, position=(9.0, 4.0, -5.0))
    assert bench.guidance_loop.off_course is None
    bench.fly(IN_HOLD + 0.3)  # so much later that it is no jump of the estimate
    assert bench.guidance_loop.off_course < 1.0


def test_jumps_on_the_ground_are_corrections_and_are_not_kept_out():
    """A compass or GPS that settles before take-off improves the estimate: no reset to hide."""
    bench = Bench()
    bench.loop.resets.turn, bench.loop.resets.shift = 0.5, (3.0, 0.0, 0.0)
    bench.ground.standing = True
    bench.fly(IN_HOLD)
    assert bench.loop.resets.turn == 0.5  # in control "landed" is not believed
    bench.loop.offboard_active = False
    bench.fly(IN_HOLD)
    assert (bench.loop.resets.turn, bench.loop.resets.shift) == (0.0, (0.0, 0.0, 0.0))


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
    assert bench.guidance_loop.given_up is None


def test_position_hold_may_tilt_as_it_must():
    bench = Bench()
    bench.fly(IN_HOLD, tilt=31.0)
    assert bench.guidance_loop.given_up is None


@pytest.mark.parametrize(
    ("after", "learns"), [(IN_HOLD, True), (IN_FIRST_DOUBLET, False), (IN_CLIMB, False)]
)
def test_the_hover_thrust_is_learned_in_hold_only(after, learns):
    bench = Bench()
    observed, paused = bench.hover.observed, bench.hover.paused
    bench.fly(after)
    assert bench.hover.observed - observed == int(learns)
    assert bench.hover.paused - paused == int(not learns)
