"""Programs that fly by `companion.connect`, against the mock vehicle in memory."""

import asyncio
from contextlib import suppress
from functools import cache, partial
from math import dist, hypot, pi

import numpy as np
import pytest

import companion
from companion.config.files import changed, load
from companion.files.yaml_file import ConfigError
from companion.flight.observer import SilentObserver
from companion.guidance import GRAVITY, Pose, Reference, VehicleMotion
from companion.guidance.follow import HeldHeadingManeuver
from companion.guidance.source import CommandedSource
from companion.guidance.trajectory import Laps, gerono_eight, line
from companion.testing import connect, run
from tests.flight.fly import CONFIGS, OTHER_VEHICLES, QUICK_FLIGHT, QuickVehicle, merged
from tests.flight.test_tracking import FAST

EIGHT = gerono_eight(3.0, Laps(5.0, 1.0, 3.0))
"""One lap of configs/trajectories/figure8.yaml."""

FAST_LINE = line((4.0, 0.0, 0.0), speed=3.0, acceleration=4.0, jerk=20.0)

BOTH = pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])


class Told(SilentObserver):
    """An observer that keeps the events."""

    def __init__(self):
        self.events = []

    def phase(self, name, waits_for):
        self.events.append(f"phase {name}")

    def event(self, _, text):
        self.events.append(text)


def flown(program, mock, folder=None, **changes):
    """Run `program(vehicle)` on the mock's clock; returns the summary and what was told."""
    told = Told()
    usual = merged(QUICK_FLIGHT, OTHER_VEHICLES.get(mock.autopilot, {}))

    async def main():
        async with connect(merged(usual, changes), mock, folder, told) as vehicle:
            await program(vehicle)
        return vehicle.summary

    return run(mock, main()), told.events


@pytest.fixture(scope="module", params=["px4", "ardupilot"])
def places(request):
    """One flight to places, by `go_to` without and with a speed, and by accelerations."""
    autopilot = request.param
    seen = {"seconds": [], "off": [], "far": []}

    async def without_a_speed(vehicle):
        for way in (*(way for way, _ in LEGS), (-0.5, 0.3, 0.8)):
            began = vehicle.state
            place = tuple(map(sum, zip(began.position_ned, way, strict=True)))
            await vehicle.go_to(place)
            seen["seconds"].append(vehicle.state.time - began.time)
            seen["far"].append(dist(vehicle.state.position_ned, place))

    async def with_a_speed(vehicle):
        north, east, down = vehicle.state.position_ned
        for place in ((north + 4.0, east, down), (north + 4.0, east + 3.0, down - 1.0)):
            await vehicle.go_to(place, speed=3.0)
            seen["off"].append(dist(vehicle.state.position_ned, place))
        await vehicle.go_to((north, east, down), heading=0.5 * pi)
        seen["off"].append(dist(vehicle.state.position_ned, (north, east, down)))
        seen["off"].append(abs(vehicle.state.heading - 0.5 * pi))

    async def by_accelerations(vehicle):
        there = np.array(vehicle.state.position_ned) + np.array([3.0, -2.0, -1.0])
        async with vehicle.control() as control:
            async for state in control.states(seconds=6.0):
                error = there - state.position_ned
                wanted = 1.2 * error - 2.0 * np.array(state.velocity_ned)
                control.accelerate(tuple(np.clip(wanted, -3.0, 3.0)))
        seen["error"] = np.abs(there - vehicle.state.position_ned).max()

    async def program(vehicle):
        await vehicle.take_off()
        await without_a_speed(vehicle)
        await with_a_speed(vehicle)
        await by_accelerations(vehicle)
        await vehicle.land()

    mock = QuickVehicle(autopilot)
    limits = {"max_climb_m_s": 1.5, "max_descent_m_s": 0.8}
    summary, events = flown(program, mock, limits=limits)
    assert summary.result == "ok", events
    return {**seen, "end": mock.state()}


LEGS = (((0.0, 3.2, 0.0), 2.0), ((0.0, 0.0, -3.0), 1.5), ((0.0, 0.0, 1.5), 0.8))
"""Ways, m, and the speeds, m/s, that `go_to` takes for them within the limits of `places`."""


def test_without_a_speed_it_goes_as_fast_as_the_limits_of_climb_and_descent_allow(places):
    """`go_to` flies at 2 m/s, which these limits do not allow straight up or down."""
    expected = [line(way, speed, 2.0, 4.0).duration for way, speed in LEGS]
    assert places["seconds"][:3] == pytest.approx(expected, abs=0.3)
    assert max(places["far"]) < 0.3


def test_it_takes_off_flies_to_places_and_lands(places):
    assert max(places["off"]) < 0.1, places
    assert (places["end"]["armed"], places["end"]["crashed"]) == (False, False)


def test_accelerations_from_a_coroutine_stop_the_vehicle_where_it_wants(places):
    assert places["error"] < 0.15


@pytest.fixture(scope="module", params=["px4", "ardupilot"])
def fast(request):
    """One flight at speed: it coasts, holds at once from 5 m/s, and lands at once from 2.5 s."""
    seen = {"coast": [], "north": [], "modes": {}}

    def look():
        state = mock.state()
        seen["modes"][state["mode"]] = hypot(*state["velocity"][:2])

    async def watch(vehicle):
        while True:
            seen["north"].append(vehicle.state.velocity_ned[0])
            await asyncio.sleep(0.05)

    async def program(vehicle):
        await vehicle.take_off()
        async with vehicle.control() as control:
            async for state in control.states(seconds=4.0):
                quick = state.velocity_ned[0] > 2.5 or seen["coast"]
                control.accelerate((0.0 if quick else 2.0, 0.0, 0.0))
                if quick:
                    seen["coast"].append(state.velocity_ned[0])
            async for state in control.states(seconds=3.0):
                north, east, down = state.velocity_ned
                control.accelerate((2.0 * (5.0 - north), -2.0 * east, -2.0 * down))
            watching = asyncio.ensure_future(watch(vehicle))
        await vehicle.hold(2.0)
        watching.cancel()
        async with vehicle.control() as control:
            async for _ in control.states(seconds=2.5):
                control.accelerate((2.0, 0.0, 0.0))
        await vehicle.land()

    mock = QuickVehicle(request.param)
    mock.after_step.append(look)
    limits = {"max_tilt_deg": 30.0, "fence_radius_m": 60.0}
    summary, events = flown(program, mock, limits=limits)
    assert summary.result == "ok", events
    seen["landed from"] = seen["modes"][{"px4": "OFFBOARD", "ardupilot": "GUIDED"}[request.param]]
    return seen


def test_no_acceleration_keeps_the_velocity_against_drag(fast):
    assert len(fast["coast"]) > 100
    # A drag of 1/s alone would leave a fifth of it.
    assert max(fast["coast"]) - fast["coast"][-1] < 0.5


def test_a_fast_vehicle_that_is_to_hold_stops_and_does_not_swing_back(fast):
    assert max(fast["north"]) > 4.0
    assert min(fast["north"]) > -0.5  # it was -4
    assert abs(fast["north"][-1]) < 0.2


def test_a_landing_right_after_control_at_speed_begins_at_rest(fast):
    assert fast["landed from"] < 0.5, fast["modes"]  # it was 4.6


@pytest.mark.parametrize(
    ("autopilot", "period", "with_jerk"),
    [("px4", 0.02, False), ("px4", 0.04, True), ("ardupilot", 0.02, False)],
)
def test_references_from_a_coroutine_are_followed_as_the_built_in_ones_are(
    autopilot, period, with_jerk
):
    """A figure-eight up to 5 m/s, streamed by a coroutine every `period` s."""

    async def streamed(vehicle):
        await vehicle.take_off()
        start = Pose(vehicle.state.position_ned, vehicle.state.heading)
        maneuver, clock = HeldHeadingManeuver(EIGHT), asyncio.get_running_loop().time
        async with vehicle.control() as control:
            began = clock()
            while clock() - began < EIGHT.duration:
                now = clock() - began
                jerk = EIGHT.at(now).jerk if with_jerk else None
                control.follow(maneuver.at(now, start), jerk)
                await asyncio.sleep(period)

    built_in = error_of_the_built_in_one(autopilot)
    assert built_in < 0.12  # ArduPilot's late GPS, which nothing tells the program, is most of it
    error = figure_eight_error(streamed, autopilot)
    assert error < 1.2 * built_in + 0.005, built_in


@cache
def error_of_the_built_in_one(autopilot):
    """The same figure-eight by `follow`, flown once for all periods."""

    async def built_in(vehicle):
        await vehicle.take_off()
        await vehicle.follow(EIGHT)

    return figure_eight_error(built_in, autopilot)


def figure_eight_error(program, autopilot):
    """RMS of the position error of a program that flies a figure-eight, m."""
    quick = {key: FAST[key] for key in ("limits", "guidance", "thrust")}
    summary, _ = flown(program, QuickVehicle(autopilot), **quick)
    assert summary.result == "ok"
    return summary.tracking()["position_rms_m"]


async def stops(control):
    """Commands nothing any more, and goes on."""
    control.accelerate((0.5, 0.0, 0.0))
    await asyncio.sleep(5.0)


async def raises(control):
    """Fails."""
    control.accelerate((0.5, 0.0, 0.0))
    await asyncio.sleep(0.1)
    raise ZeroDivisionError("mine")


async def returns_nan(control):
    """Commands what is no number."""
    control.accelerate((0.5, 0.0, 0.0))
    await asyncio.sleep(0.1)
    control.accelerate((float("nan"), 0.0, 0.0))


async def forgets_an_axis(control):
    """Commands a horizontal acceleration only."""
    control.accelerate((0.5, 0.0))


async def returns_infinity(control):
    """Commands what no vehicle does."""
    control.rotate((0.0, float("inf"), 0.0))


@pytest.mark.parametrize(
    ("autopilot", "fault", "error", "reason"),
    [
        ("px4", stops, companion.FlightEnded, "the program gave no new command for"),
        ("ardupilot", stops, companion.FlightEnded, "the program gave no new command for"),
        ("px4", raises, ZeroDivisionError, "the program raised ZeroDivisionError('mine')"),
        ("ardupilot", raises, ZeroDivisionError, "the program raised ZeroDivisionError('mine')"),
        ("px4", returns_nan, ValueError, "acceleration_ned must be three finite numbers"),
        ("ardupilot", returns_nan, ValueError, "acceleration_ned must be three finite numbers"),
        ("ardupilot", forgets_an_axis, ValueError, "acceleration_ned must be three finite numbers"),
        ("px4", returns_infinity, ValueError, "body_rates must be three finite numbers"),
    ],
)
def test_a_program_that_fails_leaves_the_vehicle_held_and_handed_back(
    tmp_path, autopilot, fault, error, reason
):
    async def program(vehicle):
        await vehicle.take_off()
        async with vehicle.control() as control:
            await fault(control)

    mock = QuickVehicle(autopilot)
    with pytest.raises(error):
        flown(program, mock, tmp_path)
    state = mock.until(lambda state: hypot(*state["velocity"][:2]) < 0.3)
    events = (tmp_path / "summary.json").read_text()
    assert reason in events
    assert state["mode"] in ("LOITER", "BRAKE")
    assert (state["armed"], state["crashed"]) == (True, False)


@BOTH
def test_after_a_hard_line_the_hold_comes_to_rest(autopilot):
    """ArduPilot's slewing rate loop made a stiffer hold swing by 0.8 m/s for good."""
    path = CONFIGS / f"mock-{autopilot}.yaml"
    quick = {"limits": {"max_tilt_deg": 45.0, "max_tilt_rate_deg_s": 200.0}}
    quick["flight"] = {"takeoff_height_m": 2.0}
    quick["safety"] = {"max_body_rate_deg_s": 700.0}
    mock, speeds = QuickVehicle(config=path, full_rate=True), []

    async def main():
        async with connect(changed(load(path), quick, "test"), mock) as vehicle:
            await vehicle.take_off()
            north, east, down = vehicle.state.position_ned
            place = north + 4.0, east, down - 2.0
            await vehicle.go_to(place, speed=8.0, acceleration=6.0, jerk=20.0)
            await vehicle.hold(3.0)
            for _ in range(20):
                await vehicle.hold(0.1)
                speeds.append(hypot(*mock.state()["velocity"][:2]))

    run(mock, main())
    assert max(speeds) < 0.15


def test_a_pilot_who_takes_over_ends_the_program_at_once(tmp_path):
    seen = []

    async def program(vehicle):
        await vehicle.take_off()
        async with vehicle.control() as control:
            mock.take_over("POSCTL")
            async for _ in control.states(seconds=20.0):
                control.accelerate((0.0, 0.0, 0.0))
                seen.append(1)

    mock = QuickVehicle()
    with pytest.raises(companion.FlightEnded, match="took over: mode POSCTL"):
        flown(program, mock, tmp_path)
    assert mock.state()["mode"] == "POSCTL"
    assert len(seen) < 500


async def refusal(call):
    """The error of a call that is refused."""
    try:
        await call
    except (companion.FlightEnded, ConfigError, RuntimeError, ValueError) as error:
        return error
    return None


@pytest.fixture(scope="module")
def refused():
    """One flight in which calls are refused, then a moment of free fall."""
    seen = {}

    async def beyond_limits(vehicle):
        north, east, down = here = vehicle.state.position_ned
        near = (north + 20.0, east, down)
        hard = vehicle.go_to(near, speed=15.0, acceleration=30.0, jerk=1e3)
        seen["fence"] = await refusal(vehicle.go_to((north + 500.0, east, down)))
        seen["limits"] = await refusal(hard)
        seen["long"] = await refusal(vehicle.follow(line((1e4, 0.0, 0.0), 2.9, 1e-3, 1e-3)))
        seen["before"] = await refusal(vehicle.hold(-1.0))
        seen["never"] = await refusal(vehicle.hold(float("nan")))
        await vehicle.hold(2.0)
        seen["moved"] = dist(here, vehicle.state.position_ned)

    async def too_many(vehicle):
        seen["second take-off"] = await refusal(vehicle.take_off())
        first = asyncio.ensure_future(vehicle.hold(1.0))
        await asyncio.sleep(0.5)
        seen["second call"] = await refusal(vehicle.hold(1.0))
        await first

    async def free_fall(vehicle):
        async with vehicle.control() as control:
            async for state in control.states(seconds=0.3):
                control.follow(Reference(state.position_ned, (0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY)))

    async def program(vehicle):
        await vehicle.take_off()
        await beyond_limits(vehicle)
        await too_many(vehicle)
        await free_fall(vehicle)
        await vehicle.land()

    seen["summary"], seen["events"] = flown(program, QuickVehicle())
    return seen


@pytest.mark.parametrize(
    ("what", "kind", "words"),
    [
        ("fence", ConfigError, "fence"),
        ("limits", ConfigError, "limits"),
        ("long", ConfigError, "is the longest"),
        ("before", ValueError, "0 s or more"),
        ("never", ValueError, "finite number"),
    ],
)
def test_what_the_limits_do_not_allow_is_refused_and_the_vehicle_holds_on(
    refused, what, kind, words
):
    assert isinstance(refused[what], kind)
    assert words in str(refused[what])
    assert refused["moved"] < 0.1
    assert refused["summary"].result == "ok"


def test_two_calls_at_once_and_a_second_take_off_are_refused(refused):
    assert isinstance(refused["second take-off"], companion.FlightEnded)
    assert "flies already" in str(refused["second take-off"])
    assert isinstance(refused["second call"], RuntimeError)
    assert "another call" in str(refused["second call"])
    assert refused["summary"].result == "ok"


def test_free_fall_may_be_commanded(refused):
    assert refused["summary"].result == "ok"
    assert not any("internal error" in event for event in refused["events"])


def test_a_program_that_ends_in_the_air_hands_back(tmp_path):
    async def program(vehicle):
        await vehicle.take_off()

    mock = QuickVehicle()
    summary, told = flown(program, mock)
    state = mock.state()
    assert summary.result == "ok"
    assert state["mode"] == "LOITER"
    assert "phase hand back" in told


def test_before_take_off_nothing_flies(tmp_path):
    async def program(vehicle):
        with pytest.raises(companion.FlightEnded, match="take off first"):
            await vehicle.hold(1.0)
        with pytest.raises(companion.FlightEnded, match="take off first"):
            async with vehicle.control():
                pass

    mock = QuickVehicle()
    summary, _ = flown(program, mock)
    assert mock.state()["armed"] is False
    assert summary.result == "ok"


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("end", ["land", "hand_back"])
def test_to_land_a_vehicle_that_never_took_off_leaves_it_as_it_is(end, autopilot):
    modes = []

    async def program(vehicle):
        modes.append(mock.state()["mode"])
        await getattr(vehicle, end)()

    mock = QuickVehicle(autopilot)
    summary, _ = flown(program, mock)
    assert (summary.result, mock.state()["mode"]) == ("ok", modes[0])


def test_after_the_flight_each_call_says_why_it_ended():
    told = []

    async def program(vehicle):
        await vehicle.take_off()
        mock.inject({"kind": "pilot_takeover", "mode": "POSCTL"})
        for call in (partial(vehicle.hold, 5.0), partial(vehicle.go_to, (5.0, 0.0, -2.0))):
            with pytest.raises(companion.FlightEnded) as ended:
                await call()
            told.append(str(ended.value))

    mock = QuickVehicle()
    with suppress(companion.FlightEnded):
        flown(program, mock)
    assert len(told) == 2
    assert all(text.startswith("the pilot or another station took over") for text in told), told


@BOTH
@pytest.mark.parametrize("after", [0.3, 2.0, 4.5])
def test_a_take_off_that_is_cancelled_leaves_nothing_flying_unheld(autopilot, after):
    """Cancelled while it arms, climbs, or takes over: disarmed, or held by the autopilot."""

    async def program(vehicle):
        with suppress(TimeoutError):
            async with asyncio.timeout(after):
                await vehicle.take_off()

    mock = QuickVehicle(autopilot)
    with suppress(companion.FlightEnded):
        flown(program, mock)
    mock.run(5.0)
    state = mock.state()
    held = state["mode"] in ("LOITER", "BRAKE") and abs(state["velocity"][2]) < 0.2
    assert held or not state["armed"], state
    assert not state["crashed"]


def test_a_cancelled_call_hands_back():
    async def program(vehicle):
        await vehicle.take_off()
        async with asyncio.timeout(1.0):
            await vehicle.hold(60.0)

    mock = QuickVehicle()
    with pytest.raises(TimeoutError):
        flown(program, mock)
    assert (mock.state()["mode"], mock.state()["armed"]) == ("LOITER", True)
    assert mock.time < 25.0


def test_an_observer_that_raises_costs_nothing():
    class Broken(Told):
        def event(self, time, text):
            raise BrokenPipeError(text)

    async def main():
        config = merged(QUICK_FLIGHT, {"hover": {"duration_s": 1.0}})
        async with connect(config, mock, observer=Broken()) as vehicle:
            await vehicle.take_off()
            await vehicle.land()
        return vehicle.summary

    mock = QuickVehicle()
    summary = run(mock, main())
    assert summary.result == "ok"
    told = [text for _, text in summary.events if "the observer of this flight failed" in text]
    assert len(told) == 1
    assert not mock.state()["armed"]


def test_references_in_one_moment_tell_no_jerk():
    source = CommandedSource("a program", 0.5, 1.0)
    source.begin(0.0, Pose((0.0, 0.0, 0.0), 0.0))
    still = VehicleMotion((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    source.give(Reference((0.0, 0.0, 0.0)), 0.1)
    source.give(Reference((0.0, 0.0, 0.0), acceleration_ned=(1.0, 0.0, 0.0)), 0.10001)
    assert source.reference(0.11, still)(0.3).acceleration_ned[0] == pytest.approx(1.0)
    source.give(Reference((0.0, 0.0, 0.0), acceleration_ned=(2.0, 0.0, 0.0)), 0.2)
    assert source.reference(0.2, still)(0.3).acceleration_ned[0] == pytest.approx(4.0)


def test_follow_slows_a_trajectory_down_to_the_limits_but_not_into_the_fence():
    """`--slow-down` is for `companion fly`; a program had to know our limits as an `Envelope`."""

    async def program(vehicle):
        await vehicle.take_off()
        with pytest.raises(ConfigError, match="follow: slow_down=True"):
            await vehicle.follow(FAST_LINE)
        await vehicle.follow(FAST_LINE, slow_down=True)
        with pytest.raises(ConfigError, match="fence"):  # it begins 4 m from the centre now
            await vehicle.follow(FAST_LINE, slow_down=True)
        await vehicle.land()

    limits = {"max_tilt_deg": 15.0, "fence_radius_m": 6.5}
    summary, _ = flown(program, QuickVehicle("px4"), limits=limits)
    assert summary.result == "ok"
    (flown_line,) = [figures for figures in summary.maneuvers() if figures.name == "line"]
    assert flown_line.duration > 1.2 * FAST_LINE.duration
    assert summary.extent()["maneuver_tilt_max_deg"] < 17.0
