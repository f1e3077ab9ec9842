"""Flights in one process are measured, and are quicker than real time."""

import json

import pytest

from companion.batch import can_compile
from companion.bench import flight
from companion.bench.profile import PROGRAM_PARTS
from companion.cli.main import main
from tests.flight.fly import QuickVehicle

LARGE = {"event loop and wire", "link: frames, messages, state", "guidance", "vehicle: autopilot"}


def test_the_table_of_the_bench_is_also_json(capsys, monkeypatch):
    monkeypatch.setattr(flight, "CONFIG_FILES", {"px4": flight.CONFIG_FILES["px4"]})
    monkeypatch.setattr(flight, "_MEASURED_FLIGHTS", 1)
    monkeypatch.setattr(flight, "MockVehicle", QuickVehicle)
    assert main(["bench", "flight", "--seconds", "0.2", "--json", "--profile"]) == 0
    figures = json.loads(capsys.readouterr().out)
    for clocks in figures.values():
        assert set(clocks) == {"lockstep", "free"}
        for flown in clocks.values():
            assert flown["vehicle_s"] > 5.0
            assert flown["setpoints"] > 100
            assert flown["times_real_time"] == flown["vehicle_s"] / flown["cpu_s"] > 2.0
            assert flown["compiled"] == can_compile()
            assert sum(flown["shares"].values()) == pytest.approx(1.0)
            # A part with a share of 2 % may have no sample in so short a flight.
            assert LARGE <= set(flown["shares"]) <= {*PROGRAM_PARTS, "rest"}
            assert flown["shares"].get("rest", 0.0) < 0.02
