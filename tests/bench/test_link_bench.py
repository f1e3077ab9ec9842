"""The benchmark itself: that it measures the right answer, and says what it cannot do."""

import math
import struct

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.bench import link
from companion.bench.process import BenchmarkedProgram, BenchmarkError
from companion.bench.sender import Sender, stamp_by_time, stamp_by_yaw_rate


def setpoint(stamp, yaw_rate=0.0):
    return dialect.MAVLink_set_attitude_target_message(
        stamp, 1, 1, 128, [1.0, 0.0, 0.0, 0.0], 0.1, 0.2, yaw_rate, 0.5
    ).pack(dialect.MAVLink(None, 1, 191))


def test_stamps_are_read_where_pymavlink_puts_them():
    assert stamp_by_time(setpoint(123456)) == 123456
    assert [
        stamp_by_yaw_rate(setpoint(7, math.radians(degrees))) for degrees in range(8192)
    ] == list(range(8192))


@pytest.mark.parametrize("module", ["echo_program", "companion_program", "pymavlink_program"])
def test_every_sample_is_answered_and_its_time_taken(module):
    program = BenchmarkedProgram(module, f"companion.bench.{module}")
    sender = Sender(program)
    try:
        sender.wait_ready()
        sender.send_for(100.0, 0.5)
        assert sender.sent_samples == 50
        assert 0 < len(sender.round_trips_ns) <= 50
        assert min(sender.round_trips_ns) > 0
        assert sender.cpu_ns > 0
    finally:
        sender.close()


def test_the_echo_is_of_a_setpoints_size():
    from companion.bench import echo_program  # noqa: PLC0415

    size = len(echo_program._HEADER) + 4 + len(echo_program._PAYLOAD_END)
    assert size == len(setpoint(1))
    assert struct.unpack_from("<B", echo_program._HEADER, 7)[0] == 82


def test_a_program_that_ends_early_is_told_with_its_last_words():
    program = BenchmarkedProgram("broken", "companion.bench.no_such_program")
    try:
        program._process.wait(10)
        with pytest.raises(BenchmarkError, match=r"broken ended early: .*no_such_program"):
            program.check_running()
    finally:
        program.stop()


@pytest.mark.slow
def test_all_of_them_in_one_go(capsys):
    pytest.importorskip("mavsdk")
    figures = link.run(1.0, 100.0, as_json=False)
    for key in ("echo", "companion", "pymavlink", "companion_mavsdk", "mavsdk"):
        row = figures[key]
        assert 0.0 < row["p50_us"] <= row["p99_us"] <= row["max_us"]
        assert row["cpu_percent"] > 0.0
        assert row["samples"] == 100
    ratio = figures["companion"]["p50_us"] / figures["echo"]["p50_us"]
    assert figures["ratio"]["companion_to_echo"] == pytest.approx(ratio, abs=1e-3)
    shown = capsys.readouterr().out
    assert "MAVSDK" in shown
    assert "× echo" in shown
