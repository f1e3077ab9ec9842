"""The soak's own judgement, and a short one of a few seconds."""

import pytest

from tests.soak import EXPECTED, MOST_GROWTH, SETTLED_S, Memory, Report, soak, verdict
from tests.soak_relay import DEADLINE_S, Answers

GOOD = {
    "result": "ok",
    "rate_hz": 250.0,
    "missed_deadlines": 3,
    "stale": 5,
    "refused": 0,
    "events": [{"time_s": 1.0, "text": "mode AUTO.LOITER"}],
}
MIB = 1 << 20


def report(**changes):
    parts = {
        "summary": GOOD,
        "memory": [Memory(float(at), 60 * MIB) for at in range(0, 200, 10)],
        "faults": [(100.0, "drop")],
        "outside": {"answered": 1000, "late": 3, "missing": 5},
        "began": 50.0,
    }
    return Report(**{**parts, **changes})


def well(judged):
    return verdict(judged, SETTLED_S)[1]


def test_a_flight_as_it_should_be_is_well():
    assert well(report())


def test_memory_that_grows_after_it_has_settled_is_not():
    grown = [Memory(float(at), 60 * MIB + at * MOST_GROWTH // 100) for at in range(0, 200, 10)]
    assert not well(report(memory=grown))
    settling = [Memory(float(at), (60 + min(at, 60)) * MIB) for at in range(0, 200, 10)]
    assert well(report(memory=settling))


@pytest.mark.parametrize("outside", [{"late": 4, "missing": 5}, {"late": 3, "missing": 6}])
def test_an_answer_that_was_late_or_missing_and_not_counted_is_not(outside):
    assert not well(report(outside={"answered": 1000, **outside}))


@pytest.mark.parametrize(("time_s", "explained"), [(49.0, False), (51.0, True), (64.0, False)])
def test_an_event_is_explained_by_a_fault_shortly_before(time_s, explained):
    events = [*GOOD["events"], {"time_s": time_s, "text": "something happened"}]
    assert well(report(summary={**GOOD, "events": events})) is explained


def test_a_flight_that_ended_early_is_not():
    assert not well(report(summary={**GOOD, "result": "no attitude from the vehicle"}))


def test_answers_are_timed_and_missing_ones_counted():
    answers = Answers()
    for stamp in range(0, 4000, 4):
        now = stamp / 1000.0
        answers.sample(stamp, now)
        answers.sample(stamp, now + 0.0005)  # it came twice
        if stamp < 1000 or 2000 <= stamp < 3000:  # then none is asked for; and some are missing
            continue
        answers.setpoint(stamp, now + (0.001 if stamp % 400 else DEADLINE_S + 0.002))
    assert answers.figures() == {"answered": 500, "late": 4, "missing": 250}


@pytest.mark.slow
def test_a_short_soak(tmp_path):
    report = soak(tmp_path, 3.0, seed=3, every=1.0)
    assert report.summary["result"] == "ok"
    assert report.faults
    assert report.unexplained() == []
    assert any(event["text"].startswith(EXPECTED) for event in report.summary["events"])
    assert report.outside["answered"] > 500
    assert report.outside["missing"] <= report.summary["stale"] + report.summary["refused"]
    assert report.growth(1.0) < MOST_GROWTH
    assert len(report.memory) >= 3
