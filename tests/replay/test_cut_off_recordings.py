"""A flight that is killed, or whose files are cut off, leaves a folder that can be read."""

import json
import multiprocessing
import os
import random
import struct
import time

import numpy as np
import pytest

from companion.config.files import load
from companion.flight.observer import SilentObserver
from companion.mavlink.tlog_file import messages
from companion.recording import background_file
from companion.recording.flight_record import read_flight
from companion.recording.measurements.recorded_summary import summary_of
from tests.flight.fly import fly, mock_vehicle

TOLD = struct.Struct("<dd")
LASTS = 10.0
"""At least this long lasts the flight, s of vehicle time."""
SLOWED_S = 0.04
"""The child sleeps so long at each status, so that a second of our time is a part of the flight."""
ALLOWED_S = 1.0
RANDOM = random.Random(18)
MOMENTS = [(RANDOM.choice(["px4", "ardupilot"]), RANDOM.uniform(0.0, LASTS)) for _ in range(50)]


class Telling(SilentObserver):
    """Tells our time and that of the flight at each status."""

    def __init__(self, pipe):
        self.pipe = pipe

    def status(self, status):
        os.write(self.pipe, TOLD.pack(time.monotonic(), status.time))
        time.sleep(SLOWED_S)


def fly_slowly(folder, autopilot, pipe):
    with mock_vehicle(autopilot=autopilot, in_lockstep=True) as mock:
        fly(mock, folder, Telling(pipe), hover={"duration_s": 2.0})


def killed(folder, autopilot, moment):
    """Kill a flight at `moment` (s since it began); return what it had reached a second before."""
    reading, writing = os.pipe()
    process = multiprocessing.get_context("fork").Process(
        target=fly_slowly, args=(folder, autopilot, writing)
    )
    process.start()
    os.close(writing)
    told = []
    with os.fdopen(reading, "rb") as pipe:
        while data := pipe.read(TOLD.size):
            told.append(TOLD.unpack(data))
            if told[-1][1] >= moment:
                break
        at = time.monotonic()
        process.kill()
        process.join()
    assert process.exitcode == -9, f"the flight ended {told[-1][1]} s after its beginning"
    return max((reached for our, reached in told if our <= at - ALLOWED_S), default=0.0)


@pytest.mark.parametrize(
    ("autopilot", "moment"),
    [
        ("px4", 0.1),
        ("ardupilot", 7.0),
        ("px4", LASTS - 1.0),
        *(pytest.param(*each, marks=pytest.mark.slow) for each in MOMENTS),
    ],
)
def test_a_killed_flight_lacks_at_most_its_last_second(tmp_path, autopilot, moment):
    reached = killed(tmp_path, autopilot, moment)
    record = read_flight(tmp_path)
    assert not record.content.complete
    assert record.duration >= reached
    summary, provisional = summary_of(record)
    assert provisional
    assert json.dumps(summary, allow_nan=False)
    assert load(tmp_path / "config.yaml").link.lockstep
    if reached:
        assert summary["phase"] != "connect"
        assert max(record.rows("motion")["time_s"]) >= reached
        stamps = [
            m.time_boot_ms for _, m in messages(tmp_path / "flight.tlog", {"ATTITUDE_QUATERNION"})
        ]
        assert 1e-3 * max(stamps) >= record.start_time + reached - 0.1


def test_a_record_cut_off_anywhere_gives_what_stands_before(tmp_path, monkeypatch):
    monkeypatch.setattr(background_file, "_SYNC_PERIOD", 0.1)  # several chunks in a quick flight
    whole = tmp_path / "whole"
    with mock_vehicle() as mock:
        summary = fly(mock, whole, hover={"duration_s": 1.0})
    data = {name: (whole / name).read_bytes() for name in ("flight.mcap", "flight.tlog")}
    everything = len(read_flight(whole).rows("sample"))
    cut = tmp_path / "cut"
    cut.mkdir()
    (cut / "config.yaml").write_bytes((whole / "config.yaml").read_bytes())
    found = []
    for share in np.linspace(0.0, 1.0, 40, endpoint=False):
        for name, content in data.items():
            (cut / name).write_bytes(content[: int(share * len(content))])
        record = read_flight(cut)
        assert not record.content.complete
        derived, provisional = summary_of(record)
        assert provisional
        found.append(derived["setpoints"])
        assert json.dumps(derived, allow_nan=False)
    assert found == sorted(found)
    assert found[-1] > 0.9 * summary.counts.setpoints
    assert len(set(found)) > 2  # several chunks
    (cut / "flight.mcap").write_bytes(data["flight.mcap"])
    assert len(read_flight(cut).rows("sample")) == everything
    assert read_flight(cut).content.complete
