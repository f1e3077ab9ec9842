"""How a flight goes through its phases: faults of ours, and another vehicle, at bad moments."""

import asyncio
from types import SimpleNamespace

import pytest

from companion.flight.context import cancel
from companion.flight.flight import Flight
from companion.flight.observer import SilentObserver, decline_landing
from companion.flight.phase import Phase
from companion.flight.vehicle_identity import VehicleReplaced
from companion.safety.actions import Exit


class Bench:
    """A flight of made-up phases, each of which lasts `lasts` s; `judge` is the watch's."""

    def __init__(self, monkeypatch, check, lasts=0.0):
        self.done, self.begun, self.lasts = [], 0, lasts
        self.running = None
        first, second = self.phase("checks"), self.phase("maneuvers", Exit.LAND)

        async def phases(_):
            yield first
            yield second

        self.plan = SimpleNamespace(phases=phases)
        monkeypatch.setattr("companion.flight.flight.ground_phases", lambda _: (first,))
        landing = (self.phase("land"),)
        exits = dict.fromkeys(Exit, ()) | {Exit.LAND: landing}
        monkeypatch.setattr("companion.flight.flight.EXIT_PHASES", exits)
        self.context = SimpleNamespace(
            config=SimpleNamespace(flight=None),
            link=SimpleNamespace(autopilot=None, state=SimpleNamespace(forget=lambda: None)),
            loop=SimpleNamespace(taking_over=False, offboard_active=False),
            must_disarm=False,
            guidance_loop=SimpleNamespace(run=lambda: asyncio.sleep(60.0)),
            ground=SimpleNamespace(standing=False),
            replacement_detector=SimpleNamespace(begin=self.begin),
            release=lambda: None,
            end_stream=lambda: None,
            stop=self.stop,
            waiting_for="",
        )
        self.watch = SimpleNamespace(check=lambda phase: check(self, phase))

    def phase(self, name, on_failure=Exit.LEAVE):
        async def work(_):
            self.running = name
            await asyncio.sleep(self.lasts)
            self.done.append(name)

        return Phase(name, "nothing", work, 5.0, on_failure)

    def begin(self):
        self.begun += 1

    async def stop(self, tasks):
        for task in tasks:
            await cancel(task)
        self.done.append("stop")

    def fly(self):
        async def run():
            self.flight = Flight(
                self.context, self.plan, self.watch, SilentObserver(), decline_landing
            )
            return await self.flight.run(), [text for _, text in self.flight.events]

        return asyncio.run(run())


def test_another_vehicle_before_arming_is_checked_from_the_beginning(monkeypatch):
    def judge(bench, phase):
        if phase.name == "maneuvers" and bench.begun == 0:
            raise VehicleReplaced("another vehicle answers")

    bench = Bench(monkeypatch, judge)
    result, events = bench.fly()
    assert (result, bench.done) == ("ok", ["checks", "checks", "maneuvers", "stop"])
    assert events == ["another vehicle answers; the checks are repeated"]


def test_an_interrupt_just_as_the_checks_become_void_ends_the_flight(monkeypatch):
    def judge(bench, phase):
        if phase.name == bench.running == "maneuvers" and bench.begun == 0:
            asyncio.get_running_loop().call_soon(bench.flight.interrupt, "Ctrl-C")
            raise VehicleReplaced("another vehicle answers")

    bench = Bench(monkeypatch, judge, lasts=0.1)
    result, _ = bench.fly()
    assert (result, bench.done) == ("Ctrl-C", ["checks", "stop"])


def test_vehicles_that_change_all_the_time_are_given_up(monkeypatch):
    def judge(_, phase):
        if phase.name == "maneuvers":
            raise VehicleReplaced("another vehicle answers")

    result, _ = Bench(monkeypatch, judge).fly()
    assert result == (
        "the vehicle was lost, restarted or replaced 5 times before arming; check the link and the "
        "vehicle's power"
    )


@pytest.mark.parametrize("also_landing", [False, True])
def test_a_fault_of_ours_as_a_phase_begins_leaves_no_ending_out(monkeypatch, also_landing):
    def judge(_, phase):
        if phase.name == "maneuvers" or (also_landing and phase.name == "land"):
            raise ZeroDivisionError("a fault of ours")

    bench = Bench(monkeypatch, judge)
    result, _ = bench.fly()
    assert result == "internal error: ZeroDivisionError('a fault of ours')"
    assert bench.done == ["checks", "land", "stop"]
