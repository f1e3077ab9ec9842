"""What `companion plot` refuses to draw: one sentence, and no traceback."""

import json

import pytest

from companion.recording.figure import FigureError, draw_flight

pytest.importorskip("matplotlib")

ROWS = "".join(f"{0.004 * k},1.0,0.0,0.0,0.0,0.1,0.0\n" for k in range(15))


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("tracking.csv", "time\n", "it holds no rows"),
        ("tracking.csv", "a,b\n1.0,2.0\n", "2 columns instead of 7"),
        ("tracking.csv", "time\n" + "1e300," * 6 + "1\n", "a number is above 1e+09"),
        ("tracking.csv", "time\n" + "x," * 6 + "1\n", "could not convert"),
        ("summary.json", "[]", "summary.json: not as a flight writes it"),
        ("summary.json", json.dumps({"gain_per_s": 0}), "gain_per_s is 0"),
    ],
)
def test_files_that_no_flight_writes_are_refused(tmp_path, name, text, words):
    (tmp_path / "response.csv").write_text("time\n" + ROWS)
    (tmp_path / "summary.json").write_text(json.dumps({"gain_per_s": 5.0}))
    (tmp_path / name).write_text(text)
    with pytest.raises(FigureError, match=words.replace("+", r"\+")):
        draw_flight(tmp_path, tmp_path / "out.png")
