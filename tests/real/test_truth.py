"""The truth is read as the simulators write it."""

import struct

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from tests.real.dataflash import DataflashLog
from tests.real.hil_truth import HilTruth
from tests.real.stamps import stamp_offset
from tests.real.truth import NoTruthError


def hil_frame(stamp_us, north_m):
    """As PX4 packs it, trailing zeros cut off."""
    north = round(1e7 * np.degrees(north_m / 6371000.0))
    message = common.MAVLink_hil_state_quaternion_message(
        stamp_us, [0.6, 0.0, 0.8, 0.0], 0, 0, 0, north, 0, 489_000, 0, 0, 0, 0, 0, 0, 0, 0
    )
    return message.pack(common.MAVLink(None, 1, 1))


def test_px4s_truth_comes_by_its_own_clock():
    truth = HilTruth(0)
    try:
        for k in range(3):
            truth._take(10.0 + k, hil_frame(4000 * k, 2.0 * k))
        motion = truth.since(10.5)
    finally:
        truth.close()
    assert motion.time == pytest.approx([0.004, 0.008])
    assert motion.position[:, 0] == pytest.approx([0.0, 2.0], abs=0.02)
    assert motion.position[:, 2] == pytest.approx([-489.0, -489.0])
    assert motion.q[0] == pytest.approx([0.6, 0.0, 0.8, 0.0])


def fmt(number, name, letters, labels):
    size = 3 + struct.calcsize("<" + letters.replace("L", "i"))
    body = struct.pack("<BB4s16s64s", number, size, name, letters.encode(), labels.encode())
    return b"\xa3\x95\x80" + body


def sim2(stamp_us, north):
    return b"\xa3\x95\x02" + struct.pack("<Qfff", stamp_us, north, 0.0, -5.0)


def sim(stamp_us):
    return b"\xa3\x95\x01" + struct.pack("<Qffff", stamp_us, 1.0, 0.0, 0.0, 0.0)


def test_ardupilots_log_is_read_as_it_grows(tmp_path):
    path = tmp_path / "1.BIN"
    head = fmt(1, b"SIM", "Qffff", "TimeUS,Q1,Q2,Q3,Q4") + fmt(
        2, b"SIM2", "Qfff", "TimeUS,PN,PE,PD"
    )
    other = fmt(3, b"ATT", "Qf", "TimeUS,Roll") + b"\xa3\x95\x03" + struct.pack("<Qf", 5, 1.0)
    path.write_bytes(
        head + other + sim(1_000_000) + sim2(1_000_000, 1.0) + sim2(1_002_500, 1.5)[:9]
    )
    log = DataflashLog(path)
    log._read()
    with path.open("ab") as file:
        file.write(
            sim2(1_002_500, 1.5)[9:] + b"\x00damaged" + sim2(1_005_000, 2.0) + sim(1_040_000)
        )
    motion = log.truth(1.001)
    assert motion.time == pytest.approx([1.0025, 1.005])
    assert motion.position[:, 0] == pytest.approx([1.5, 2.0])
    assert motion.q_time == pytest.approx([1.04])
    with pytest.raises(NoTruthError):
        log.truth(2.0)


def recorded(tmp_path, jump=0.0):
    """A `.tlog` of 100 samples whose stamps jump in the middle, and the answers to them."""
    sender = common.MAVLink(None, 1, 1)
    records, rates = b"", []
    for k in range(100):
        turning = [0.01 * np.sin(k), 0.02 * np.cos(k), 0.0]
        stamp = 50.0 + 0.004 * k + (jump if k >= 50 else 0.0)
        message = common.MAVLink_attitude_quaternion_message(
            round(1000 * stamp), 1, 0, 0, 0, *turning
        )
        records += struct.pack(">Q", k) + message.pack(sender)
        rates.append([42.0 + 0.004 * k, 0, 0, 0, 0, 0, *np.float32(turning), 0])
    (tmp_path / "flight.tlog").write_bytes(records)
    return np.array(rates), tmp_path / "flight.tlog"


def test_the_programs_vehicle_time_is_laid_over_the_autopilots_stamps(tmp_path):
    assert stamp_offset(*recorded(tmp_path)) == pytest.approx(8.0)


def test_a_clock_that_jumped_in_control_measures_nothing(tmp_path):
    with pytest.raises(NoTruthError, match="jumped"):
        stamp_offset(*recorded(tmp_path, jump=0.5))
