"""What is kept of a vehicle between flights: read with bounds, written as a whole."""

import json
import os

import pytest

from companion.drag import Drag
from companion.recording.learned_file import LearnedFile, newest_learned

DRAG = Drag(0.25, 0.033)
GOOD = {"drag_per_s": 0.25, "quadratic_drag_per_m": 0.033, "top_speed_m_s": 5.0}


def test_what_is_saved_is_loaded_and_belongs_to_one_vehicle(tmp_path):
    file = LearnedFile(tmp_path, "4954")
    assert file.load() == (None, None)
    assert newest_learned(tmp_path) is None
    file.save(DRAG, 5.0)
    kept, trouble = file.load()
    assert trouble is None
    assert (kept.drag, kept.top_speed, kept.path) == (DRAG, 5.0, file.path)
    assert LearnedFile(tmp_path, "4955").load() == (None, None)
    assert [path.name for path in tmp_path.iterdir()] == ["learned-4954.json"]


def test_the_newest_is_the_vehicle_that_flew_last(tmp_path):
    for number, drag in enumerate((Drag(0.5), Drag(1.0), Drag(0.7))):
        file = LearnedFile(tmp_path, f"{number}")
        file.save(drag, 3.0)
        os.utime(file.path, (0.0, 1000.0 - abs(number - 1)))
    assert newest_learned(tmp_path).drag == Drag(1.0)
    assert newest_learned(tmp_path / "absent") is None


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[1, 2]",
        "null",
        "[" * 100_000,
        "{}" + " " * 20_000,
        *(
            json.dumps({**GOOD, key: value})
            for key in GOOD
            for value in (-0.1, 1e9, float("nan"), float("inf"), None, "0.3", True, [0.3])
        ),
        json.dumps({**GOOD, "drag_per_s": 10**400}),  # more than a float holds
        json.dumps({key: value for key, value in GOOD.items() if key != "drag_per_s"}),
    ],
    ids=lambda text: text[:70],
)
def test_a_damaged_file_is_told_and_not_used(tmp_path, text):
    file = LearnedFile(tmp_path, "4954")
    file.path.write_text(text)
    kept, trouble = file.load()
    assert kept is None
    assert "learned-4954.json: the drag that earlier flights learned cannot be used" in trouble
    assert newest_learned(tmp_path) is None


def test_a_pipe_or_a_directory_in_its_place_is_no_file(tmp_path):
    pipe, folder = LearnedFile(tmp_path, "1"), LearnedFile(tmp_path, "2")
    os.mkfifo(pipe.path)
    folder.path.mkdir()
    for file in (pipe, folder):
        kept, trouble = file.load()
        assert kept is None
        assert "cannot be used" in trouble
    assert newest_learned(tmp_path) is None
    with pytest.raises(OSError):  # noqa: PT011  whichever the system names
        folder.save(DRAG, 5.0)
    assert not [path for path in tmp_path.iterdir() if path.suffix not in (".json",)]


def test_a_path_that_cannot_be_looked_at_is_told_and_does_not_end_the_flight(tmp_path):
    kept, trouble = LearnedFile(tmp_path, "4" * 300).load()
    assert kept is None
    assert "cannot be used (cannot read it: File name too long)" in trouble
