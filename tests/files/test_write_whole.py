"""A file is written whole or not at all."""

import os
import stat
import threading
import time

import pytest

from companion.files import write_whole as module
from companion.files.write_whole import write_whole


def test_it_makes_a_file_and_replaces_it(tmp_path):
    path = tmp_path / "settings.yaml"
    write_whole(path, "an old text that is long\n")
    write_whole(path, "tilt: 35 °\n")
    assert path.read_text(encoding="utf-8") == "tilt: 35 °\n"
    assert [each.name for each in tmp_path.iterdir()] == ["settings.yaml"]


def test_a_secret_is_never_readable_by_others(tmp_path, monkeypatch):
    modes, replaced = [], type(tmp_path).replace

    def replace(self, target):
        modes.append(stat.S_IMODE(self.stat().st_mode))
        return replaced(self, target)

    monkeypatch.setattr(type(tmp_path), "replace", replace)
    write_whole(tmp_path / "stamps.json", "{}", mode=0o600)
    assert modes == [0o600]


def test_the_text_is_on_the_disk_before_the_name_and_the_name_before_it_returns(
    tmp_path, monkeypatch
):
    """Killed at any moment, the old file or the new one is there."""
    path, synced = tmp_path / "undo.yaml", []
    path.write_text("old")

    def fsync(descriptor):
        folder = stat.S_ISDIR(os.fstat(descriptor).st_mode)
        synced.append(("folder" if folder else "file", path.read_text()))

    monkeypatch.setattr(os, "fsync", fsync)
    write_whole(path, "new")
    assert synced == [("file", "old"), ("folder", "new")]


def test_a_full_disk_leaves_the_old_file_and_no_other(tmp_path, monkeypatch):
    path = tmp_path / "learned.json"
    path.write_text("old")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert [each.name for each in tmp_path.iterdir()] == ["learned.json"]


def test_a_disk_that_hangs_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "LONGEST", 0.05)
    answers = threading.Event()
    monkeypatch.setattr(os, "fsync", lambda _: answers.wait(10.0))
    began = time.monotonic()
    why = module.write_in_time(tmp_path / "summary.json", "{}")
    assert time.monotonic() - began < 1.0
    assert why == "the disk did not answer for 0.05 s"
    answers.set()


def test_in_time_it_writes_or_says_why_not(tmp_path):
    assert module.write_in_time(tmp_path / "summary.json", "{}") is None
    assert (tmp_path / "summary.json").read_text() == "{}"
    assert module.write_in_time(tmp_path / "no folder" / "summary.json", "{}").startswith("No such")


def test_an_error_names_the_file_and_not_the_temporary_one(tmp_path, monkeypatch):
    with pytest.raises(OSError, match="No such file") as missing:
        write_whole(tmp_path / "no folder" / "page.html", "")
    assert missing.value.filename == str(tmp_path / "no folder" / "page.html")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space") as unwritten:
        write_whole(tmp_path / "page.html", "")
    assert unwritten.value.filename == str(tmp_path / "page.html")
