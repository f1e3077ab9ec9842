"""Telemetry rates: the defaults, and what is achieved when something else is asked."""

from itertools import pairwise

import pytest
from mock_rig import ACCEPTED, FAILED, Rig
from pymavlink.dialects.v20 import development as dialect

ATTITUDE_QUATERNION = dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION
DEFAULTS = {
    "ATTITUDE": 100, "ATTITUDE_QUATERNION": 50, "GLOBAL_POSITION_INT": 50, "HIGHRES_IMU": 50,
    "LOCAL_POSITION_NED": 30, "ODOMETRY": 30, "TIMESYNC": 10, "ALTITUDE": 10, "ATTITUDE_TARGET": 10,
    "SERVO_OUTPUT_RAW": 10, "VFR_HUD": 10, "GPS_RAW_INT": 8, "SYS_STATUS": 5,
    "EXTENDED_SYS_STATE": 5, "ESTIMATOR_STATUS": 1, "HEARTBEAT": 1, "PING": 1,
    "BATTERY_STATUS": 0.5, "HOME_POSITION": 0.5, "CURRENT_MODE": 0.5,
}  # fmt: skip


def achieved(rig, name, seconds):
    start = rig.time
    rig.run(seconds)
    return len(rig.messages(name, since=start + 1e-9)) / seconds


@pytest.mark.parametrize(
    ("loop", "asked", "got"),
    [
        (250, 100, 99), (250, 200, 124), (250, 250, 197), (250, 400, 191), (250, 500, 189),
        (250, 1000, 199), (800, 100, 98), (800, 200, 196), (800, 250, 196), (800, 400, 392),
        (800, 500, 392), (800, 1000, 392),
    ],
)  # fmt: skip
def test_measured_rates_of_px4(loop, asked, got):
    """At the full rate of the 250 Hz loop slots are missed by chance: flights had 190 to 235 Hz."""
    rig = Rig(inner_loop_hz=loop, lockstep={"enabled": False})
    rig.command(511, ATTITUDE_QUATERNION, 1e6 / asked)
    by_chance = loop == 250 and asked >= 250
    got, within = (212, 0.105) if by_chance else (got, 0.06)
    assert achieved(rig, "ATTITUDE_QUATERNION", 2.0) == pytest.approx(got, rel=within)


def test_the_steps_between_stamps_are_those_recorded():
    """px4-corners, px4-circle-5ms: attitude after 4 or 8 ms, position after 16 or 24 ms."""
    rig = Rig(lockstep={"enabled": False})
    rig.command(511, ATTITUDE_QUATERNION, 4000)
    rig.command(511, dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 20000)
    start = rig.time + 0.1
    rig.run(4.0)
    steps = {}
    for name in ("ATTITUDE_QUATERNION", "LOCAL_POSITION_NED"):
        stamps = [message.time_boot_ms for message in rig.messages(name, since=start)]
        steps[name] = [after - before for before, after in pairwise(stamps)]
    attitude, position = steps.values()
    assert set(attitude) == {4, 8}
    assert 0.13 < attitude.count(8) / len(attitude) < 0.27
    assert set(position) == {16, 24}
    assert position.count(16) == pytest.approx(position.count(24), abs=1)


def test_missed_slots_are_a_function_of_the_seed_even_in_lockstep():
    def stamps(seed):
        rig = Rig(seed=seed, exact_rates=False)
        rig.command(511, ATTITUDE_QUATERNION, 4000)
        rig.run(1.0)
        return [message.time_boot_ms for message in rig.messages("ATTITUDE_QUATERNION")]

    assert stamps(3) == stamps(3) != stamps(4)


@pytest.mark.parametrize(("asked", "got"), [(50, 50), (100, 100), (250, 250), (1000, 250)])
def test_lockstep_serves_every_slot(asked, got):
    rig = Rig()
    rig.command(511, ATTITUDE_QUATERNION, 1e6 / asked)
    assert achieved(rig, "ATTITUDE_QUATERNION", 2.0) == pytest.approx(got, abs=1)


def test_exact_rates_serve_every_slot_in_paced_time_too():
    rig = Rig(lockstep={"enabled": False}, exact_rates=True)
    rig.command(511, ATTITUDE_QUATERNION, 4000)
    assert achieved(rig, "ATTITUDE_QUATERNION", 1.0) == 250


def test_default_rates_are_those_measured():
    rig = Rig(lockstep={"enabled": False})
    start = rig.time
    rig.run(8.0)
    for name, hz in DEFAULTS.items():
        assert len(rig.messages(name, since=start + 1e-9)) / 8.0 == pytest.approx(hz, rel=0.05), (
            name
        )


def test_at_most_one_attitude_sample_a_step_with_the_steps_time():
    rig = Rig()
    rig.command(511, ATTITUDE_QUATERNION, 1000)
    start = rig.time
    rig.run(1.0)
    samples = [
        (at, m.time_boot_ms)
        for at, m in rig.received
        if m.get_type() == "ATTITUDE_QUATERNION" and at > start
    ]
    assert [round(at * 1000) for at, _ in samples] == [ms for _, ms in samples]
    assert len({ms for _, ms in samples}) == len(samples) == 250


def test_interval_zero_is_the_default_and_minus_one_stops():
    rig = Rig()
    for asked, got in ((4000, 250), (-1, 0), (0, 50)):
        assert rig.command(511, ATTITUDE_QUATERNION, asked) == ACCEPTED
        assert achieved(rig, "ATTITUDE_QUATERNION", 1.0) == pytest.approx(got, abs=1)
    assert rig.command(511, 12345, 1000) == ACCEPTED


def test_get_message_interval():
    rig = Rig()
    rig.command(511, ATTITUDE_QUATERNION, 5000)
    assert rig.command(510, ATTITUDE_QUATERNION) == ACCEPTED
    assert rig.messages("MESSAGE_INTERVAL")[-1].interval_us == 5000
    rig.command(510, 9999)
    assert rig.messages("MESSAGE_INTERVAL")[-1].interval_us == -1


def test_in_lockstep_the_companion_gets_no_streamed_system_time():
    rig = Rig()
    rig.run(3.0)
    assert rig.messages("SYSTEM_TIME") == []


def test_heartbeats_rate_cannot_be_changed():
    rig = Rig()
    for interval in (100_000, 0, -1):
        assert rig.command(511, 0, interval) == FAILED
        assert achieved(rig, "HEARTBEAT", 2.0) == 1


def test_current_mode_comes_twice_a_second_and_at_once_when_the_mode_changes():
    """Measured: asked for at 20 Hz, 2 Hz; a change of mode shows after 25 to 65 ms."""
    rig = Rig()
    rig.command(511, dialect.MAVLINK_MSG_ID_CURRENT_MODE, 50_000)
    assert achieved(rig, "CURRENT_MODE", 4.0) == pytest.approx(2.0, abs=0.3)
    for wait, main in ((0.11, 3), (0.37, 4), (0.27, 2)):
        rig.run(wait)
        commanded = rig.time
        assert rig.command(176, 1, main, 3 if main == 4 else 0) == ACCEPTED
        rig.run(0.065)
        assert rig.messages("CURRENT_MODE", since=commanded)[-1].custom_mode >> 16 & 0xFF == main
