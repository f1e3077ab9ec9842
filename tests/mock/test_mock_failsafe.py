"""Lost companion, lost ground station, low battery, lost position."""

import pytest
from mock_rig import ACCEPTED, TEMPORARILY_REJECTED, Rig
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.config.faults import fault_adapter


def test_a_lost_companion_is_told_after_6_5_s_and_nothing_else():
    rig = Rig()
    rig.take_off(3.0)
    rig.say(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    last = rig.time
    lost = "Connection to mission computer lost\t"
    rig.run_until(lambda: lost in rig.texts(), 10.0)
    assert rig.time - last == pytest.approx(6.5, abs=0.1)
    assert rig.state.mode.name == "LOITER"
    rig.say(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    rig.run(0.1)
    assert rig.texts()[-1] == "Onboard controller regained\t"


def test_a_lost_ground_station_returns_though_setpoints_go_on():
    rig = Rig(parameters={"NAV_DLL_ACT": 2})
    rig.heartbeat()
    rig.fly_offboard(height=3.0)
    rig.heartbeat()
    last = rig.time
    rig.run_until(lambda: rig.state.mode.name == "LOITER", 15.0)
    assert rig.time - last == pytest.approx(12.0, abs=0.1)
    rig.run_until(lambda: rig.state.mode.name == "RTL", 8.0)
    assert rig.time - last == pytest.approx(17.0, abs=0.1)
    assert rig.state.failsafe
    rig.each_tick = None


def test_by_default_a_lost_ground_station_changes_nothing():
    rig = Rig()
    rig.fly_offboard(height=3.0)
    rig.run(20.0)
    assert rig.state.mode.name == "OFFBOARD"


def test_with_an_action_arming_needs_a_ground_station():
    rig = Rig(gcs=False, parameters={"NAV_DLL_ACT": 2})
    assert rig.arm() == TEMPORARILY_REJECTED


@pytest.mark.parametrize(
    ("action", "remaining", "mode"),
    [(0, 0.06, "LOITER"), (2, 0.06, "LAND"), (3, 0.06, "RTL"), (3, 0.04, "LAND")],
)
def test_low_battery(action, remaining, mode):
    rig = Rig(parameters={"COM_LOW_BAT_ACT": action})
    rig.take_off()
    rig.simulation.vehicle.set_battery_remaining(remaining)
    rig.run(0.2)
    assert rig.state.mode.name == mode
    assert rig.state.failsafe == (mode != "LOITER")
    rig.run(2.5)
    assert rig.messages("BATTERY_STATUS")[-1].charge_state == (3 if remaining > 0.05 else 4)


def test_an_empty_battery_forbids_arming():
    rig = Rig(battery={"initial_remaining": 0.04})
    assert rig.arm() == TEMPORARILY_REJECTED
    assert any("battery" in text for text in rig.texts())


def test_lost_position_lands_where_it_is_needed():
    rig = Rig(parameters={"EKF2_NOAID_TOUT": 1_000_000})
    rig.take_off()
    rig.simulation.faults.add(fault("gps_loss"), rig.simulation.time_us)
    rig.run(0.9)
    assert rig.state.mode.name == "LOITER"
    rig.run(0.3)
    assert rig.state.mode.name == "LAND"
    assert rig.messages("GPS_RAW_INT")[-1].fix_type == 0
    assert rig.mode(4, 3) == TEMPORARILY_REJECTED
    rig.run_until(lambda: not rig.state.armed, 30.0)
    assert not rig.truth.crashed


def test_a_failsafe_is_told_of_once():
    rig = Rig(parameters={"EKF2_NOAID_TOUT": 100_000})
    assert rig.arm() == ACCEPTED
    rig.simulation.faults.add(fault("gps_loss"), rig.simulation.time_us)
    rig.run(2.0)
    assert rig.texts().count("Failsafe activated\t") == 1


def test_offboard_by_rates_needs_no_position():
    rig = Rig(parameters={"EKF2_NOAID_TOUT": 1_000_000})
    rig.fly_offboard()
    rig.simulation.faults.add(fault("gps_loss"), rig.simulation.time_us)
    rig.run(2.0)
    assert rig.state.mode.name == "OFFBOARD"


def test_piloted_modes_need_a_pilot_in_the_air():
    rig = Rig()
    rig.take_off()
    assert rig.mode(3) == TEMPORARILY_REJECTED
    assert rig.mode(99) == TEMPORARILY_REJECTED
    assert rig.mode(4, 3) == ACCEPTED


def fault(kind, **values):
    return fault_adapter.validate_python({"kind": kind, **values})
