"""ArduCopter from power-up to a position estimate: what it says, refuses and keeps silent about."""

import pytest
from ardupilot_rig import FAILED, GUIDED, ArduRig
from mock_rig import ACCEPTED

PREARM_CHECK = 0x10000000
SAID = [
    (0.16, "RCInput: decoding UDP (Pulses)"), (0.28, "Calibrating barometer"),
    (1.87, "Barometer 1 calibration complete"), (1.87, "Barometer 2 calibration complete"),
    (2.40, "ArduPilot Ready"), (2.40, "AHRS: DCM active"), (2.70, "RC7: SaveWaypoint LOW"),
    (4.41, "EKF3 IMU0 initialised"), (4.41, "EKF3 IMU1 initialised"), (4.41, "AHRS: EKF3 active"),
    (5.75, "EKF3 IMU0 tilt alignment complete"), (5.75, "EKF3 IMU1 tilt alignment complete"),
    (5.85, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    (5.85, "EKF3 IMU1 MAG0 initial yaw alignment complete"),
    (9.76, "GPS 1: probing for u-blox at 230400 baud"), (9.78, "GPS 1: detected u-blox"),
    (19.97, "EKF3 IMU0 origin set"), (20.00, "Field Elevation Set: 489m"),
    (20.16, "EKF3 IMU1 origin set"), (41.57, "EKF3 IMU0 is using GPS"),
    (41.57, "EKF3 IMU1 is using GPS"),
]  # fmt: skip
"""Recorded; but for the field's elevation, which is the mock's."""


def armable(rig):
    rig.command(512, 1)
    return bool(rig.messages("SYS_STATUS")[-1].onboard_control_sensors_health & PREARM_CHECK)


def test_the_boot_as_recorded_with_what_is_refused_on_the_way():
    rig = ArduRig(boot=False)
    rig.heartbeat()
    rig.run(1.1)
    beat = rig.messages("HEARTBEAT")[-1]
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (89, 0, 1)
    assert rig.arm() == FAILED
    assert rig.texts()[-1] == "Arm: System not initialised"
    assert rig.switch(GUIDED) == ACCEPTED
    rig.run(1.9)
    beat = rig.messages("HEARTBEAT")[-1]
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (81, 0, 3)  # it was lost
    rig.run(16.5)
    assert not armable(rig)
    assert rig.messages("HOME_POSITION") == []
    rig.run(4.1)
    assert armable(rig)
    assert rig.switch(GUIDED) == ACCEPTED
    assert rig.base_mode() == 89
    assert not armable(rig)
    assert rig.arm() == FAILED
    assert rig.texts()[-1] == "Arm: Need Position Estimate"
    rig.run(41.4 - rig.time)
    rig.command(512, 193)
    assert rig.messages("EKF_STATUS_REPORT")[-1].flags != 0x33F
    rig.run(0.3)
    rig.command(512, 193)
    assert rig.messages("EKF_STATUS_REPORT")[-1].flags == 0x33F
    assert armable(rig)
    assert rig.arm() == ACCEPTED
    said = [(at, m.text) for at, m in rig.received if m.get_type() == "STATUSTEXT"]
    boot = [each for each in said if not each[1].startswith("Arm")]
    assert [text for _, text in boot] == [text for _, text in SAID]
    assert [at for at, _ in boot] == pytest.approx([at for at, _ in SAID], abs=0.11)
    assert said[-1][1] == "Arming motors"
    assert len(rig.messages("HOME_POSITION")) == len(rig.messages("GPS_GLOBAL_ORIGIN")) == 2


def test_a_link_on_which_nobody_spoke_hears_little_and_no_words():
    rig = ArduRig(boot=False, prearm_delay_s=4.0)
    rig.run(11.0)
    kinds = {message.get_type() for _, message in rig.received}
    assert kinds == {"HEARTBEAT", "TIMESYNC", "GPS_GLOBAL_ORIGIN", "HOME_POSITION"}
    assert len(rig.messages("HEARTBEAT")) == 11
    assert len(rig.messages("TIMESYNC")) == 1
    rig.command(511, 31, 10_000)
    assert rig.simulation.gcs.streams.interval(31) == -1  # asked on one link, for that one


def test_one_setting_shortens_the_whole_boot():
    rig = ArduRig(prearm_delay_s=1.0)
    assert rig.texts()[-2:] == ["EKF3 IMU0 is using GPS", "EKF3 IMU1 is using GPS"]
    assert rig.switch(GUIDED) == rig.arm() == ACCEPTED


def test_a_refusal_given_from_outside():
    rig = ArduRig(faults=[{"kind": "refuse_arming", "reason": "Hardware safety switch"}])
    assert rig.arm() == FAILED
    assert rig.texts()[-1] == "Arm: Hardware safety switch"
    assert rig.command(400, 1, 21196) == ACCEPTED  # by force


@pytest.mark.parametrize("mode", [6, 9, 17])
def test_no_arming_in_modes_that_only_end_a_flight(mode):
    rig = ArduRig()
    rig.switch(mode)
    assert rig.arm() == FAILED


def test_armed_and_left_standing_it_disarms_after_10_s():
    rig = ArduRig()
    assert rig.arm() == ACCEPTED
    rig.run(9.9)
    assert rig.state.armed
    rig.run(0.2)
    assert not rig.state.armed
    assert rig.texts()[-1] == "Disarming motors"
