"""Vehicles seeded with mistakes: each is found by its name; on a good one nothing is.

All of a family's are judged over one connection to one mock vehicle.
"""

import asyncio
from dataclasses import replace

import pytest

from companion.config.files import changed
from companion.preflight.all_checks import run_checks
from companion.preflight.parameter_survey import survey_parameters
from companion.preflight.session import gather
from companion.testing import open_wire, run
from companion.vehicle.parameter_rules import CheckResult
from tests.preflight.vehicles import FAMILIES, amiss, configured, met, shipped_in_memory

UNSAFE, INEFFECTIVE = CheckResult.UNSAFE, CheckResult.INEFFECTIVE
NOT_READY = CheckResult.NOT_READY
TO_US = {"direction": "to_companion"}

PARAMETERS = {
    "px4": [
        ("COM_OF_LOSS_T", 5.0, UNSAFE),
        ("COM_OF_LOSS_T", 0.25, UNSAFE),
        ("COM_OBL_RC_ACT", 7, UNSAFE),
        ("COM_RC_IN_MODE", 4, UNSAFE),
        ("MAN_OVERRIDE_SPD", -1.0, INEFFECTIVE),
        ("MAV_FWDEXTSP", 0, INEFFECTIVE),
        ("NAV_DLL_ACT", 5, UNSAFE),
        ("NAV_RCL_ACT", 6, UNSAFE),
        ("NAV_RCL_ACT", 7, INEFFECTIVE),
        ("COM_RCL_EXCEPT", 4, INEFFECTIVE),
        ("MPC_THR_HOVER", 0.2, INEFFECTIVE),
        ("MC_BAT_SCALE_EN", 1, INEFFECTIVE),
        ("COM_DISARM_PRFLT", -1.0, UNSAFE),
        ("MAV_SYS_ID", 7, INEFFECTIVE),
        ("MAV_SIGN_CFG", 1, INEFFECTIVE),
        ("IMU_INTEG_RATE", 100, INEFFECTIVE),
        ("GF_ACTION", 4, UNSAFE),
        ("COM_LOW_BAT_ACT", 0, INEFFECTIVE),
        ("CBRK_SUPPLY_CHK", 894281, INEFFECTIVE),
        ("FD_FAIL_R", 30, INEFFECTIVE),
    ],
    "ardupilot": [
        ("GUID_OPTIONS", 0, UNSAFE),
        ("ATC_ANGLE_BOOST", 1, UNSAFE),
        ("GUID_TIMEOUT", 3.0, UNSAFE),
        ("ATC_RATE_FF_ENAB", 0, INEFFECTIVE),
        ("ATC_INPUT_TC", 1.0, INEFFECTIVE),
        ("ATC_ACCEL_R_MAX", 50000.0, INEFFECTIVE),
        ("ATC_ACCEL_Y_MAX", 0.0, INEFFECTIVE),
        ("FS_GCS_ENABLE", 2, INEFFECTIVE),
        ("MAV_SYSID", 9, INEFFECTIVE),
        ("FS_THR_ENABLE", 0, UNSAFE),
        ("FS_OPTIONS", 20, INEFFECTIVE),
        ("MOT_THST_HOVER", 0.2, INEFFECTIVE),
        ("ARMING_SKIPCHK", 4, UNSAFE),
        ("DISARM_DELAY", 0, UNSAFE),
        ("SCHED_LOOP_RATE", 200, INEFFECTIVE),
        ("FS_EKF_ACTION", 0, UNSAFE),
        ("BATT_FS_LOW_ACT", 5, UNSAFE),
        ("BATT_FS_CRT_ACT", 5, UNSAFE),
    ],
}

OUR_OWN = {
    "px4": [
        ("deadman", {"silence_limit_ms": 1000.0}, "COM_OF_LOSS_T", UNSAFE),
        ("thrust", {"hover_thrust": 0.3}, "MPC_THR_HOVER", INEFFECTIVE),
        ("link", {"source_system": 245}, "MAV_SYS_ID", INEFFECTIVE),
        ("planner", {"name": "auto"}, "planner.name", INEFFECTIVE),
        ("flight", {"accept": ("COM_OF_LOST",)}, "flight.accept", INEFFECTIVE),
    ],
    "ardupilot": [
        ("thrust", {"autopilot_compensates_tilt": True}, "ATC_ANGLE_BOOST", UNSAFE),
        ("thrust", {"curve_factor": 0.4}, "MOT_THST_EXPO", INEFFECTIVE),
        ("thrust", {"battery_exponent": 2.0}, "MOT_BAT_VOLT_MAX", INEFFECTIVE),
        ("vehicle", {"acceleration_limit_deg_s2": None}, "ATC_ACCEL_P_MAX", INEFFECTIVE),
    ],
}

FAULTS = [
    ({"kind": "drop", "probability": 0.1, **TO_US}, "link.loss", INEFFECTIVE),
    ({"kind": "drop", "probability": 0.5, **TO_US}, "link.loss", UNSAFE),
    ({"kind": "corrupt", "probability": 0.1, **TO_US}, "link.damage", INEFFECTIVE),
    ({"kind": "duplicate", **TO_US}, "link.clock", UNSAFE),
    ({"kind": "duplicate", "probability": 0.05, **TO_US}, "link.clock", INEFFECTIVE),
    ({"kind": "freeze_clock"}, "link.clock", UNSAFE),
    (
        {"kind": "nan_field", "message": "ATTITUDE_QUATERNION", "field": "q1"},
        "link.not_finite",
        INEFFECTIVE,
    ),
    (
        {"kind": "stop_telemetry", "messages": ["ATTITUDE_TARGET"]},
        "link.streams.ATTITUDE_TARGET",
        INEFFECTIVE,
    ),
    (
        {"kind": "stop_telemetry", "messages": ["LOCAL_POSITION_NED"]},
        "link.min_position_rate_hz",
        UNSAFE,
    ),
    ({"kind": "refuse_arming", "reason": "no key"}, "vehicle.ready", NOT_READY),
    # The last one: the battery stays empty.
    ({"kind": "low_battery", "remaining": 0.1}, "vehicle.battery", UNSAFE),
]


@pytest.fixture(scope="module", params=FAMILIES)
def visit(request, tmp_path_factory):
    """What was found on the good vehicle, and after each seed: verdicts by key."""
    folder = tmp_path_factory.mktemp(request.param)
    with shipped_in_memory(request.param) as mock:
        return request.param, run(mock, _visit(folder, mock))


async def _visit(folder, mock):
    config = configured(folder, mock)
    async with met(config, open_wire) as vehicle:
        evidence = await vehicle.gather(10.0)
        found = {"good": amiss(run_checks(config, evidence))}
        link = vehicle.link
        for name, value, _ in PARAMETERS[mock.autopilot]:
            before = await link.read_parameter(name)
            await link.write_parameter(name, value)
            seeded = replace(
                evidence, survey=await survey_parameters(link, link.autopilot.parameters)
            )
            found[name, value] = amiss(run_checks(config, seeded))
            await link.write_parameter(name, before)
        found["lossy"] = await _on_a_lossy_link(mock, config, link, evidence)
        for section, keys, name, _ in OUR_OWN[mock.autopilot]:
            changes = {section: keys}
            if name == "planner.name":
                changes["vehicle"] = {"lag_ms": None}
            ours = changed(config, changes, "the seed")
            found[section, str(keys)] = amiss(run_checks(ours, evidence))
        for fault, _, _ in FAULTS:
            mock.inject(fault)
            # Not before what was known is replaced: the autopilot tells its checks at 5 Hz.
            await asyncio.sleep(0.25)
            spoilt = run_checks(
                config, await gather(link, evidence.streams, 0.7, prearm_checks=True)
            )
            found[str(fault)] = amiss(spoilt)
            mock.clear_faults()
            if fault["kind"] == "refuse_arming":
                found["words"] = " ".join(finding.sentence() for finding in spoilt)
            await asyncio.sleep(0.25)
        return found


async def _on_a_lossy_link(mock, config, link, evidence):
    """All unsafe values at once, where half of the frames are lost either way.

    Three questions of four get no answer, so that now and then a parameter gets none to all nine.
    """
    names = {
        name: value for name, value, verdict in PARAMETERS[mock.autopilot] if verdict is UNSAFE
    }
    before = {name: await link.read_parameter(name) for name in names}
    for name, value in names.items():
        await link.write_parameter(name, value)
    mock.inject({"kind": "drop", "probability": 0.5})
    await asyncio.sleep(0.25)
    seeded = replace(evidence, survey=await survey_parameters(link, link.autopilot.parameters))
    mock.clear_faults()
    await asyncio.sleep(0.25)
    for name, value in before.items():
        await link.write_parameter(name, value)
    return set(names), seeded.survey, amiss(run_checks(config, seeded))


def test_no_unsafe_value_is_lost_with_the_frames_of_a_lossy_link(visit):
    """Each is found, or that it was not told is."""
    _, found = visit
    names, read, verdicts = found["lossy"]
    assert read.link_loses_frames
    assert {name for name, verdict in verdicts.items() if verdict is UNSAFE} >= names


def test_the_shipped_vehicle_is_clean(visit):
    _, found = visit
    assert found["good"] == {}


def test_each_parameter_is_found_and_nothing_else(visit):
    family, found = visit
    for name, value, verdict in PARAMETERS[family]:
        assert found[name, value] == {name: verdict}


def test_each_mistake_of_our_own_is_found(visit):
    family, found = visit
    for section, keys, name, verdict in OUR_OWN[family]:
        assert found[section, str(keys)].get(name) is verdict, name


def test_each_fault_of_the_link_and_the_vehicle_is_found(visit):
    _, found = visit
    for fault, key, verdict in FAULTS:
        assert found[str(fault)].get(key) is verdict, (key, found[str(fault)])


def test_the_autopilots_own_words_on_why_it_does_not_arm_are_told(visit):
    family, found = visit
    if family == "ardupilot":  # PX4 gives texts to a ground station alone
        assert "the autopilot says: PreArm: no key" in found["words"]
    assert "it lacks the autopilot's pre-arm checks" in found["words"]
