"""Predictive control flies whole flights, and linear guidance where it does not answer."""

import asyncio
import os
import signal
from pathlib import Path

import pytest

from companion.attitude import BodyRates, Target
from companion.control.heading_frame import HeadingFrame
from companion.control.predictive import FollowedTrajectory, PredictiveControl
from companion.guidance import GRAVITY, LinearCommand, Pose
from companion.guidance.follow import Follow
from companion.guidance.trajectory import Laps, circle
from companion.mavlink import lockstep
from companion.nmpc import Answer, Start, Status, Trouble, VehicleSnapshot
from tests.flight.sockets import mock_vehicle, session_for
from tests.flight.test_tracking import following

CASADI = pytest.importorskip("casadi")


def flown(folder, name, disturb=None, **changes):
    """The summary of a trajectory by predictive control; `disturb(session)` runs beside it."""
    folder.mkdir(exist_ok=True)
    config = following(name, guidance={"kind": "nmpc"}, **changes)
    with mock_vehicle(folder, seed=3) as mock:
        session = session_for(mock, folder / "log", **config)

        async def fly():
            beside = asyncio.create_task(disturb(session)) if disturb else None
            summary = await session.fly()
            if beside is not None:
                await beside
            return summary

        summary = lockstep.run(fly())
    assert summary.result == "ok", summary.events
    return summary


@pytest.mark.slow
def test_from_standing_into_the_circle_it_neither_swings_nor_leaves(tmp_path):
    pids = []

    async def note_pid(session):
        while session._assembled is None:  # noqa: ASYNC110
            await asyncio.sleep(0.1)
        pids.append(
            session._assembled.context.guidance_loop.command_maker.predictive_control._solver.pid
        )

    summary = flown(tmp_path, "circle5.yaml", note_pid)
    assert not Path(f"/proc/{pids[0]}").exists()  # the process ends with the flight
    tracking, told = summary.tracking(), summary.as_dict()["nmpc"]
    assert tracking["position_rms_m"] <= 0.06
    assert tracking["position_max_m"] <= 0.2
    assert told["flown"] > 600
    assert told["troubles"] == {}
    rates = summary.trace.rates.rows()
    steady = rates[len(rates) // 3 : len(rates) // 2, 2:5]
    assert steady.std(axis=0).max() <= 0.6  # a limit cycle swings from limit to limit, 4.4 rad/s


def test_the_solvers_death_is_reported_and_costs_little(tmp_path):
    async def kill(session):
        def begun():
            assembled = session._assembled
            return (
                assembled is not None
                and assembled.context.guidance_loop.flown_source.begun_at is not None
            )

        while not begun():  # noqa: ASYNC110
            await asyncio.sleep(0.1)
        await asyncio.sleep(7.0)  # in the middle of the eight, at 5 m/s
        os.kill(
            session._assembled.context.guidance_loop.command_maker.predictive_control._solver.pid,
            signal.SIGKILL,
        )

    summary = flown(tmp_path, "figure8.yaml", kill)
    (told,) = [text for _, text in summary.events if "predictive" in text]
    assert "ended by signal 9" in told
    assert "linear guidance continues the flight" in told
    assert summary.as_dict()["nmpc"]["troubles"] == {"died": 1}
    assert 200 < summary.as_dict()["nmpc"]["flown"] < 500
    assert summary.tracking()["position_max_m"] <= 0.3


class FakeSolver:
    """Answers what it is told to."""

    alive = ready = True

    def __init__(self, report):
        self.report, self.answer, self.requests = report, None, []

    def take_answer(self, wait):
        answer, self.answer = self.answer, None
        return answer

    def request(self, request):
        self.requests.append(request)

    def close(self):
        self.alive = False


def bench():
    notes = []
    predictive = PredictiveControl(FakeSolver, period=0.02, vehicle_waits=False, note=notes.append)
    return predictive, predictive._solver, notes


def vehicle(time):
    return VehicleSnapshot(
        time, (0.0, 0.0, -5.0), (0.0,) * 3, (1.0, 0.0, 0.0, 0.0), BodyRates(0.0, 0.0, 0.0)
    )


def answer(number, time, north=0.3):
    return Answer(number, Status.SOLVED, 0.0, time, north, 0.4, 0.1, 12.0, 0.003, 0.002, 1.0)


LINEAR = Target(0.1, 0.2, 0.3), -0.5


def command(predictive, vehicle, following):
    """Target and downward acceleration to fly; the estimator was never reset."""
    target, down = LINEAR
    linear = LinearCommand(target, target, down)
    flown = predictive.replacement_for(linear, HeadingFrame(), vehicle, following)
    return flown.target, flown.acceleration_down


LAPS = Laps(2.0)


def where(time, laps=LAPS):
    part = Follow(circle(5.0, laps), yaw_rate=1.0)
    return FollowedTrajectory(part, time, Pose((0.0, 0.0, -5.0), 0.4))


def test_the_answer_for_now_is_flown_with_its_thrust():
    predictive, solver, _ = bench()
    assert command(predictive, vehicle(10.0), where(0.0)) == LINEAR
    solver.answer = answer(1, 10.02)
    target, down = command(predictive, vehicle(10.02), where(0.02))
    assert target == Target(0.3, 0.4, 0.1)
    assert GRAVITY - down == pytest.approx(12.0 * (1.0 - 0.3**2 - 0.4**2) ** 0.5)
    asked = solver.requests[-1]
    assert (asked.number, asked.trajectory_time, asked.start.heading_offset) == (2, 0.02, 0.4)
    assert [one.north for one in asked.inputs] == [0.1, 0.3]
    assert asked.inputs[-1].thrust == pytest.approx(12.0)


def test_it_works_in_the_estimators_frame_with_the_heading_resets():
    predictive, solver, _ = bench()
    later = Target(0.15, 0.25, 0.35)
    linear = LinearCommand(LINEAR[0], later, LINEAR[1])
    following, frame = where(0.0), HeadingFrame(0.5)
    assert predictive.replacement_for(linear, frame, vehicle(10.0), following) is linear
    (asked,) = solver.requests
    assert (asked.vehicle, asked.start) == (vehicle(10.0), Start((0.0, 0.0, -5.0), 0.9))
    thrust = (GRAVITY + 0.5) / (1.0 - 0.1**2 - 0.2**2) ** 0.5
    (flown,) = asked.inputs
    assert flown == (10.0, 0.1, 0.2, pytest.approx(0.8), pytest.approx(thrust))
    solver.answer = answer(1, 10.02)
    command = predictive.replacement_for(linear, frame, vehicle(10.02), following)
    assert command.target == command.later_target == Target(0.3, 0.4, pytest.approx(-0.4))
    assert command.acceleration_down == pytest.approx(
        GRAVITY - 12.0 * (1.0 - 0.3**2 - 0.4**2) ** 0.5
    )
    turning = where(0.04, Laps(2.0, face_path=True))  # its headings are not relative to the pose's
    predictive.replacement_for(linear, frame, vehicle(10.04), turning)
    assert solver.requests[-1].start == Start((0.0, 0.0, -5.0), 0.5)


def test_an_answer_for_another_time_is_not_flown():
    predictive, solver, _ = bench()
    command(predictive, vehicle(10.0), where(0.0))
    solver.answer = answer(1, 10.02)
    assert command(predictive, vehicle(10.2), where(0.2)) == LINEAR


def test_without_a_trajectory_nothing_is_asked():
    predictive, solver, _ = bench()
    solver.answer = answer(1, 10.0)
    assert command(predictive, vehicle(10.0), None) == LINEAR
    assert solver.requests == []


def test_each_kind_of_trouble_is_told_once_and_all_are_counted():
    predictive, solver, notes = bench()
    solver.report(Trouble.LATE, "request 5 took 31.0 ms")
    assert len(notes) == 1
    for _ in range(2):
        solver.report(Trouble.LATE, "request 6 took 31.0 ms")
    solver.report(Trouble.IMPLAUSIBLE, "the answer to request 9 has a thrust of 99.00 m/s²")
    assert len(notes) == 2
    assert "took 31.0 ms; linear guidance continues the flight" in notes[0]
    assert predictive.record.troubles == {Trouble.LATE: 3, Trouble.IMPLAUSIBLE: 1}
