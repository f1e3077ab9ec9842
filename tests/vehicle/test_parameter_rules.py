"""What each family's rules find: nothing on a good vehicle, and each mistake by itself."""

from math import degrees, inf, nan, radians

import pytest

from companion.vehicle.ardupilot.parameters import ARDUPILOT_PARAMETERS
from companion.vehicle.parameter_rules import CheckResult, CompanionSettings, apply_rules
from companion.vehicle.px4.parameters import PX4_PARAMETERS
from companion.vehicle.registry import AUTOPILOTS

UNSAFE, INEFFECTIVE = CheckResult.UNSAFE, CheckResult.INEFFECTIVE
PX4_SETUP = CompanionSettings(
    source_system=1,
    attitude_rate_hz=250.0,
    silence_limit=0.5,
    hover_thrust=0.49,
    curve_factor=0.0,
    battery_exponent=2.0,
    autopilot_compensates_tilt=False,
    acceleration_limits={"roll": None, "pitch": None, "yaw": None},
    max_tilt=radians(35.0),
    signing=False,
)
ARDUPILOT_SETUP = PX4_SETUP._replace(
    hover_thrust=0.364,
    acceleration_limits={"roll": radians(1100.0), "pitch": radians(1100.0), "yaw": radians(270.0)},
)
# As recorded on the ground, but for the battery's action and what that vehicle did not tell.
GOOD_PX4 = {
    "COM_OF_LOSS_T": 1.0,
    "COM_OBL_RC_ACT": 0.0,
    "COM_RC_OVERRIDE": 3.0,
    "COM_RC_STICK_OV": 30.0,
    "MAN_OVERRIDE_SPD": 1.0,
    "COM_RC_IN_MODE": 1.0,
    "MAV_FWDEXTSP": 1.0,
    "NAV_DLL_ACT": 0.0,
    "NAV_RCL_ACT": 2.0,
    "COM_RCL_EXCEPT": 0.0,
    "MPC_THR_HOVER": 0.5,
    "THR_MDL_FAC": 0.0,
    "MC_BAT_SCALE_EN": 0.0,
    "COM_DISARM_PRFLT": 10.0,
    "MAV_SYS_ID": 1.0,
    "MAV_SIGN_CFG": 0.0,
    "IMU_INTEG_RATE": 250.0,
    "GF_ACTION": 2.0,
    "COM_LOW_BAT_ACT": 3.0,
    "CBRK_SUPPLY_CHK": 0.0,
    "CBRK_FLIGHTTERM": 121212.0,
    "FD_FAIL_R": 60.0,
    "FD_FAIL_P": 60.0,
}
GOOD_ARDUPILOT = {
    "GUID_OPTIONS": 8.0,
    "ATC_ANGLE_BOOST": 0.0,
    "GUID_TIMEOUT": 1.0,
    "ATC_RATE_FF_ENAB": 1.0,
    "ATC_INPUT_TC": 0.15,
    "ATC_ACC_R_MAX": 1100.0,
    "ATC_ACC_P_MAX": 1100.0,
    "ATC_ACC_Y_MAX": 270.0,
    "ATC_ACCEL_R_MAX": 110000.0,
    "ATC_ACCEL_P_MAX": 110000.0,
    "ATC_ACCEL_Y_MAX": 27000.0,
    "FS_GCS_ENABLE": 0.0,
    "MAV_GCS_SYSID": 255.0,
    "MAV_SYSID": 1.0,
    "FS_THR_ENABLE": 1.0,
    "FS_OPTIONS": 16.0,
    "FLTMODE_GCSBLOCK": 1.0,
    "MOT_THST_HOVER": 0.39,
    "MOT_THST_EXPO": 0.65,
    "MOT_BAT_VOLT_MAX": 0.0,
    "ARMING_SKIPCHK": 0.0,
    "ARMING_CHECK": 1.0,
    "DISARM_DELAY": 10.0,
    "SCHED_LOOP_RATE": 400.0,
    "FS_EKF_ACTION": 1.0,
    "FENCE_ACTION": 1.0,
    "FENCE_ENABLE": 0.0,
    "BATT_FS_LOW_ACT": 2.0,
    "BATT_FS_CRT_ACT": 1.0,
}
PX4 = (PX4_PARAMETERS, GOOD_PX4, PX4_SETUP)
ARDUPILOT = (ARDUPILOT_PARAMETERS, GOOD_ARDUPILOT, ARDUPILOT_SETUP)


def complaints(autopilot, changes=None, **setup):
    """What is found amiss after `changes` of a good vehicle's values, and of our setup."""
    rules, good, ours = autopilot
    findings = apply_rules(rules, good | (changes or {}), ours._replace(**setup))
    return [finding for finding in findings if finding.result is not CheckResult.SAFE]


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT], ids=["px4", "ardupilot"])
def test_a_good_vehicle_is_found_good_by_every_rule(autopilot):
    rules, good, ours = autopilot
    findings = apply_rules(rules, good, ours)
    assert [finding.rule.name for finding in findings] == [rule.name for rule in rules]
    assert {finding.result for finding in findings} == {CheckResult.SAFE}


MISTAKES = [
    (PX4, {"COM_OF_LOSS_T": 5.0}, UNSAFE, 0.75),
    (PX4, {"COM_OF_LOSS_T": 0.3}, UNSAFE, 0.75),
    (PX4, {"COM_OBL_RC_ACT": 7.0}, UNSAFE, 5.0),
    (PX4, {"COM_RC_OVERRIDE": 1.0}, INEFFECTIVE, 3.0),
    (PX4, {"COM_RC_STICK_OV": 80.0}, INEFFECTIVE, 30.0),
    (PX4, {"MAN_OVERRIDE_SPD": -1.0}, INEFFECTIVE, 1.0),
    (PX4, {"COM_RC_IN_MODE": 4.0}, UNSAFE, 0.0),
    (PX4, {"MAV_FWDEXTSP": 0.0}, INEFFECTIVE, 1.0),
    (PX4, {"NAV_DLL_ACT": 5.0}, UNSAFE, 2.0),
    (PX4, {"NAV_RCL_ACT": 6.0}, UNSAFE, 2.0),
    (PX4, {"NAV_RCL_ACT": 7.0}, INEFFECTIVE, 2.0),
    (PX4, {"NAV_RCL_ACT": 0.0}, INEFFECTIVE, 2.0),
    (PX4, {"COM_RCL_EXCEPT": 5.0}, INEFFECTIVE, 1.0),
    (PX4, {"MPC_THR_HOVER": 0.25}, INEFFECTIVE, None),
    (PX4, {"MC_BAT_SCALE_EN": 1.0}, INEFFECTIVE, None),
    (PX4, {"MAV_SIGN_CFG": 1.0}, INEFFECTIVE, None),
    (PX4, {"COM_DISARM_PRFLT": 0.0}, UNSAFE, 10.0),
    (PX4, {"MAV_SYS_ID": 7.0}, INEFFECTIVE, None),
    (PX4, {"IMU_INTEG_RATE": 200.0}, INEFFECTIVE, 250.0),
    (PX4, {"GF_ACTION": 4.0}, UNSAFE, 2.0),
    (PX4, {"COM_LOW_BAT_ACT": 0.0}, INEFFECTIVE, 3.0),
    (PX4, {"COM_LOW_BAT_ACT": 4.0}, UNSAFE, 3.0),
    (PX4, {"CBRK_SUPPLY_CHK": 894281.0}, INEFFECTIVE, 0.0),
    (PX4, {"CBRK_FLIGHTTERM": 0.0, "FD_FAIL_P": 45.0}, UNSAFE, None),
    (PX4, {"FD_FAIL_R": 30.0}, INEFFECTIVE, 60.0),
    (ARDUPILOT, {"GUID_OPTIONS": 5.0}, UNSAFE, 13.0),
    (ARDUPILOT, {"ATC_ANGLE_BOOST": 1.0}, UNSAFE, 0.0),
    (ARDUPILOT, {"GUID_TIMEOUT": 3.0}, UNSAFE, 0.75),
    (ARDUPILOT, {"ATC_RATE_FF_ENAB": 0.0}, INEFFECTIVE, 1.0),
    (ARDUPILOT, {"ATC_INPUT_TC": 1.0}, INEFFECTIVE, 0.15),
    (ARDUPILOT, {"ATC_ACC_P_MAX": 500.0}, INEFFECTIVE, None),
    (ARDUPILOT, {"ATC_ACC_R_MAX": 0.0}, INEFFECTIVE, None),
    (ARDUPILOT, {"ATC_ACCEL_Y_MAX": 54000.0}, INEFFECTIVE, None),
    (ARDUPILOT, {"FS_GCS_ENABLE": 1.0, "MAV_GCS_SYSID": 1.0}, INEFFECTIVE, 255.0),
    (ARDUPILOT, {"FS_GCS_ENABLE": 2.0}, INEFFECTIVE, 1.0),
    (ARDUPILOT, {"FS_THR_ENABLE": 0.0}, UNSAFE, 1.0),
    (ARDUPILOT, {"FS_OPTIONS": 20.0}, INEFFECTIVE, 16.0),
    (ARDUPILOT, {"FLTMODE_GCSBLOCK": 4097.0}, INEFFECTIVE, 1.0),
    (ARDUPILOT, {"MOT_THST_HOVER": 0.2}, INEFFECTIVE, None),
    (ARDUPILOT, {"MOT_BAT_VOLT_MAX": 12.8}, INEFFECTIVE, None),
    (ARDUPILOT, {"ARMING_SKIPCHK": 4.0}, UNSAFE, 0.0),
    (ARDUPILOT, {"ARMING_CHECK": 0.0}, UNSAFE, 1.0),
    (ARDUPILOT, {"DISARM_DELAY": 0.0}, UNSAFE, 10.0),
    (ARDUPILOT, {"SCHED_LOOP_RATE": 200.0}, INEFFECTIVE, None),
    (ARDUPILOT, {"FS_EKF_ACTION": 2.0}, UNSAFE, 1.0),
    (ARDUPILOT, {"FENCE_ENABLE": 1.0, "FENCE_ACTION": 0.0}, INEFFECTIVE, 1.0),
    (ARDUPILOT, {"BATT_FS_LOW_ACT": 5.0}, UNSAFE, 2.0),
    (ARDUPILOT, {"BATT_FS_LOW_ACT": 0.0, "BATT_FS_CRT_ACT": 0.0}, INEFFECTIVE, 1.0),
    (ARDUPILOT, {"BATT_FS_CRT_ACT": 5.0}, UNSAFE, 1.0),
]


@pytest.mark.parametrize(("autopilot", "changes", "verdict", "set_to"), MISTAKES)
def test_each_mistake_is_found_by_itself_and_mended_by_what_is_proposed(
    autopilot, changes, verdict, set_to
):
    (found,) = complaints(autopilot, changes)
    assert found.rule.name in changes
    assert (found.result, found.set_to, found.value) == (verdict, set_to, changes[found.rule.name])
    assert found.consequence
    if set_to is not None:
        assert not complaints(autopilot, changes | {found.rule.name: set_to})


@pytest.mark.parametrize(
    ("autopilot", "setup", "name"),
    [
        (PX4, {"silence_limit": 1.0}, "COM_OF_LOSS_T"),
        (PX4, {"curve_factor": 0.4}, None),  # PX4 does not make up for the curve, so we may
        (ARDUPILOT, {"curve_factor": 0.4}, "MOT_THST_EXPO"),
        (PX4, {"source_system": 245}, "MAV_SYS_ID"),
        (PX4, {"attitude_rate_hz": 400.0}, "IMU_INTEG_RATE"),
        (ARDUPILOT, {"attitude_rate_hz": 500.0}, "SCHED_LOOP_RATE"),
        (ARDUPILOT, {"autopilot_compensates_tilt": True}, "ATC_ANGLE_BOOST"),
    ],
)
def test_our_own_configuration_counts_too(autopilot, setup, name):
    assert [found.rule.name for found in complaints(autopilot, **setup)] == [name] * (
        name is not None
    )


def test_no_loss_of_a_station_matters_where_another_is_watched():
    assert not complaints(ARDUPILOT, {"FS_THR_ENABLE": 0.0, "FS_GCS_ENABLE": 1.0})


def test_what_the_autopilot_has_not_is_left_out():
    assert apply_rules(PX4_PARAMETERS, {}, PX4_SETUP) == []
    (only,) = apply_rules(PX4_PARAMETERS, {"COM_OF_LOSS_T": 1.0}, PX4_SETUP)
    assert only.rule.name == "COM_OF_LOSS_T"


@pytest.mark.parametrize("value", [nan, inf, -inf])
@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT], ids=["px4", "ardupilot"])
def test_what_is_no_number_is_unsafe_whatever_the_rule(autopilot, value):
    for rule in autopilot[0]:
        (found,) = (f for f in complaints(autopilot, {rule.name: value}) if f.rule is rule)
        assert (found.result, found.set_to) == (UNSAFE, None)
        assert found.consequence


def test_what_is_no_number_tells_other_rules_nothing():
    """NaN is true to Python: as a failsafe's setting it must not pass for one that is on."""
    changes = {"FS_THR_ENABLE": 0.0, "FS_GCS_ENABLE": nan}
    assert {f.rule.name for f in complaints(ARDUPILOT, changes)} == set(changes)


@pytest.mark.parametrize("unread", [{"FD_FAIL_R"}, {"FD_FAIL_P"}, {"FD_FAIL_R", "FD_FAIL_P"}])
@pytest.mark.parametrize(("termination", "verdict"), [(0.0, UNSAFE), (121212.0, CheckResult.SAFE)])
def test_motors_that_may_stop_at_a_tilt_that_was_not_told_are_not_safe(
    unread, termination, verdict
):
    values = {name: v for name, v in GOOD_PX4.items() if name not in unread}
    findings = apply_rules(PX4_PARAMETERS, values | {"CBRK_FLIGHTTERM": termination}, PX4_SETUP)
    (found,) = (finding for finding in findings if finding.rule.name == "CBRK_FLIGHTTERM")
    assert found.result is verdict


@pytest.mark.parametrize(
    ("roll", "pitch", "verdict"),
    [
        (0.0, 0.0, CheckResult.SAFE),  # the failure detector is off
        (0.0, 15.1, CheckResult.SAFE),
        (15.1, 15.1, CheckResult.SAFE),
        (15.1, 14.9, UNSAFE),
        (14.9, 0.0, UNSAFE),
    ],
)
def test_motors_may_stop_only_15_degrees_beyond_the_largest_tilt(roll, pitch, verdict):
    """Each angle is that beyond the largest tilt; 0 switches it off."""
    tilt = degrees(PX4_SETUP.max_tilt)
    angles = [angle and tilt + angle for angle in (roll, pitch)]
    changes = {"CBRK_FLIGHTTERM": 0.0, "FD_FAIL_R": angles[0], "FD_FAIL_P": angles[1]}
    findings = apply_rules(PX4_PARAMETERS, GOOD_PX4 | changes, PX4_SETUP)
    (found,) = (finding for finding in findings if finding.rule.name == "CBRK_FLIGHTTERM")
    assert found.result is verdict


def test_every_rule_that_can_be_unsafe_is_missed_where_it_is_not_told():
    for rules, *_ in (PX4, ARDUPILOT):
        marked = {rule.name for rule in rules if rule.vital or rule.in_all_versions}
        replaced = {rule.alternative for rule in rules if rule.alternative}
        unsafe = {
            next(iter(changes))
            for of, changes, verdict, _ in MISTAKES
            if of[0] is rules and verdict is UNSAFE
        }
        assert marked | replaced == unsafe


def test_names_fit_the_protocol_and_none_is_ruled_twice():
    for autopilot in AUTOPILOTS:
        names = [name for rule in autopilot.parameters for name in rule.names]
        assert len(set(names)) == len(names)
        assert all(len(name) <= 16 for name in names)
        assert all(rule.meaning and rule.source for rule in autopilot.parameters)
