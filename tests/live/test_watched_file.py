"""Edits of a file that is watched: 20 kinds of bad ones change nothing, good ones count."""

import os
from pathlib import Path

import pytest

from companion.config.files import load
from companion.live.checks import ChangeChecks
from companion.live.watched_file import WatchedFile

GOOD = """\
include: base.yaml
planner:
  gain_per_s: 5.0
limits:
  max_tilt_deg: 30.0
"""
BASE = "guidance: {height_gain_per_s: 1.5}\n"


def _gone(path):
    path.unlink()


def _folder(path):
    path.unlink()
    path.mkdir()


def _unreadable_link(path):
    path.unlink()
    path.symlink_to(path)


def _pipe(path):
    path.unlink()
    os.mkfifo(path)


def _text(text):
    return lambda path: path.write_text(text)


def _bytes(data):
    return lambda path: path.write_bytes(data)


def _with(line):
    return _text(GOOD + line + "\n")


BAD = {
    "syntax": _with("flight: ["),
    "tab": _with("flight:\n\tarm: true"),
    "half-written": _text(GOOD[: GOOD.index("max_tilt_deg") + 4]),
    "empty": _text(""),
    "unknown key": _text(GOOD.replace("max_tilt", "max_tild")),
    "unknown section": _with("limit: {max_tilt_deg: 20}"),
    "the same key twice": _text(GOOD + "planner: {gain_per_s: 4.0}\n"),
    "out of range": _text(GOOD.replace("30.0", "99.0")),
    "text for a number": _text(GOOD.replace("30.0", "'20'")),
    "not a number": _text(GOOD.replace("30.0", ".nan")),
    "no value": _text(GOOD.replace("30.0", "")),
    "a key that must not change": _with("  fence_radius_m: 20.0"),
    "another maneuver": _with("flight: {maneuvers: [steps]}"),
    "more than at the start": _text(GOOD.replace("30.0", "34.0")),
    "contradiction": _with("  recovery_angle_deg: 20.0"),
    "not flown with it": _text(GOOD.replace("30.0", "3.0")),
    "a list": _text("- 1\n- 2\n"),
    "too large": _text(GOOD + "#" * 3_000_000),
    "no text": _bytes(b"\xff\xfe\x00\x01" * 50),
    "gone": _gone,
    "a folder": _folder,
    "a link to itself": _unreadable_link,
    "a pipe": _pipe,
    "includes itself": _text(GOOD.replace("base.yaml", "watched.yaml")),
    "includes what is not there": _text(GOOD.replace("base.yaml", "nothing.yaml")),
    "aliases": _with("x: &a [*a]"),
}


@pytest.fixture
def watched(tmp_path: Path):
    """The file, its watch, and the checks of its flight."""
    path = tmp_path / "watched.yaml"
    (tmp_path / "base.yaml").write_text(BASE)
    path.write_text(GOOD)
    checks = ChangeChecks(load(path), flies_maneuvers=True)
    return path, WatchedFile(path, load(path), checks.check), checks


def _looked(watch):
    """The first edit of the next looks."""
    return next(filter(None, (watch.newest_edit() for _ in range(4))), None)


@pytest.mark.parametrize("edit", BAD.values(), ids=BAD)
def test_a_bad_edit_is_explained_and_the_next_good_one_counts(watched, edit):
    path, watch, _ = watched
    assert _looked(watch) is None
    edit(path)
    told = _looked(watch)
    assert told is not None
    assert not told.values
    assert told.refusal.startswith("watched.yaml is not applied, and nothing has changed: ")
    assert "\n" not in told.refusal
    assert len(told.refusal) < 500
    assert _looked(watch) is None  # said once
    path.rmdir() if path.is_dir() else path.unlink(missing_ok=True)
    path.write_text(GOOD.replace("5.0", "4.0"))
    told = _looked(watch)
    assert (told.refusal, told.values) == (None, {"planner": {"gain_per_s": 4.0}})


def test_a_good_edit_counts_from_the_accepted_one_on(watched):
    path, watch, _ = watched
    path.write_text(GOOD.replace("30.0", "25.0"))
    assert _looked(watch).values == {"limits": {"max_tilt_deg": 25.0}}
    path.write_text(GOOD.replace("30.0", "25.0").replace("5.0", "4.0", 1))
    assert _looked(watch).values == {
        "limits": {"max_tilt_deg": 25.0},
        "planner": {"gain_per_s": 4.0},
    }
    watch.accept()
    path.with_name("base.yaml").write_text("guidance: {height_gain_per_s: 2.0}\n")
    assert _looked(watch).values == {"guidance": {"height_gain_per_s": 2.0}}


def test_a_file_that_is_being_written_is_left_alone(watched):
    path, watch, _ = watched
    for size in range(0, len(GOOD), 9):
        path.write_text(GOOD[:size])
        assert watch.newest_edit() is None
    path.write_text(GOOD)
    assert _looked(watch) is None


def test_an_edit_made_before_the_watch_begins_is_the_first_edit(tmp_path):
    path = tmp_path / "watched.yaml"
    path.write_text("planner: {gain_per_s: 5.0}\n")
    read = load(path)
    path.write_text("planner: {gain_per_s: 4.0}\n")
    watch = WatchedFile(path, read, lambda *_: None)
    assert _looked(watch).values == {"planner": {"gain_per_s": 4.0}}
    path.write_text("limits: [")
    assert _looked(watch).refusal is not None


def test_an_edit_of_a_nested_include_counts_also_where_it_was_missing(watched):
    path, watch, _ = watched
    assert _looked(watch) is None
    path.with_name("base.yaml").write_text(f"include: deep.yaml\n{BASE}")
    assert "deep.yaml" in _looked(watch).refusal
    path.with_name("deep.yaml").write_text("planner: {yaw_gain_per_s: 2.5}\n")
    assert _looked(watch).values == {"planner": {"yaw_gain_per_s": 2.5}}
    watch.accept()
    path.with_name("deep.yaml").write_text("planner: {yaw_gain_per_s: 1.5}\n")
    assert _looked(watch).values == {"planner": {"yaw_gain_per_s": 1.5}}
