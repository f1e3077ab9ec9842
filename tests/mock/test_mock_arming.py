"""Arming, its refusals, disarming, and the rules that disarm by themselves."""

import pytest
from mock_rig import ACCEPTED, TEMPORARILY_REJECTED, UNSUPPORTED, Rig
from pymavlink.dialects.v20 import development as dialect

ARM_DISARM = dialect.MAV_CMD_COMPONENT_ARM_DISARM


def test_arming_before_the_estimator_is_ready_is_refused_with_a_reason():
    rig = Rig(boot=False)
    rig.heartbeat()
    rig.run(4.0)
    assert rig.arm() == TEMPORARILY_REJECTED
    assert "Arming denied: Resolve system health failures first\t" in rig.texts()
    assert any("no heading reference" in text for text in rig.texts())
    assert rig.messages("HEARTBEAT")[-1].system_status == dialect.MAV_STATE_UNINIT
    rig.run(0.6)
    assert rig.arm() == ACCEPTED


@pytest.mark.parametrize(("delay", "ready"), [(4.5, 4.5), (6.0, 6.0)])
def test_standby_is_shown_when_prearm_is_good(delay, ready):
    rig = Rig(boot=False, prearm_delay_s=delay)
    rig.run(9.0)
    shown = [at for at, m in rig.received if m.get_type() == "HEARTBEAT" and m.system_status == 3]
    assert ready <= shown[0] <= ready + 1.1


def test_arm_then_auto_disarm_on_the_ground_after_11_s():
    rig = Rig()
    assert rig.arm() == ACCEPTED
    armed_at = rig.time
    rig.run_until(lambda: not rig.state.armed, 15.0)
    assert rig.time - armed_at == pytest.approx(11.0, abs=0.1)
    assert rig.texts()[-1] == "Disarmed by auto preflight disarming\t"


def test_disarm_in_the_air_is_refused_unless_forced():
    rig = Rig()
    rig.take_off()
    assert rig.command(ARM_DISARM, 0) == TEMPORARILY_REJECTED
    assert rig.state.armed
    assert rig.command(ARM_DISARM, 0, 21196) == ACCEPTED
    assert not rig.state.armed


def test_forced_arming_skips_the_checks():
    rig = Rig(boot=False)
    rig.run(1.0)
    assert rig.command(ARM_DISARM, 1) == TEMPORARILY_REJECTED
    assert rig.command(ARM_DISARM, 1, 21196) == ACCEPTED


@pytest.mark.parametrize("sub", [5, 6])
def test_return_and_land_do_not_arm(sub):
    rig = Rig()
    assert rig.mode(4, sub) == ACCEPTED
    assert rig.arm() == TEMPORARILY_REJECTED


def test_take_off_climbs_to_the_parameter_then_holds_and_land_disarms():
    rig = Rig(quick=False)
    rig.take_off(10.0)
    rig.run(5.0)
    assert -rig.truth.position_ned[2] == pytest.approx(10.0, abs=0.4)
    assert rig.state.intended_mode.name == "LOITER"
    rig.mode(4, 6)
    began = rig.time
    rig.run_until(lambda: rig.state.landed, 25.0)
    assert rig.time - began == pytest.approx(15.6, abs=2.5)  # recorded
    landed = rig.time
    rig.run_until(lambda: not rig.state.armed, 3.0)
    assert rig.time - landed == pytest.approx(2.0, abs=0.1)
    assert rig.truth.touchdown_speed < 0.8
    assert rig.texts()[-2:] == ["Landing detected\t", "Disarmed by landing\t"]
    rig.run(1.1)
    beat = rig.messages("HEARTBEAT")[-1]
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (29, 0x03040000, 3)


def test_landed_states_go_through_takeoff_air_landing_ground():
    rig = Rig()
    rig.take_off(3.0)
    rig.run(1.0)
    rig.mode(4, 6)
    rig.run_until(lambda: not rig.state.armed, 25.0)
    seen = [m.landed_state for m in rig.messages("EXTENDED_SYS_STATE")]
    order = [state for i, state in enumerate(seen) if i == 0 or state != seen[i - 1]]
    assert order == [1, 3, 2, 4, 1]


@pytest.mark.parametrize("command", [31000, 2500, 0, 65535])
def test_an_unknown_command_is_acknowledged_as_unsupported(command):
    rig = Rig(boot=False)
    assert rig.command(command) == UNSUPPORTED


def test_acknowledgement_goes_to_the_sender():
    rig = Rig(gcs=False)
    rig.arm()
    ack = rig.messages("COMMAND_ACK")[-1]
    assert (ack.target_system, ack.target_component) == (1, 191)


def test_texts_only_where_a_ground_station_listens():
    rig = Rig(gcs=False)
    rig.arm()
    rig.run(1.0)
    assert rig.messages("STATUSTEXT") == []


def test_take_off_command_takes_altitude_above_sea_level():
    rig = Rig()
    nan = float("nan")
    assert rig.arm() == ACCEPTED
    amsl = 489.4 + 4.0
    assert rig.command(dialect.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, nan, nan, nan, amsl) == ACCEPTED
    rig.run_until(lambda: rig.state.mode.name == "LOITER", 15.0)
    rig.run(3.0)
    assert -rig.truth.position_ned[2] == pytest.approx(4.0, abs=0.3)


def test_the_take_off_altitude_counts_at_arming():
    rig = Rig()
    assert rig.mode(4, 2) == ACCEPTED
    rig.simulation.parameters.set("MIS_TAKEOFF_ALT", 4.0)
    assert rig.arm() == ACCEPTED
    assert "Using default takeoff altitude: 4.0 m\t" in rig.texts()
    rig.run_until(lambda: rig.state.mode.name == "LOITER", 15.0)
    assert -rig.truth.position_ned[2] > 3.5


@pytest.mark.slow
def test_return_goes_home_and_lands():
    rig = Rig(home={"heading_deg": 40.0})
    rig.take_off(5.0)
    nan = float("nan")
    place = (47.3977433 + 30.0 / 111194.93, nan, nan)
    assert rig.command(dialect.MAV_CMD_DO_REPOSITION, -1, 1, 0, nan, *place) == ACCEPTED
    rig.run(1.0)
    assert rig.truth.position_ned[0] == pytest.approx(0.0, abs=1.0)  # no place without both
    rig.say(
        dialect.MAVLink_command_int_message(
            1, 1, 5, dialect.MAV_CMD_DO_REPOSITION, 0, 0, -1, 1, 0, nan,
            round(place[0] * 1e7), round(8.5455942e7), nan,
        )
    )  # fmt: skip
    rig.run(20.0)
    assert rig.truth.position_ned[0] == pytest.approx(30.0, abs=0.5)
    assert rig.command(dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH) == ACCEPTED
    rig.run_until(lambda: not rig.state.armed, 80.0)
    assert abs(rig.truth.position_ned[0]) < 1.5
