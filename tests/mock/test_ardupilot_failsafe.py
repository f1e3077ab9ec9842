"""ArduCopter's failsafes: ground station by system id, battery, position; and the pilot."""

import pytest
from ardupilot_rig import FAILED, GUIDED, HOVER, LAND, LOITER, RTL, THRUST_AS_THRUST, ArduRig
from mock_rig import ACCEPTED
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.config.faults import fault_adapter
from sitl_mock.control_channel import truth
from sitl_mock.link.framing import Framer


def fault(rig, kind, **values):
    rig.simulation.faults.add(
        fault_adapter.validate_python({"kind": kind, **values}), rig.simulation.time_us
    )


def heartbeat_from(rig, system):
    mine, rig.framer = rig.framer, Framer(system, 190)
    rig.heartbeat()
    rig.framer = mine


def test_a_lost_ground_station_returns_after_5_s_though_setpoints_go_on():
    rig = ArduRig(parameters=THRUST_AS_THRUST)
    rig.lift(3.0)
    rig.simulation.parameters.set("FS_GCS_ENABLE", 1)
    rig.heartbeat()
    last = rig.time
    rig.each_tick = lambda: rig.rates(thrust=HOVER)
    rig.run(2.0)
    heartbeat_from(rig, 1)  # another system's, a companion's, is not what it waits for
    rig.run_until(lambda: rig.state.mode.name == "RTL", 5.0)
    assert rig.time - last == pytest.approx(5.0, abs=0.1)
    assert rig.texts()[-1] == "GCS Failsafe"
    rig.run(0.9)
    assert rig.state.mode.name == "RTL"
    rig.base_mode()
    assert rig.messages("HEARTBEAT")[-1].system_status == 5
    rig.heartbeat()
    rig.run(0.1)
    assert rig.texts()[-1] == "GCS Failsafe Cleared"
    assert (rig.state.mode.name, rig.state.failsafe) == ("RTL", False)


def test_what_else_a_lost_ground_station_may_do():
    rig = ArduRig(parameters={"FS_GCS_TIMEOUT": 1.0})
    rig.lift(3.0)
    for enable, mode in ((0, "GUIDED"), (5, "LAND"), (6, "RTL"), (7, "BRAKE")):
        rig.switch(GUIDED)
        rig.simulation.parameters.set("FS_GCS_ENABLE", enable)
        rig.heartbeat()
        rig.run(0.9)
        assert rig.state.mode.name == "GUIDED"
        rig.run(0.2)
        assert rig.state.mode.name == mode
        rig.heartbeat()
    # Another system id can be the ground station's, and a pilot flies on.
    rig.simulation.parameters.set("MAV_GCS_SYSID", 7)
    heartbeat_from(rig, 7)
    assert rig.switch(LOITER) == ACCEPTED
    rig.run(1.1)
    assert (rig.state.mode.name, rig.state.failsafe) == ("LOITER", True)
    assert rig.texts()[-1] == "GCS Failsafe"


def test_on_the_ground_a_failsafe_disarms():
    rig = ArduRig(parameters={"FS_GCS_ENABLE": 1, "FS_GCS_TIMEOUT": 1.0, "FS_OPTIONS": 0})
    rig.heartbeat()
    assert rig.arm() == ACCEPTED
    rig.run(1.2)
    assert not rig.state.armed
    assert rig.arm() == FAILED
    assert rig.texts()[-1] == "Arm: GCS failsafe on"


@pytest.mark.parametrize(("critical", "mode"), [(1, "LAND"), (7, "BRAKE")])
def test_a_low_battery_does_what_its_parameters_say(critical, mode):
    rig = ArduRig(parameters={"BATT_FS_LOW_ACT": 2})
    rig.lift(3.0)
    fault(rig, "low_battery", remaining=0.15)
    rig.run(0.2)
    assert (rig.state.mode.name, rig.state.failsafe) == ("GUIDED", False)  # 0 mAh: no limit
    rig.simulation.parameters.set("BATT_LOW_MAH", 660.0)
    rig.run(0.1)
    assert (rig.state.mode.name, rig.state.failsafe) == ("RTL", True)
    assert rig.texts()[-1].startswith("Battery 1 is low 12.60V used 28")
    rig.simulation.parameters.set("BATT_CRT_MAH", 330.0)
    rig.simulation.parameters.set("BATT_FS_CRT_ACT", critical)
    fault(rig, "low_battery", remaining=0.05)
    rig.run(0.2)
    assert rig.state.mode.name == mode
    assert rig.texts()[-1].startswith("Battery 1 is critical")


def test_the_charge_used_is_counted_by_vehicle_time_not_by_messages():
    """Asked for once after a flight, it is the charge that the battery has lost."""
    rig = ArduRig()
    rig.lift(3.0)
    rig.switch(LAND)
    rig.run_until(lambda: not rig.state.armed, 15.0)
    rig.run(1.0)  # the current is small again
    rig.command(dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_BATTERY_STATUS)
    rig.run(0.1)
    used_mah = 1000.0 * 3.3 * (1.0 - rig.simulation.vehicle.battery.remaining)
    assert used_mah > 10.0
    assert rig.messages("BATTERY_STATUS")[-1].current_consumed == pytest.approx(used_mah, abs=1.0)


def test_without_a_position_it_lands_and_refuses_the_modes_that_need_one():
    rig = ArduRig(parameters={"LAND_SPEED": 150.0})
    rig.lift(3.0)
    fault(rig, "gps_loss")
    rig.run(10.2)
    assert rig.state.mode.name == "LAND"
    assert rig.texts()[-1] == "EKF Failsafe: changed to LAND Mode"
    assert rig.switch(RTL) == FAILED
    assert rig.texts()[-1] == "Mode change to RTL failed: requires position"
    assert rig.base_mode() == 209
    rig.run_until(lambda: not rig.state.armed, 15.0)
    assert not rig.truth.crashed


def test_the_pilot_and_an_estimators_reset_by_the_faults_of_every_family():
    rig = ArduRig()
    rig.lift(4.0)
    fault(rig, "estimator_reset", yaw_deg=20.0, position_ned_m=[1.0, 0.0, 0.5])
    before = rig.truth
    rig.run(1.0)
    assert rig.truth.position_ned == pytest.approx(before.position_ned, abs=0.3)
    fault(rig, "pilot_takeover")
    rig.run(0.1)
    told = truth(rig.simulation)
    assert (told["mode"], told["aborted"]) == ("LOITER", False)
    rig.rates(thrust=HOVER)
    assert not rig.simulation.commander.obeys_setpoints


def test_return_climbs_flies_home_waits_and_lands():
    rig = ArduRig(parameters={"RTL_ALT": 500.0, "RTL_LOIT_TIME": 500, "LAND_SPEED": 150.0})
    rig.lift(3.0)
    rig.say(
        dialect.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, 1, 0b110111111000, 6.0, 0, -3.0, 0, 0, 0, 0, 0, 0, 0, 0
        )
    )
    rig.run_until(lambda: rig.truth.position_ned[0] > 5.0, 12.0)
    assert rig.command(dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH) == ACCEPTED
    highest = 0.0
    while rig.state.armed:
        rig.run(0.2)
        highest = max(highest, rig.height)
        assert rig.time < 60.0
    assert highest == pytest.approx(5.0, abs=0.5)
    assert rig.truth.position_ned[:2] == pytest.approx((0.0, 0.0), abs=0.7)
    assert not rig.truth.crashed
