"""The tlog is what pymavlink reads, and writing it never gets in the way."""

import errno
import io
from pathlib import Path

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import common

from companion.recording.tlog import TlogWriter


def frame(number):
    sender = common.MAVLink(None, srcSystem=1, srcComponent=1)
    sender.seq = number
    return common.MAVLink_system_time_message(number, 0).pack(sender)


def test_pymavlink_reads_back_every_frame_and_its_time(tmp_path):
    path = tmp_path / "flight.tlog"
    with TlogWriter(path, clock_epoch=1.7e9) as tlog:
        for k in range(300):
            tlog(0.25 * k, bytes(frame(k % 256)))
    log = mavutil.mavlink_connection(str(path))
    messages = list(iter(log.recv_match, None))
    assert [m.time_unix_usec for m in messages] == [k % 256 for k in range(300)]
    assert [m._timestamp for m in messages] == pytest.approx([1.7e9 + 0.25 * k for k in range(300)])


class FullDisk(io.BytesIO):
    def write(self, data):
        raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_is_told_once_and_raises_nothing(tmp_path, monkeypatch):
    told = []
    tlog = TlogWriter(tmp_path / "flight.tlog", 0.0, told.append)
    monkeypatch.setattr(Path, "open", lambda *_, **__: FullDisk())
    tlog.open()
    for k in range(100):
        tlog(float(k), b"frame")
    tlog.close()
    assert len(told) == 1
    assert "No space left on device" in told[0]
    assert tlog.failure == told[0]
    assert tlog.dropped == 100


def test_a_folder_that_cannot_be_written_is_an_error_at_once(tmp_path):
    with pytest.raises(OSError, match="No such file"):
        TlogWriter(tmp_path / "missing" / "flight.tlog", 0.0).open()
