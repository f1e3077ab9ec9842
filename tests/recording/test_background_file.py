"""The thread that writes a record: a bad entry, a backlog, and a disk that does not answer."""

import threading

import numpy as np
import pytest

from companion.attitude import BodyRates, Limits
from companion.control.sample_rows import Answer, LoopFlags, SampleEntry, SampleWriter
from companion.recording import background_file, series
from companion.recording.background_file import BackgroundFile
from companion.recording.flight_record import read_flight
from companion.recording.recorder import FlightRecorder
from companion.vehicle.records import AttitudeSample


def test_numpy_rates_are_recorded_and_a_bad_entry_costs_itself_alone(tmp_path):
    failures, bad = [], []
    recorder = FlightRecorder(
        tmp_path / "flight.mcap", 0.0, lambda: 1.0, failures.append, bad.append
    )
    rows = SampleWriter(Limits(np.float64(1.0), np.float64(0.5)), (0.1, 0.9))
    q = (1.0, 0.0, 0.0, 0.0)
    sample = AttitudeSample(7, 0.007, 1.0, 0, q, BodyRates(0.0, 0.0, 0.0), 0.01, None, True)
    flags = LoopFlags(True, True, True, False, True)
    rates = BodyRates(*map(np.float64, (0.0, 0.0, 0.5)))
    answer = Answer(rates, np.float64(0.5), 1000, None, None, np.bool_(False), np.bool_(False))
    with recorder:
        recorder.begin(1.0, {})
        recorder.add(1.0, rows.sample, SampleEntry(sample, None, flags, 1.0, answer))
        for _ in range(3):
            recorder.add(1.0, rows.sample, SampleEntry(sample, "no reason", flags, 1.0, None))
        recorder.event("after the bad ones")
    assert recorder.failure is None
    assert not failures
    (told,) = bad
    assert "no reason" in told
    assert recorder.dropped == 3
    record = read_flight(tmp_path)
    assert record.content.complete
    assert record.events[-1].text == "after the bad ones"
    (setpoint,) = record.rows("setpoint")
    assert setpoint["commanded_yaw_rad_s"] == 0.5


class Slices(BackgroundFile):
    """A file that keeps how many items came at a time; `answers` is set while the disk does."""

    def __init__(self, path, told=None):
        super().__init__(path, 10_000, told)
        self.sizes, self.answers = [], threading.Event()

    def _create(self):
        pass

    def _write(self, items):
        self.answers.wait(10.0)
        self.sizes.append(len(items))

    def _sync(self):
        pass

    def _finish_file(self, *, complete):
        pass


@pytest.mark.parametrize(("count", "size"), [(110, 20), (5000, 100)])
def test_what_waits_is_written_in_slices(tmp_path, count, size):
    writer = Slices(tmp_path / "file")
    writer.answers.set()
    for number in range(count):
        writer.put(number)
    with writer:
        pass
    assert sum(writer.sizes) == count
    assert max(writer.sizes) == size
    assert writer.dropped == 0


def test_a_disk_that_does_not_answer_does_not_keep_the_flight_from_ending(tmp_path, monkeypatch):
    monkeypatch.setattr(background_file, "DISK_TIMEOUT", 0.1)
    told = []
    writer = Slices(tmp_path / "file", told.append)
    for number in range(50):
        writer.put(number)
    writer.open()
    writer.close()
    (text,) = told
    assert "did not answer" in text
    writer.answers.set()


def test_figures_do_not_wait_for_such_a_disk_either(tmp_path, monkeypatch):
    monkeypatch.setattr(series, "DISK_TIMEOUT", 0.1)
    answers = threading.Event()
    monkeypatch.setattr(series.SpooledFile, "append", lambda *_: answers.wait(10.0))
    spool = series.Spool(tmp_path)
    rows = series.Series(("time_s",), spool)
    for number in range(1500):
        rows.add([float(number)])
    assert rows.rows()[:, 0].tolist() == [float(number) for number in range(1024, 1500)]
    assert rows.lost_count == 1024
    assert "did not answer" in spool.failure
    answers.set()


class Refusing(Slices):
    """A file that cannot be written."""

    complete = None

    def _write(self, items):
        raise ValueError("no such item")

    def _finish_file(self, *, complete):
        self.complete = complete


def test_an_item_that_cannot_be_written_ends_the_recording_and_not_the_flight(tmp_path):
    writer = Refusing(tmp_path / "file")  # nobody is told
    for number in range(30):
        writer.put(number)
    with writer:
        pass
    assert writer.failure.endswith("internal error: ValueError('no such item'); the flight goes on")
    assert writer.dropped == 30
    assert writer.complete is False


def test_a_file_that_was_never_opened_can_be_closed(tmp_path):
    writer = Slices(tmp_path / "file")
    writer.close()
    assert writer.failure is None
    assert list(tmp_path.iterdir()) == []
