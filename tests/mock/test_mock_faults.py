"""Faults: of the link as a pure pipe, of the vehicle on the bench, and their schedule."""

from math import isnan

import pytest
from mock_rig import ACCEPTED, TEMPORARILY_REJECTED, Rig
from pydantic import ValidationError

from sitl_mock.autopilot.faults import FaultSchedule
from sitl_mock.config.faults import fault_adapter
from sitl_mock.link.pipe import DatagramPipe

DATAGRAMS = [bytes([n, n, n]) for n in range(200)]


def fault(kind, **values):
    return fault_adapter.validate_python({"kind": kind, **values})


def passed(kind, *, seed=1, direction="to_companion", **values):
    pipe = DatagramPipe(direction, seed)
    faults = (fault(kind, **values),)
    return [pipe.push([datagram], faults, 4000 * n) for n, datagram in enumerate(DATAGRAMS)]


def flat(lists):
    return [datagram for each in lists for datagram in each]


def test_drop():
    out = flat(passed("drop", probability=0.25))
    assert 130 <= len(out) <= 170
    assert out == sorted(out)
    assert flat(passed("drop")) == []


def test_duplicate():
    assert flat(passed("duplicate")) == [d for d in DATAGRAMS for _ in range(2)]


def test_delay_keeps_the_order_and_the_time():
    out = passed("delay", delay_ms=20)
    assert out[4] == []
    assert out[5] == [DATAGRAMS[0]]
    assert flat(out) == DATAGRAMS[: len(flat(out))]


def test_reorder_swaps_neighbours_and_loses_none():
    out = flat(passed("reorder", probability=0.3))
    assert out != DATAGRAMS
    assert len(set(out)) >= len(DATAGRAMS) - 1
    assert all(abs(out.index(d) - n) <= 2 for n, d in enumerate(DATAGRAMS[:-2]) if d in out)


def test_corrupt_changes_one_byte():
    for before, after in zip(DATAGRAMS, flat(passed("corrupt")), strict=True):
        assert sum(a != b for a, b in zip(before, after, strict=True)) == 1


def test_direction_and_seed():
    assert flat(passed("drop", direction="from_companion", **{})) == []
    pipe = DatagramPipe("from_companion", 1)
    faults = (fault("drop", direction="to_companion"),)
    assert pipe.push(DATAGRAMS, faults, 0) == DATAGRAMS
    assert passed("drop", probability=0.5, seed=4) == passed("drop", probability=0.5, seed=4)
    assert passed("drop", probability=0.5, seed=4) != passed("drop", probability=0.5, seed=5)


def test_late_datagrams_still_come_out_when_the_fault_is_over():
    pipe = DatagramPipe("to_companion", 1)
    assert pipe.push([b"a"], (fault("delay", delay_ms=50),), 0) == []
    assert not pipe.passes_unchanged(())
    assert pipe.push([b"b"], (), 60_000) == [b"a", b"b"]
    assert pipe.passes_unchanged(())


def test_schedule_by_time_and_duration():
    schedule = FaultSchedule((fault("gps_loss", at_s=2.0, duration_s=1.0),))
    assert schedule.update(1_999_000, None) == ([], [])
    assert [f.kind for f in schedule.update(2_000_000, None)[0]] == ["gps_loss"]
    assert schedule.update(2_900_000, None) == ([], [])
    assert [f.kind for f in schedule.update(3_000_000, None)[1]] == ["gps_loss"]
    assert schedule.update(9_000_000, None) == ([], [])


def test_schedule_after_offboard_and_at_once():
    schedule = FaultSchedule((fault("drop", after_offboard_s=0.5),))
    schedule.update(9_000_000, None)
    assert schedule.link_faults == ()
    schedule.update(9_000_000, 8_600_000)
    assert schedule.link_faults == ()
    schedule.update(9_100_000, 8_600_000)
    assert len(schedule.link_faults) == 1
    schedule.add(fault("delay", duration_s=1.0), 9_100_000)
    schedule.update(9_104_000, 8_600_000)
    assert len(schedule.link_faults) == 2
    schedule.clear()
    assert schedule.link_faults == ()


@pytest.mark.parametrize(
    "bad",
    [
        {"kind": "dropp"},
        {"kind": "drop", "probability": 1.5},
        {"kind": "drop", "at_s": 1, "after_offboard_s": 1},
        {"kind": "nan_field", "message": "ATTITUDE", "field": "time_boot_ms"},
        {"kind": "stop_telemetry", "messages": ["ATTITUD"]},
        {"kind": "gps_loss", "at_s": -1},
    ],
)
def test_faults_that_cannot_be(bad):
    with pytest.raises(ValidationError):
        fault_adapter.validate_python(bad)


def strike(rig, kind, **values):
    rig.simulation.faults.add(fault(kind, **values), rig.simulation.time_us)
    rig.run(0.004)


def test_stop_all_telemetry_but_answers_still_come():
    rig = Rig()
    strike(rig, "stop_telemetry", duration_s=1.0)
    began = rig.time
    rig.run(0.9)
    assert [m for at, m in rig.received if at > began] == []
    assert rig.command(512, 148) == ACCEPTED
    rig.run(0.3)
    assert rig.messages("ATTITUDE", since=began)


def test_stop_one_message():
    rig = Rig()
    strike(rig, "stop_telemetry", messages=["ATTITUDE_QUATERNION"])
    began = rig.time + 0.001
    rig.run(0.5)
    assert rig.messages("ATTITUDE_QUATERNION", since=began) == []
    assert rig.messages("ATTITUDE", since=began)


def test_frozen_clock_shows_one_time_while_the_vehicle_lives():
    rig = Rig()
    strike(rig, "freeze_clock", duration_s=1.0)
    began = rig.time + 0.001
    rig.run(0.9)
    shown = {m.time_boot_ms for m in rig.messages("ATTITUDE", since=began)}
    assert len(shown) == 1
    assert rig.time > began + 0.8
    rig.run(0.5)
    assert len({m.time_boot_ms for m in rig.messages("ATTITUDE", since=began)}) > 20


@pytest.mark.parametrize(
    ("message", "field"), [("ATTITUDE_QUATERNION", "q2"), ("ODOMETRY", "q"), ("ATTITUDE", "roll")]
)
def test_nan_in_a_field(message, field):
    rig = Rig()
    strike(rig, "nan_field", message=message, field=field, duration_s=0.5)
    began = rig.time + 0.001
    rig.run(0.4)
    value = getattr(rig.messages(message, since=began)[-1], field)
    assert all(map(isnan, value)) if isinstance(value, list) else isnan(value)
    rig.run(0.5)
    value = getattr(rig.messages(message)[-1], field)
    assert not (all(map(isnan, value)) if isinstance(value, list) else isnan(value))


@pytest.mark.parametrize("mode", ["POSCTL", "ALTCTL", "STABILIZED"])
def test_the_pilot_takes_over_and_setpoints_do_not_bring_offboard_back(mode):
    rig = Rig()
    rig.fly_offboard(height=8.0, pitch=-0.1)
    rig.run(0.5)
    strike(rig, "pilot_takeover", mode=mode)
    rig.run(3.0)
    assert rig.state.mode.name == mode
    assert rig.messages("HEARTBEAT")[-1].base_mode == 209
    assert -rig.truth.position_ned[2] == pytest.approx(8.0, abs=1.5)
    assert "Pilot took over using sticks\t" in rig.texts()


def test_when_the_pilots_sticks_are_gone_it_returns():
    rig = Rig()
    rig.fly_offboard()
    strike(rig, "pilot_takeover", mode="ALTCTL", duration_s=1.0)
    rig.run(1.2)
    assert rig.state.mode.name == "LOITER"
    rig.run(5.0)
    assert rig.state.mode.name == "RTL"
    assert rig.state.failsafe


def test_an_estimator_reset_does_not_move_a_holding_vehicle():
    rig = Rig()
    rig.take_off()
    rig.run(2.0)
    before = rig.truth
    strike(rig, "estimator_reset", yaw_deg=15.0, position_ned_m=[2.0, 3.0, -1.0])
    rig.run(3.0)
    assert rig.truth.position_ned == pytest.approx(before.position_ned, abs=0.2)
    assert rig.truth.q == pytest.approx(before.q, abs=0.02)


def test_estimator_reset_jumps_and_counts():
    rig = Rig()
    before = rig.messages("ODOMETRY")[-1]
    strike(rig, "estimator_reset", yaw_deg=20.0, position_ned_m=[1.0, -2.0, 0.0])
    rig.run(0.1)
    after = rig.messages("ODOMETRY")[-1]
    assert after.reset_counter == before.reset_counter + 1
    assert (after.x - before.x, after.y - before.y) == pytest.approx((1.0, -2.0), abs=0.1)
    assert rig.messages("ATTITUDE")[-1].yaw == pytest.approx(0.349, abs=0.01)
    assert rig.truth.position_ned == (0.0, 0.0, 0.0)


def test_refuse_arming_with_a_reason():
    rig = Rig()
    strike(rig, "refuse_arming", reason="magnetometer sulks", duration_s=1.0)
    assert rig.arm() == TEMPORARILY_REJECTED
    assert "Preflight Fail: magnetometer sulks" in rig.texts()
    rig.run(1.1)
    assert rig.arm() == ACCEPTED


def test_low_battery_fault():
    rig = Rig()
    strike(rig, "low_battery", remaining=0.1)
    rig.run(0.3)
    assert rig.messages("SYS_STATUS")[-1].battery_remaining == 10
    assert any("Low battery" in text for text in rig.texts())


def test_clear_undoes_what_can_be_undone():
    rig = Rig()
    for kind in ("freeze_clock", "gps_loss", "refuse_arming", "stop_telemetry"):
        strike(rig, kind)
    rig.simulation.clear_faults()
    rig.run(1.0)
    assert rig.state.gps_ok
    assert rig.state.stamp_us == rig.state.time_us
    assert rig.arm() == ACCEPTED


def test_after_offboard_begins_with_the_first_armed_offboard():
    rig = Rig(faults=[{"kind": "gps_loss", "after_offboard_s": 1.0}])
    rig.fly_offboard()
    rig.run(0.9)
    assert rig.state.gps_ok
    rig.run(0.2)
    assert not rig.state.gps_ok


def test_a_clock_that_slips_loses_its_time_once():
    rig = Rig()
    rig.simulation.faults.add(
        fault("slip_clock", slip_ms=14.0, duration_s=1.0), rig.simulation.time_us
    )
    rig.run(0.1)
    assert rig.simulation.effects.take_clock_slip() == pytest.approx(0.014)
    rig.run(2.0)
    assert rig.simulation.effects.take_clock_slip() == 0.0
