"""`bench planner`: that it measures what it says, and in the form it says."""

import json

import pytest

from companion.attitude import LAW_NAMES
from companion.bench import planner
from companion.cli.main import main

ROWS = {"baseline", *LAW_NAMES}


def check(figures, compiled):
    assert figures["compiled"] is compiled
    assert list(figures["batch_ns"]) == ["1", "1000", "10000"]
    for ns, ratios in [
        (figures["flight_ns"], figures["flight_ratio"]),
        *zip(figures["batch_ns"].values(), figures["batch_ratio"].values(), strict=True),
    ]:
        assert set(ns) == ROWS
        for name in LAW_NAMES:
            assert ratios[name] == pytest.approx(ns[name] / ns["baseline"], rel=0.02)
        assert min(ns.values()) > 0.0
    simulated = figures["simulated"]
    assert (simulated["vehicles"], simulated["rate_hz"]) == (1000, 1000.0)
    per_step_s = simulated["step_ns"] * 1e-9
    # A simulated second of 1000 vehicles at 1 kHz is a million steps.
    assert simulated["seconds_per_second"] == pytest.approx(1e-6 / per_step_s, rel=0.02, abs=2e-3)


def test_without_numba_the_batches_are_in_python_and_it_is_said(monkeypatch, capsys):
    monkeypatch.setattr("companion.batch.batch.importlib.util.find_spec", lambda name: None)
    check(planner.run(0.01, as_json=False), compiled=False)
    shown = capsys.readouterr().out
    assert "batches in Python" in shown
    assert "[study]'" in shown


@pytest.mark.slow
def test_json_is_one_object_of_the_same_figures(capsys):
    pytest.importorskip("numba")
    assert main(["bench", "planner", "--json", "--seconds", "0.01"]) == 0
    check(json.loads(capsys.readouterr().out), compiled=True)


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf", "soon"])
def test_senseless_arguments_are_refused(seconds, capsys):
    with pytest.raises(SystemExit) as ending:
        main(["bench", "planner", "--seconds", seconds])
    assert ending.value.code == 2
    assert "--seconds" in capsys.readouterr().err


def test_the_fastest_of_the_repeats_counts():
    class Timer:
        def __init__(self, *times):
            self.times = list(times)

        def timeit(self, number):
            return number * (self.times.pop(0) if len(self.times) > 1 else self.times[0])

    cases = [
        planner._Case("a", "slow", Timer(9.0, 8.0, 7.0), 1),
        planner._Case("a", "shared", Timer(9.0, 8.0, 7.0), 100),
    ]
    best = planner._shortest_ns(cases, 0.0)
    assert best["a"] == pytest.approx({"slow": 7e9, "shared": 7e7})
