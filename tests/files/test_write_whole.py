"""A file is written whole or not at all."""

import contextlib
import errno
import os
import stat
import threading
import time
from pathlib import Path

import pytest

from companion.files import write_whole as module
from companion.files.write_whole import DISK_HANGS, ReservedSpace, write_whole
from companion.flight import flight_files
from companion.flight.observer import SilentObserver
from companion.testing import fly
from tests.flight.fly import QUICK_FLIGHT, QuickVehicle, merged


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
    monkeypatch.setattr(module, "DISK_TIMEOUT", 0.05)
    answers = threading.Event()
    monkeypatch.setattr(os, "fsync", lambda _: answers.wait(10.0))
    began = time.monotonic()
    why = module.write_with_timeout(tmp_path / "summary.json", "{}")
    assert time.monotonic() - began < 5.0
    assert why == DISK_HANGS
    answers.set()


def test_in_time_it_writes_or_says_why_not(tmp_path):
    assert module.write_with_timeout(tmp_path / "summary.json", "{}") is None
    assert (tmp_path / "summary.json").read_text() == "{}"
    assert module.write_with_timeout(tmp_path / "no folder" / "summary.json", "{}").startswith(
        "No such"
    )


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


def test_a_file_name_in_another_encoding_is_written_with_question_marks(tmp_path):
    write_whole(tmp_path / "page.html", "<title>" + os.fsdecode(b"caf\xe9") + "</title>")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == "<title>caf?</title>"


@pytest.mark.parametrize("path", [".", "/"])
def test_a_folder_without_a_name_is_refused_as_any_folder(path):
    with pytest.raises(IsADirectoryError, match="Is a directory") as refused:
        write_whole(Path(path), "")
    assert refused.value.filename == path


def reserved(folder):
    """Bytes on the disk that open files without a name hold in a folder."""
    held = 0
    for link in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(OSError):
            path = str(link.readlink())
            if path.startswith(f"{folder}/") and path.endswith("(deleted)"):
                held += 512 * link.stat().st_blocks
    return held


def test_room_is_kept_without_a_name_and_freed(tmp_path):
    room = ReservedSpace(tmp_path, 1 << 16)
    assert reserved(tmp_path) >= 1 << 16
    assert not list(tmp_path.iterdir())
    room.free()
    room.free()
    assert reserved(tmp_path) == 0
    forgotten = ReservedSpace(tmp_path, 1 << 16)
    del forgotten
    assert reserved(tmp_path) == 0


def test_a_disk_that_cannot_keep_room_is_no_error(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    ReservedSpace(tmp_path / "missing", 1).free()
    monkeypatch.setattr(os, "posix_fallocate", full)
    ReservedSpace(tmp_path, 1).free()


def test_a_flight_keeps_room_for_its_summary_until_it_writes_it(tmp_path, monkeypatch):
    held, written = [], flight_files.write_with_timeout

    class Watching(SilentObserver):
        def phase(self, name, waits_for):
            held.append(reserved(tmp_path))

    def write(path, text):
        held.append(reserved(tmp_path))
        return written(path, text)

    monkeypatch.setattr(flight_files, "write_with_timeout", write)
    summary = fly(merged(QUICK_FLIGHT, {}), QuickVehicle(), tmp_path, Watching())
    assert summary.result == "ok"
    *flying, writing = held
    assert min(flying) >= flight_files._SUMMARY_RESERVE > 10 * len(summary.as_json())
    assert writing < flight_files._SUMMARY_RESERVE, "nothing but the rows of the figures"


def test_a_folder_that_is_a_file_is_told_with_the_files_own_name(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError) as refused:
        write_whole(tmp_path / "file" / "below", "text")
    assert refused.value.filename == str(tmp_path / "file" / "below")
