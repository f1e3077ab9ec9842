"""ArduPilot's telemetry: silent until asked, whole milliseconds, refused above the loop's rate."""

import numpy as np
import pytest
from ardupilot_rig import ArduRig
from mock_rig import ACCEPTED, DENIED
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.ardupilot.streams import ArduPilotStreams

ATTITUDE_QUATERNION, ATTITUDE, HEARTBEAT = 31, 30, 0
LOOP_US = 2500


def streams(booting_until_us=0.0):
    return ArduPilotStreams({HEARTBEAT: 1.0}, loop_us=LOOP_US, booting_until_us=booting_until_us)


def sent(schedule, message, seconds):
    """Times in ms at which a message is sent."""
    slots = range(LOOP_US, round(seconds * 1e6) + 1, LOOP_US)
    return [slot / 1e3 for slot in slots if message in schedule.due(slot)]


@pytest.mark.parametrize(
    ("interval_us", "hz"),
    [(100_000, 10), (20_000, 50), (10_000, 100), (5000, 200), (4000, 250), (3003, 333.3),
     (3999, 333.3), (5500, 200)],
)  # fmt: skip
def test_what_arrives_is_what_was_asked_in_whole_milliseconds(interval_us, hz):
    schedule = streams()
    assert schedule.set_interval(ATTITUDE_QUATERNION, interval_us, 0) is None
    assert len(sent(schedule, ATTITUDE_QUATERNION, 6.0)) / 6.0 == pytest.approx(hz, rel=0.01)


def test_3_ms_come_as_recorded_in_turns_of_the_400_hz_loop():
    schedule = streams()
    schedule.set_interval(ATTITUDE_QUATERNION, 3003, 0)
    gaps, counts = np.unique(np.diff(sent(schedule, ATTITUDE_QUATERNION, 6.0)), return_counts=True)
    assert gaps.tolist() == [2.5, 5.0]
    assert counts[0] / counts[1] == pytest.approx((894 + 895) / 447, rel=0.01)  # recorded


@pytest.mark.parametrize("interval_us", [2500, 2000, 1000, 999, 0.5, 2999])
def test_faster_than_the_loop_is_refused_and_the_old_rate_kept(interval_us):
    schedule = streams()
    schedule.set_interval(ATTITUDE_QUATERNION, 20_000, 0)
    refused = schedule.set_interval(ATTITUDE_QUATERNION, interval_us, 0)
    assert refused == "Requested rate for message ID 31 too fast. Increase SCHED_LOOP_RATE"
    assert schedule.interval(ATTITUDE_QUATERNION) == 20_000


def test_never_and_as_at_boot():
    schedule = streams()
    schedule.set_interval(ATTITUDE, 10_000, 0)
    assert schedule.set_interval(ATTITUDE, -1.0, 0) is None
    assert sent(schedule, ATTITUDE, 1.0) == []
    schedule.set_interval(ATTITUDE, 10_000, 0)
    assert schedule.set_interval(ATTITUDE, 0.0, 0) is None  # at boot it is silent
    assert schedule.interval(ATTITUDE) == -1
    schedule.set_interval(HEARTBEAT, 100_000, 0)
    schedule.set_interval(HEARTBEAT, 0.0, 0)
    assert schedule.interval(HEARTBEAT) == 1_000_000


def test_until_it_is_ready_only_the_boots_own_streams_leave():
    schedule = streams(booting_until_us=1.5e6)
    schedule.set_interval(ATTITUDE, 100_000, 0)
    slots = range(LOOP_US, 2_000_001, LOOP_US)
    came = [(slot, message) for slot in slots for message in schedule.due(slot)]
    assert next(slot for slot, message in came if message == ATTITUDE) == 1_500_000
    assert next(slot for slot, message in came if message == HEARTBEAT) == 1_000_000
    assert sum(message == ATTITUDE for _, message in came) == 6  # what was missed is not made up


def test_by_command_with_its_results_and_words():
    rig = ArduRig(lockstep={"enabled": False})
    assert rig.command(511, 31, 3003) == ACCEPTED
    assert rig.command(511, 31, 2500) == DENIED
    assert rig.texts()[-1].startswith("Requested rate for message ID 31 too fast")
    assert rig.command(511, 12345, 10_000) == DENIED
    assert rig.texts()[-1] == "No ap_message for mavlink id (12345)"
    assert rig.command(511, 31, float("nan")) == DENIED
    assert rig.command(510, 31) == ACCEPTED
    assert rig.messages("MESSAGE_INTERVAL")[-1].interval_us == 3000
    before = rig.time
    rig.run(0.6)
    assert len(rig.messages("ATTITUDE_QUATERNION", since=before + 1e-6)) == pytest.approx(200, 1)


def test_groups_by_request_data_stream():
    rig = ArduRig()
    rig.say(dialect.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
    before = rig.time
    rig.run(1.01)
    kinds = {m.get_type() for at, m in rig.received if at > before + 1e-6}
    assert {"ATTITUDE", "VFR_HUD", "RAW_IMU", "RC_CHANNELS", "SYS_STATUS"} < kinds
    assert "ATTITUDE_QUATERNION" not in kinds  # it is in no group
    assert len(rig.messages("VFR_HUD", since=before + 1e-6)) == 4
    rig.say(dialect.MAVLink_request_data_stream_message(1, 1, 0, 0, 0))
    before = rig.time
    rig.run(0.6)
    assert rig.messages("VFR_HUD", since=before + 1e-6) == []
