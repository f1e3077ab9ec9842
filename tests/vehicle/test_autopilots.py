"""What each family says and means; numbers from the recordings of real autopilots."""

import math

import pytest

from companion.mavlink.commands import ARM, DISARM
from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.errors import UnsupportedAutopilot
from companion.mavlink.stats import LinkStats
from companion.vehicle.autopilot import ControlEntry, Readiness, Role
from companion.vehicle.registry import AUTOPILOTS, autopilot_for

QUADROTOR, HEXAROTOR, FIXED_WING = 2, 13, 1
PX4, ARDUPILOT = autopilot_for(12, QUADROTOR), autopilot_for(3, HEXAROTOR)
GOOD = Readiness(prearm_passed=True, estimator_flags=0x33F, has_position=True, has_home=True)
EVERY_AUTOPILOT = pytest.mark.parametrize(
    "autopilot", AUTOPILOTS, ids=lambda autopilot: autopilot.name
)


@pytest.mark.parametrize(
    ("autopilot", "base_mode", "custom_mode", "name", "roles"),
    [
        (PX4, 29, 0x03040000, "AUTO.LOITER", {Role.HOLD, Role.READY}),
        (PX4, 157, 0x02040000, "AUTO.TAKEOFF", {Role.TAKEOFF, Role.READY}),
        (PX4, 157, 0x05040000, "AUTO.RTL", set()),
        (PX4, 157, 0x06040000, "AUTO.LAND", {Role.LAND}),
        (PX4, 129, 0x00060000, "OFFBOARD", {Role.OFFBOARD}),
        (PX4, 129, 0x00630000, "mode 0x00630000", set()),
        (ARDUPILOT, 81, 0, "STABILIZE", set()),
        (ARDUPILOT, 89, 4, "GUIDED", {Role.TAKEOFF, Role.READY}),
        (ARDUPILOT, 81, 4, "GUIDED", {Role.TAKEOFF, Role.READY}),  # disarmed: it obeys nothing
        (ARDUPILOT, 217, 4, "GUIDED", {Role.TAKEOFF, Role.READY}),
        (ARDUPILOT, 209, 4, "GUIDED (body rates)", {Role.OFFBOARD}),
        (ARDUPILOT, 217, 17, "BRAKE", {Role.HOLD}),
        (ARDUPILOT, 209, 9, "LAND", {Role.LAND}),
        (ARDUPILOT, 217, 6, "RTL", set()),
        (ARDUPILOT, 209, 20, "GUIDED_NOGPS", set()),
        (ARDUPILOT, 209, 99, "mode 99", set()),
    ],
)
def test_what_a_heartbeat_means_to_a_flight(autopilot, base_mode, custom_mode, name, roles):
    assert autopilot.mode_name(base_mode, custom_mode) == name
    assert autopilot.roles(name) == roles


def test_px4_speaks_px4():
    assert PX4.set_mode("AUTO.LOITER")[:4] == PX4.hold()[:4] == (176, 1.0, 4.0, 3.0)
    assert PX4.control_entry is ControlEntry.BY_COMMAND
    assert PX4.set_mode(PX4.offboard_mode)[:4] == (176, 1.0, 6.0, 0.0)
    assert PX4.set_mode(PX4.ready_mode)[:3] == (176, 1.0, 4.0)
    assert (ARM[:3], DISARM[:2]) == ((400, 1.0, 0.0), (400, 0.0))
    # NaN: it keeps its heading, and takes off and lands where it is.
    here = [pytest.approx(math.nan, nan_ok=True)] * 3
    assert list(PX4.land()) == [21, 0.0, 0.0, 0.0, *here, 0.0]
    assert list(PX4.take_off(10.0, 489.4)) == [22, 0.0, 0.0, 0.0, *here, 499.4]


def test_ardupilot_speaks_as_recorded():
    """The commands of the recorded flight, whose ACKs were all 0; BRAKE it did not need."""
    assert ARDUPILOT.set_mode(ARDUPILOT.ready_mode)[:3] == (176, 1.0, 4.0)
    assert ARDUPILOT.take_off(10.0, 584.09) == (22, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 10.0)
    assert ARDUPILOT.control_entry is ControlEntry.BY_FIRST_SETPOINT
    assert ARDUPILOT.land()[:3] == (176, 1.0, 9.0)
    assert ARDUPILOT.hold()[:3] == (176, 1.0, 17.0)


@EVERY_AUTOPILOT
def test_a_family_is_complete(autopilot):
    for name, number in autopilot.modes.items():
        assert autopilot.mode_name(128 | 8, number) == name
    assert autopilot.ready_mode in autopilot.modes
    assert Role.READY in autopilot.roles(autopilot.ready_mode)
    with pytest.raises(KeyError):
        autopilot.set_mode("WARP")
    for name in autopilot.wanted_rates:
        MessageDispatcher(LinkStats()).subscribe(name, lambda _: None)
    assert {"ATTITUDE_QUATERNION", "LOCAL_POSITION_NED", "HOME_POSITION"} <= set(
        autopilot.wanted_rates
    )
    # What tells of a takeover sooner than a heartbeat at 1 Hz does.
    assert ("HEARTBEAT" in autopilot.wanted_rates) != ("CURRENT_MODE" in autopilot.wanted_rates)
    assert autopilot.offboard_loss_failsafe.parameter in {
        rule.name for rule in autopilot.parameters
    }


@pytest.mark.parametrize(
    ("autopilot", "status"), [(PX4, "ESTIMATOR_STATUS"), (ARDUPILOT, "EKF_STATUS_REPORT")]
)
def test_it_is_ready_only_when_nothing_is_missing(autopilot, status):
    assert autopilot.why_not_ready(GOOD) is None
    for missing, told in (
        ({"prearm_passed": False}, "the autopilot's pre-arm checks"),
        ({"prearm_passed": None}, "the autopilot's pre-arm checks"),
        ({"estimator_flags": None}, f"the estimator's status ({status})"),
        ({"estimator_flags": 0x33E}, f"the estimator ({status} flags 0x33e)"),
        ({"estimator_flags": 0x33D}, f"the estimator ({status} flags 0x33d)"),
        ({"has_position": False}, "a local position (LOCAL_POSITION_NED)"),
        ({"has_home": False}, "the home position (HOME_POSITION)"),
    ):
        assert autopilot.why_not_ready(GOOD._replace(**missing)) == told


def test_ardupilot_is_not_ready_with_a_position_it_only_assumes():
    """Before it uses GPS; the pre-arm checks of STABILIZE are good by then."""
    assert "0xa7" in ARDUPILOT.why_not_ready(GOOD._replace(estimator_flags=0xA7))
    assert "0x3bf" in ARDUPILOT.why_not_ready(GOOD._replace(estimator_flags=0x3BF))


def test_other_autopilots_and_vehicles_are_refused():
    with pytest.raises(UnsupportedAutopilot, match=r"PX4 \(12\) or ArduPilot \(3\)"):
        autopilot_for(9, QUADROTOR)
    with pytest.raises(UnsupportedAutopilot, match="no multirotor"):
        autopilot_for(3, FIXED_WING)
