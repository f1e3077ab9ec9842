"""What `companion plot` draws, and what it refuses in one sentence, without a traceback."""

import json
from math import nan

import numpy as np
import pytest

from companion.extras import MissingExtraError
from companion.recording.figure import FigureError, draw_flight
from companion.recording.history import HEIGHTS, Marks, Span, draw_history, marks_of

pyplot = pytest.importorskip("matplotlib.pyplot")

ROWS = "".join(f"{0.004 * k},1.0,0.0,0.0,0.0,0.1,0.0\n" for k in range(15))

MOTION = "".join(f"{0.1 * k:.1f},nan,{0.05 * k},1.0,2.0,nan\n" for k in range(100))
MARKS = Marks(
    phases=[(0.0, "connect"), (0.05, "checks"), (3.0, "takeoff"), (5.0, "maneuvers")],
    maneuvers=[Span(5.0, 6.0, "hover"), Span(6.0, 8.2, "steps (open loop)")],
    end=8.2,
    reason="the vehicle is 9.1 m away, which costs $100",
)
SUMMARY = {
    "gain_per_s": 5.0,
    "result": MARKS.reason,
    "phases": [{"time_s": time, "name": name} for time, name in MARKS.phases],
    "maneuvers": [
        {"begin_s": 5.0, "duration_s": 1.0, "name": "hover", "open_loop": False},
        {"begin_s": 6.0, "duration_s": 2.2, "name": "steps", "open_loop": True},
    ],
    "early_end": {"time_s": 8.2},
}


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("tracking.csv", "time\n", "it holds no rows"),
        ("tracking.csv", "a,b\n1.0,2.0\n", "2 columns instead of 7"),
        ("tracking.csv", "time\n" + "1e300," * 6 + "1\n", "a number is above 1e+09"),
        ("tracking.csv", "time\n" + "x," * 6 + "1\n", "could not convert"),
        ("summary.json", "[]", "summary.json: not as a flight writes it"),
        ("summary.json", json.dumps({"gain_per_s": 0}), "gain_per_s is 0"),
        ("motion.csv", "a,b\n1.0,2.0\n", "2 columns instead of 6"),
        ("summary.json", json.dumps({"gain_per_s": 5.0, "phases": 3}), "not as a flight writes"),
    ],
)
def test_files_that_no_flight_writes_are_refused(tmp_path, name, text, words):
    (tmp_path / "response.csv").write_text("time\n" + ROWS)
    (tmp_path / "motion.csv").write_text("time\n" + MOTION)
    (tmp_path / "summary.json").write_text(json.dumps({"gain_per_s": 5.0}))
    (tmp_path / name).write_text(text)
    with pytest.raises(FigureError, match=words.replace("+", r"\+")):
        draw_flight(tmp_path, tmp_path / "out.png")


def test_the_marks_are_those_of_the_summary():
    assert marks_of(SUMMARY) == MARKS
    assert marks_of({**SUMMARY, "early_end": None}).end is None
    assert marks_of({"gain_per_s": 5.0}) == Marks()  # of an older version
    for path in ("begin_s", "duration_s"):
        broken = [{**SUMMARY["maneuvers"][0], path: nan}]
        with pytest.raises(ValueError, match="a time is nan"):
            marks_of({**SUMMARY, "maneuvers": broken})


def test_each_panel_has_its_curve_its_unit_and_all_marks():
    motion = np.array([[0.1 * k, 50.0, 0.05 * k, 1.5, 20.0, 0.3] for k in range(100)])
    figure, panels = pyplot.subplots(len(HEIGHTS), 1)
    try:
        draw_history(panels, motion, MARKS)
        labels = [axes.get_ylabel() for axes in panels]
        assert labels == ["tracking error, m", "speed, m/s", "tilt, °", "height, m"]
        assert panels[-1].get_xlabel() == "time since the flight began, s"
        for axes, column in zip(panels, (5, 3, 4, 2), strict=True):
            (curve,) = [line for line in axes.lines if len(line.get_xdata()) == len(motion)]
            assert curve.get_ydata().tolist() == motion[:, column].tolist()
            assert len(axes.patches) == 2  # both maneuvers
            assert sum(list(line.get_xdata()) == [8.2, 8.2] for line in axes.lines) == 1
        names = [text.get_text() for text in panels[0].texts]
        assert names == ["hover", "steps (open loop)"]
        assert panels[0].get_title() == (
            r"ended at 8.2 s: the vehicle is 9.1 m away, which costs \$100"
        )
        phases = [text.get_text().strip() for text in panels[-1].texts]
        assert phases == ["connect, checks", "takeoff", "maneuvers"]
    finally:
        pyplot.close(figure)


@pytest.mark.parametrize(
    "kept", [("motion.csv",), ("response.csv",), ("motion.csv", "response.csv")]
)
def test_a_flight_is_drawn_with_what_it_recorded(tmp_path, kept):
    for name, rows in (("motion.csv", MOTION), ("response.csv", ROWS)):
        if name in kept:
            (tmp_path / name).write_text("time\n" + rows)
    (tmp_path / "summary.json").write_text(json.dumps(SUMMARY))
    draw_flight(tmp_path, tmp_path / "out.png")
    assert (tmp_path / "out.png").read_bytes()[:4] == b"\x89PNG"


def test_a_missing_extra_is_one_clear_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda *_: None)
    with pytest.raises(MissingExtraError) as told:
        draw_flight(tmp_path, tmp_path / "out.png")
    assert "drawing" in str(told.value)
    assert "[plot]" in str(told.value)
    assert "\n" not in str(told.value)
