"""Rows of a long flight: all of them are there afterwards, few of them in memory meanwhile."""

import errno
import gc
import os
import threading
import tracemalloc

import numpy as np
import pytest

from companion.recording import series as room
from companion.recording.series import Series, Spool, SpooledFile

COLUMNS = ("number", "square")


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(room, "_CHUNK_ROWS", 8)


def noted(count, spool, rows_in_memory=0):
    series = Series(COLUMNS, spool, rows_in_memory)
    for number in range(count):
        series.add([float(number), float(number * number)])
    return series


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 16, 100])
@pytest.mark.parametrize("kept", [0, 16])
def test_every_row_comes_back_in_order(tmp_path, count, kept):
    series = noted(count, Spool(tmp_path), kept)
    assert len(series) == count
    numbers = np.arange(float(count))
    for since in {0, count // 2, max(0, count - 3), count}:
        rows = series.rows(since)
        assert rows.shape == (count - since, 2)
        assert np.array_equal(rows, np.stack((numbers, numbers**2), axis=1)[since:])


def test_the_newest_rows_are_had_without_the_disk(tmp_path, monkeypatch):
    series = noted(100, Spool(tmp_path), rows_in_memory=16)

    def refuse(*_):
        raise AssertionError("the disk was asked")

    monkeypatch.setattr(Spool, "flush", refuse)
    assert series.rows(84)[:, 0].tolist() == list(range(84, 100))
    with pytest.raises(AssertionError, match="the disk"):
        series.rows(0)


def test_memory_does_not_grow_with_the_flight(tmp_path, monkeypatch):
    monkeypatch.setattr(room, "_CHUNK_ROWS", 256)
    spool = Spool(tmp_path)
    series = Series(COLUMNS, spool, rows_in_memory=512)
    tracemalloc.start()
    try:
        sizes = []
        for _ in range(2):
            for number in range(20_000):
                series.add([float(number), 0.0])
                if number % 10_000 == 0:
                    spool.flush()  # or more would wait than may
            spool.flush()
            sizes.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert sizes[1] - sizes[0] < 16_384  # of the 320 kB that came in between
    assert len(series.rows()) == 40_000


def test_a_full_disk_loses_rows_and_says_so(tmp_path, monkeypatch):
    written = []

    def fill_up(self, chunk):
        written.append(chunk)
        if len(written) > 1:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(self, chunk)

    real = SpooledFile.append
    monkeypatch.setattr(SpooledFile, "append", fill_up)
    spool = Spool(tmp_path)
    series = noted(16, spool)
    spool.flush()
    assert spool.failure == "No space left on device"
    for number in range(16, 27):
        series.add([float(number), 0.0])
    assert series.lost_count == 8
    assert len(written) == 2
    assert len(series) == 27
    assert series.rows()[:, 0].tolist() == [*range(8), *range(24, 27)]


def test_a_disk_that_stands_still_does_not_hold_up_the_flight(tmp_path, monkeypatch):
    monkeypatch.setattr(room, "_MAX_WAITING_CHUNKS", 2)
    go_on = threading.Event()
    monkeypatch.setattr(SpooledFile, "append", lambda *_: go_on.wait(10))
    series = noted(8 * 6, Spool(tmp_path))
    go_on.set()
    assert series.lost_count >= 8 * 3  # one is being written, and two wait


def test_nothing_stays_on_the_disk_and_the_thread_ends(tmp_path):
    before = set(threading.enumerate())
    series = noted(100, Spool(tmp_path))
    series.rows()
    (thread,) = (each for each in set(threading.enumerate()) - before if each.name == "spool")
    del series
    gc.collect()
    thread.join(5.0)
    assert not thread.is_alive()
    assert list(tmp_path.iterdir()) == []


def test_a_chunk_that_the_disk_takes_in_part_is_a_full_disk(tmp_path, monkeypatch):
    class Full:
        def write(self, chunk):
            return len(chunk) - 1

        def close(self):
            pass

    monkeypatch.setattr(room.tempfile, "TemporaryFile", lambda **_: Full())
    with pytest.raises(OSError, match="No space left"):
        SpooledFile(tmp_path).append(b"12345678")


@pytest.mark.filterwarnings("error")
def test_a_file_that_goes_with_its_series_leaves_no_warning(tmp_path):
    """Under `python -W error` a flight ended with "Exception ignored ... unclosed file"."""
    SpooledFile(tmp_path).append(b"12345678")
    gc.collect()


def test_a_row_cut_off_at_the_end_of_a_file_is_left_out(tmp_path):
    file = SpooledFile(tmp_path)
    assert file.read(2).size == 0
    file.append(np.arange(5.0).tobytes() + b"123")
    assert file.read(2).tolist() == [0.0, 1.0, 2.0, 3.0]


def test_without_a_folder_all_rows_stay_in_memory():
    before = set(threading.enumerate())
    series = noted(100, Spool())
    assert series.rows()[:, 0].tolist() == list(range(100))
    assert series.rows(90)[:, 0].tolist() == list(range(90, 100))
    assert (series.lost_count, set(threading.enumerate()) - before) == (0, set())
