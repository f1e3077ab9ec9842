"""Each check by itself, on evidence made up: what it finds, and where it begins to."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from companion.config import Config
from companion.config.files import changed
from companion.preflight import (
    clock_checks,
    configuration_checks,
    link_checks,
    stream_checks,
    vehicle_checks,
)
from companion.preflight.all_checks import blocking_findings, overall_result, run_checks
from companion.preflight.evidence import Evidence, Identity, LinkQuality, OtherNodes, SampleTimes
from companion.preflight.finding import Key
from companion.preflight.parameter_survey import Survey
from companion.preflight.parameters import parameters
from companion.vehicle.autopilot import Readiness
from companion.vehicle.parameter_rules import CheckResult
from companion.vehicle.records import Battery, GlobalPosition, Gps
from companion.vehicle.registry import autopilot_for
from companion.vehicle.streams import StreamRate
from tests.preflight.vehicles import amiss

SAFE, UNSAFE, INEFFECTIVE = CheckResult.SAFE, CheckResult.UNSAFE, CheckResult.INEFFECTIVE
NOT_READY = CheckResult.NOT_READY
PX4, ARDUPILOT = autopilot_for(12, 2), autopilot_for(3, 2)
QUALITY = LinkQuality(1000, 0, 0, 0, 0, 0.004, 0.001)
READY = Readiness(prearm_passed=True, estimator_flags=0x3FF, has_position=True, has_home=True)
ATTITUDE_TARGET_CAPABILITY = 64


def state(**changes):
    """As much of a VehicleState as the checks look at."""
    told = {
        "armed": False,
        "failsafe": False,
        "battery": Battery(0.0, 16.0, 0.9),
        "battery_silent": False,
        "global_position": GlobalPosition(0.0, 47.0, 8.0),
        "readiness": READY,
        "estimator": SimpleNamespace(flags=0x3FF),
        "gps": None,
        "gps_fault": None,
        "landed": True,
        "flying": False,
        "height": 0.1,
    }
    return SimpleNamespace(**told | changes)


GOOD = Evidence(
    autopilot=PX4,
    state=state(),
    survey=Survey({"COM_OF_LOSS_T": 1.0}, {"COM_OF_LOSS_T": "COM_OF_LOSS_T"}),
    streams={
        "ATTITUDE_QUATERNION": StreamRate(250.0, 250.0, 197.0),
        "LOCAL_POSITION_NED": StreamRate(50.0, 50.0, 50.0),
        "HOME_POSITION": StreamRate(1.0, 1.0, 0.0),
    },
    received_counts={"ATTITUDE_QUATERNION": 900, "LOCAL_POSITION_NED": 200, "HOME_POSITION": 1},
    counting_time=1.0,
    link=QUALITY,
    samples=SampleTimes(200, 0.006, 0, 1.0001),
    other_nodes=OtherNodes(),
    reset_count=0,
    identity=Identity("1.18.0", ATTITUDE_TARGET_CAPABILITY, "00ab"),
)
TIMES = {"lag_ms": 47.0, "dead_time_ms": 40.0, "identified": "a flight"}
CONFIG = changed(Config(), {"vehicle": TIMES}, "test")


def found(check, evidence=GOOD, config=CONFIG):
    return amiss(check(config, evidence))


def test_nothing_is_amiss_with_good_evidence():
    """PX4's 197 Hz of 250 asked and a message of 1 Hz that did not come this second included."""
    assert amiss(run_checks(CONFIG, GOOD)) == {}


@pytest.mark.parametrize(
    ("autopilot", "expected"),
    [
        ({}, {}),
        ({"autopilot": "PX4"}, {}),
        ({"autopilot": "ArduPilot"}, {Key.IDENTIFIED_ON: INEFFECTIVE}),
    ],
)
def test_a_vehicle_file_of_another_autopilot_is_told(autopilot, expected):
    config = changed(CONFIG, {"vehicle": autopilot}, "test")
    assert found(configuration_checks.identified_autopilot, config=config) == expected


@pytest.mark.parametrize(
    ("quality", "key", "verdict"),
    [
        ({"lost_count": 15}, None, None),
        ({"lost_count": 30}, Key.LOSS, INEFFECTIVE),
        ({"lost_count": 400}, Key.LOSS, UNSAFE),
        ({"damaged_count": 9}, None, None),
        ({"damaged_count": 11}, Key.DAMAGE, INEFFECTIVE),
        ({"not_finite_count": 1}, Key.NOT_FINITE, INEFFECTIVE),
        ({"reconnect_count": 1}, Key.RECONNECTS, UNSAFE),
        ({"frame_count": 0}, None, None),
    ],
)
def test_what_is_lost_on_the_way(quality, key, verdict):
    evidence = replace(GOOD, link=QUALITY._replace(**quality))
    assert found(link_checks.losses, evidence) == ({key: verdict} if key else {})


@pytest.mark.parametrize(("repeated", "told"), [(40, False), (60, True)])
def test_a_second_device_with_the_ids_of_the_vehicle_looks_like_a_lossy_link(repeated, told):
    """A gimbal as 1/1: its own sequence numbers go to and fro between those of the vehicle."""
    link = QUALITY._replace(frame_count=1000, lost_count=400, repeated_count=repeated)
    (loss, *_) = link_checks.losses(CONFIG, replace(GOOD, link=link))
    assert ("another device that sends as 1/1" in loss.fix) is told


@pytest.mark.parametrize(
    ("quality", "pause", "expected"),
    [
        ({"round_trip": 0.029}, 0.099, {}),
        ({"round_trip": 0.031}, 0.0, {Key.ROUND_TRIP: INEFFECTIVE}),
        ({"round_trip": 0.059}, 0.0, {Key.ROUND_TRIP: INEFFECTIVE}),
        ({"round_trip": 0.061}, 0.0, {Key.ROUND_TRIP: UNSAFE}),
        ({"round_trip": 0.101}, 0.0, {Key.ROUND_TRIP: UNSAFE}),
        ({"round_trip": None, "jitter": None}, 0.0, {Key.ROUND_TRIP: INEFFECTIVE}),
        ({"jitter": 0.051}, 0.0, {Key.JITTER: INEFFECTIVE}),
        ({}, 0.101, {Key.PAUSES: INEFFECTIVE}),
    ],
)
def test_what_comes_late(quality, pause, expected):
    """The limit is deadman.telemetry_stale_ms, 100 ms; jitter may take half of it.

    With a gain of 5/s the vehicle shakes from a round trip of 60 ms on, and may from 30 ms on.
    """
    samples = GOOD.samples._replace(longest_pause=pause)
    evidence = replace(GOOD, link=QUALITY._replace(**quality), samples=samples)
    assert found(link_checks.delays, evidence) == expected


@pytest.mark.parametrize(
    "section", [{"planner": {"gain_per_s": 2.4}}, {"link": {"lockstep": True}}]
)
def test_a_round_trip_may_be_longer_with_less_gain_and_in_lockstep(section):
    evidence = replace(GOOD, link=QUALITY._replace(round_trip=0.061))
    assert found(link_checks.delays, evidence, changed(CONFIG, section, "test")) == {}


@pytest.mark.parametrize(("unusable", "expected"), [(0, {}), (2, INEFFECTIVE), (3, UNSAFE)])
def test_attitude_that_cannot_be_answered(unusable, expected):
    evidence = replace(GOOD, samples=GOOD.samples._replace(unusable_count=unusable))
    found_here = found(vehicle_checks.attitude, evidence)
    assert found_here == ({Key.ATTITUDE: expected} if expected else {})


@pytest.mark.parametrize(
    ("age", "other_clock", "expected"),
    [
        (0.012, False, {}),
        (0.099, False, {}),
        (0.4, False, {Key.AGE: UNSAFE}),
        (None, False, {}),  # that nobody answers TIMESYNC is said where its round trip is
        (None, True, {Key.AGE: INEFFECTIVE}),
    ],
)
def test_how_old_attitude_is_when_it_arrives(age, other_clock, expected):
    link = QUALITY._replace(timesync_on_other_clock=other_clock)
    evidence = replace(GOOD, link=link, samples=GOOD.samples._replace(age=age))
    assert found(clock_checks.age, evidence) == expected


@pytest.mark.parametrize(
    ("samples", "expected"),
    [
        ({"clock_rate": 1.019}, {}),
        ({"clock_rate": 20.0}, {Key.CLOCK: INEFFECTIVE}),
        ({"clock_rate": 0.994}, {}),
        ({"clock_rate": 0.97}, {Key.CLOCK: UNSAFE}),
        ({"clock_rate": 0.97, "longest_pause": 0.1}, {Key.CLOCK: INEFFECTIVE}),
        ({"clock_change": "the vehicle's clock jumped"}, {Key.CLOCK: UNSAFE}),
        ({"sample_count": 9, "clock_rate": 0.5}, {}),
        ({"not_newer_count": 40}, {Key.CLOCK: INEFFECTIVE}),
        ({"not_newer_count": 41}, {Key.CLOCK: UNSAFE}),
    ],
)
def test_the_vehicles_clock_goes_on_as_ours_does(samples, expected):
    evidence = replace(GOOD, samples=GOOD.samples._replace(**samples))
    assert found(clock_checks.clocks, evidence) == expected


@pytest.mark.parametrize(
    ("other_nodes", "expected"),
    [
        (OtherNodes(sources={(255, 190), (1, 154)}), {}),
        (OtherNodes(sources={(1, 191)}), {Key.OUR_IDS: UNSAFE}),
        (
            OtherNodes(sources={(1, 192)}, companions={(1, 192)}),
            {Key.SECOND_COMPANION: INEFFECTIVE},
        ),
        (OtherNodes(autopilots={(1, 100)}), {}),
        (OtherNodes(autopilots={(2, 1)}), {Key.SECOND_VEHICLE: INEFFECTIVE}),
        (OtherNodes(setpoint_senders={(255, 190)}), {Key.OTHER_SETPOINTS: UNSAFE}),
        (OtherNodes(has_foreign_attitude_target=True), {Key.OTHER_SETPOINTS: UNSAFE}),
    ],
)
def test_others_on_the_link(other_nodes, expected):
    assert found(link_checks.other_nodes, replace(GOOD, other_nodes=other_nodes)) == expected


def test_rates_that_are_refused_cut_or_not_reached():
    def streams(**changes):
        return replace(GOOD, streams={**GOOD.streams, **changes})

    cut = streams(ATTITUDE_QUATERNION=StreamRate(500.0, 250.0, 250.0))
    assert found(stream_checks.streams, cut) == {"link.streams.ATTITUDE_QUATERNION": INEFFECTIVE}
    slow = streams(ATTITUDE_QUATERNION=StreamRate(250.0, 250.0, 49.0))
    assert found(stream_checks.streams, slow) == {"link.min_attitude_rate_hz": UNSAFE}
    refused = streams(HOME_POSITION=StreamRate(1.0, 0.0, 0.0, "UNSUPPORTED"))
    assert found(stream_checks.streams, refused) == {"link.streams.HOME_POSITION": INEFFECTIVE}
    never = replace(GOOD, received_counts={**GOOD.received_counts, "HOME_POSITION": 0})
    assert found(stream_checks.streams, never) == {"link.streams.HOME_POSITION": INEFFECTIVE}


def test_a_rate_below_the_requested_one_that_is_safe_says_why():
    streams = {
        **GOOD.streams,  # 197 Hz of 250; 50 of 50; a HOME_POSITION, which did not come
        "CURRENT_MODE": StreamRate(20.0, 20.0, 2.0),
    }
    evidence = replace(GOOD, streams=streams, counting_time=4.0)
    evidence = replace(evidence, received_counts={**GOOD.received_counts, "CURRENT_MODE": 8})
    (finding,) = stream_checks.streams(CONFIG, evidence)
    assert finding.result is CheckResult.SAFE
    assert finding.fact == (
        "telemetry arrives, Hz: ATTITUDE_QUATERNION 197 of 250 (70 % suffices), "
        "LOCAL_POSITION_NED 50 of 50, HOME_POSITION (asked for 1, too seldom to be counted here), "
        "CURRENT_MODE on change, otherwise at 2 Hz"
    )


def test_bursts_are_judged_on_the_ground_as_in_flight():
    """The monitor `answer rate` would hand such a vehicle back two seconds after the take-over."""
    bursts = replace(GOOD, samples=GOOD.samples._replace(rate=41.0))
    assert found(stream_checks.streams, bursts) == {"link.min_attitude_rate_hz": UNSAFE}
    (finding, _) = stream_checks.streams(CONFIG, bursts)
    assert "in bursts: 197 Hz on average, but its gaps are as long as at 41 Hz" in finding.fact


def test_asked_again_nothing_is_asked_that_only_the_configuration_decides():
    unused = changed(CONFIG, {"flight": {"accept": ("NO_SUCH_CHECK",)}}, "test")
    assert Key.ACCEPT in amiss(run_checks(unused, GOOD))
    assert amiss(run_checks(unused, GOOD, repeated=True)) == {}


def test_what_the_link_says_of_signatures_is_told_with_its_remedy():
    notice = "the vehicle signs its frames and we do not; set link.signing_key_file"
    evidence = replace(GOOD, link=QUALITY._replace(notices=(notice,)))
    (finding,) = link_checks.signing(CONFIG, evidence)
    assert (finding.key, finding.result) == (Key.SIGNING, INEFFECTIVE)
    assert finding.fix == "set link.signing_key_file"


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"armed": True}, {Key.ARMED: UNSAFE}),
        ({"battery": None}, {Key.BATTERY: INEFFECTIVE}),
        ({"battery": Battery(0.0, 16.0, None)}, {Key.BATTERY: INEFFECTIVE}),
        ({"battery": Battery(0.0, 16.0, 0.19)}, {Key.BATTERY: UNSAFE}),
        ({"battery_silent": True}, {Key.BATTERY: UNSAFE}),
        ({"failsafe": True}, {Key.FAILSAFE: UNSAFE}),
        ({"readiness": READY._replace(has_home=False)}, {Key.READY: NOT_READY}),
    ],
)
def test_the_state_of_the_vehicle(changes, expected):
    evidence = replace(GOOD, state=state(**changes))
    assert amiss(run_checks(CONFIG, evidence)) == expected


@pytest.mark.parametrize(("seen", "told"), [(4, "last message: 4"), (None, "GPS position lost")])
def test_a_lost_gps_tells_its_satellites(seen, told):
    lost = state(gps=Gps(0.0, 1, seen, 500.0), gps_fault="GPS position lost")
    (finding,) = vehicle_checks.gps(CONFIG, replace(GOOD, state=lost))
    assert (finding.key, finding.result) == (Key.GPS, UNSAFE)
    assert finding.fact.startswith("GPS position lost")
    assert finding.fact.endswith(told)


BOOTING = Readiness(prearm_passed=False, estimator_flags=None, has_position=False, has_home=False)
LOST = READY._replace(prearm_passed=False, estimator_flags=0x1)
SILENT_POSITION = {**GOOD.streams, "LOCAL_POSITION_NED": StreamRate(50.0, 50.0, 0.0)}


def without_position(readiness, **changes):
    streams = {**SILENT_POSITION, **changes}
    told = state(readiness=readiness, global_position=None)
    received = {**GOOD.received_counts, "HOME_POSITION": 0}
    return replace(GOOD, state=told, streams=streams, received_counts=received)


@pytest.mark.parametrize("readiness", [BOOTING, LOST])
def test_a_vehicle_without_a_position_yet_is_not_ready_and_nothing_else(readiness):
    """Neither its missing position nor its missing home is a fault of the link."""
    evidence = without_position(readiness)
    findings = run_checks(CONFIG, evidence)
    assert amiss(findings) == {Key.READY: NOT_READY}
    assert [finding.key for finding in blocking_findings(CONFIG, findings)] == [Key.READY]
    assert overall_result(CONFIG, findings) is NOT_READY
    fenced = changed(CONFIG, {"safety": {"fence_polygon_deg": SQUARE}}, "test")
    assert amiss(run_checks(fenced, evidence)) == {Key.READY: NOT_READY, Key.FENCE: NOT_READY}


def test_a_position_that_will_never_come_is_not_hidden_by_not_being_ready():
    """Refused, granted too seldom, or silent although the estimator has one."""
    for rate in (StreamRate(50.0, 0.0, 0.0, "UNSUPPORTED"), StreamRate(50.0, 5.0, 0.0)):
        evidence = without_position(BOOTING, LOCAL_POSITION_NED=rate)
        assert found(stream_checks.streams, evidence)["link.min_position_rate_hz"] is UNSAFE
    evidence = without_position(READY._replace(prearm_passed=False))
    assert found(stream_checks.streams, evidence)["link.min_position_rate_hz"] is UNSAFE
    slow = StreamRate(250.0, 250.0, 3.0)
    evidence = without_position(BOOTING, ATTITUDE_QUATERNION=slow)
    assert found(stream_checks.streams, evidence) == {"link.min_attitude_rate_hz": UNSAFE}


def test_no_remedy_is_to_lower_a_safety_limit():
    """A rate below its minimum: the link is to be mended, or less asked of it."""
    slow = {name: StreamRate(50.0, 50.0, 1.0) for name in GOOD.streams}
    evidence = replace(GOOD, streams=slow)
    remedies = [
        finding.fix
        for finding in stream_checks.streams(CONFIG, evidence)
        if finding.result is UNSAFE
    ]
    assert len(remedies) == 2
    for remedy in remedies:
        assert "raise the link's speed" in remedy
        assert "limit" not in remedy


SQUARE = [(46.999, 7.999), (46.999, 8.001), (47.001, 8.001), (47.001, 7.999)]


@pytest.mark.parametrize(
    ("place", "verdict"),
    [
        (GlobalPosition(0.0, 47.0, 8.0), None),
        (GlobalPosition(0.0, 8.0, 47.0), UNSAFE),  # latitude and longitude confused
        (GlobalPosition(0.0, 47.0, 8.0011), UNSAFE),
        (None, UNSAFE),
    ],
)
def test_a_fence_on_the_map_must_have_the_vehicle_inside(place, verdict):
    fenced = changed(CONFIG, {"safety": {"fence_polygon_deg": SQUARE}}, "test")
    evidence = replace(GOOD, state=state(global_position=place))
    expected = {} if verdict is None else {Key.FENCE: verdict}
    assert found(vehicle_checks.fence, evidence, fenced) == expected
    assert found(vehicle_checks.fence, evidence) == {}


def test_an_estimate_that_jumps_and_an_autopilot_that_does_not_say_what_it_is():
    assert found(vehicle_checks.estimator, replace(GOOD, reset_count=2)) == {
        Key.ESTIMATOR_RESETS: INEFFECTIVE
    }
    for identity in (Identity(), Identity("1.0.0", 0, None)):
        evidence = replace(GOOD, identity=identity)
        assert found(vehicle_checks.version, evidence) == {Key.VERSION: INEFFECTIVE}


def test_silence_about_all_parameters_or_the_vital_ones_is_unsafe():
    silent = replace(GOOD, survey=Survey({}, {}))
    assert found(parameters, silent) == {Key.PARAMETERS: UNSAFE}
    old = Survey({"GUID_TIMEOUT": 1.0}, {"GUID_TIMEOUT": "GUID_TIMEOUT"})
    without = found(parameters, replace(GOOD, autopilot=ARDUPILOT, survey=old))
    assert without == {"GUID_OPTIONS": UNSAFE, "ATC_ANGLE_BOOST": UNSAFE}


LOSSY_LINK = {"link": QUALITY._replace(lost_count=30)}
LOSSY_SURVEY = {"survey": GOOD.survey._replace(link_loses_frames=True)}


def untold(*names, autopilot=PX4, values=GOOD.survey.values, **link):
    """What is found where the link lost what it was told of these."""
    evidence = replace(GOOD, autopilot=autopilot, **link)
    read = evidence.survey._replace(values=values, present_names={name: name for name in values})
    return found(parameters, replace(evidence, survey=read._replace(unread_names=frozenset(names))))


@pytest.mark.parametrize("link", [LOSSY_LINK, LOSSY_SURVEY])
def test_where_the_link_loses_frames_an_unsafe_value_may_have_been_lost(link):
    """The vehicle's frames or ours; and where the autopilot says that it has none, nothing was."""
    assert untold(**link) == {}
    unsafe, named = {"COM_OBL_RC_ACT": UNSAFE}, {Key.PARAMETERS: INEFFECTIVE}
    assert untold("COM_OBL_RC_ACT", **link) == unsafe
    assert untold("MAN_OVERRIDE_SPD", **link) == named
    assert untold("COM_OBL_RC_ACT", "MAN_OVERRIDE_SPD", **link) == {**unsafe, **named}


def test_on_a_good_link_what_every_version_has_is_named_and_nothing_else():
    """The others are those that this version has not."""
    assert untold("MAN_OVERRIDE_SPD", "COM_RC_OVERRIDE") == {}
    assert untold("COM_RC_IN_MODE") == {Key.PARAMETERS: INEFFECTIVE}


def test_what_other_versions_have_in_its_place_stands_for_it():
    vital = {"GUID_OPTIONS": 8.0, "ATC_ANGLE_BOOST": 0.0, "GUID_TIMEOUT": 1.0}
    old, new = {**vital, "ARMING_CHECK": 1.0}, {**vital, "ARMING_SKIPCHK": 0.0}
    rest = {"autopilot": ARDUPILOT, **LOSSY_LINK}
    named = {Key.PARAMETERS: INEFFECTIVE}
    assert untold("ARMING_SKIPCHK", values=old, **rest) == named
    assert untold("ARMING_CHECK", values=new, **rest) == named
    lost = {"ARMING_SKIPCHK": UNSAFE}
    assert untold("ARMING_SKIPCHK", values=vital, **rest) == lost  # it has no ARMING_CHECK, it says
    assert untold("ARMING_CHECK", values=vital, **rest) == {**lost, **named}
    assert untold(values=vital, **rest) == {}


def test_a_parameter_that_is_no_number_is_told_and_nothing_is_proposed():
    evidence = replace(GOOD, survey=GOOD.survey._replace(values={"COM_OF_LOSS_T": math.nan}))
    (finding,) = parameters(CONFIG, evidence)
    assert (finding.result, finding.change) == (UNSAFE, None)
    assert "COM_OF_LOSS_T is nan" in finding.sentence()


def test_a_change_is_proposed_under_the_name_that_this_autopilot_knows():
    old = Survey({"MAV_GCS_SYSID": 1.0, "FS_GCS_ENABLE": 1.0}, {"MAV_GCS_SYSID": "SYSID_MYGCS"})
    old = old._replace(present_names={**old.present_names, "FS_GCS_ENABLE": "FS_GCS_ENABLE"})
    evidence = replace(GOOD, autopilot=ARDUPILOT, survey=old)
    (finding,) = (f for f in parameters(CONFIG, evidence) if f.key == "MAV_GCS_SYSID")
    assert finding.change[:3] == ("SYSID_MYGCS", 1.0, 255.0)
    assert "set SYSID_MYGCS to 255" in finding.sentence()


@pytest.mark.parametrize(
    ("roll", "expected"), [(0.041, {}), (0.070, {Key.DEAD_TIME: INEFFECTIVE}), (None, {})]
)
def test_the_newest_flight_that_measured_tells_the_dead_time(tmp_path, roll, expected):
    for name, measured in (("2026-01-01", 0.2), ("2026-01-02", roll)):
        (tmp_path / name).mkdir()
        _write_dead_time(tmp_path / name, measured)
    (tmp_path / "2026-01-04").mkdir()
    _write_dead_time(tmp_path / "2026-01-04", 0.3, gain=9.0)  # another gain says nothing
    (tmp_path / "2026-01-05").mkdir()
    _write_dead_time(tmp_path / "2026-01-05", 0.3, uid="another vehicle")
    (tmp_path / "2026-01-03").mkdir()
    (tmp_path / "2026-01-03" / "summary.json").write_text("[")  # cut off
    config = changed(CONFIG, {"recording": {"directory": tmp_path}}, "test")
    if roll is None:
        (tmp_path / "2026-01-01" / "summary.json").unlink()
        (finding,) = configuration_checks.dead_time(config, GOOD)
        assert "was not measured yet by any flight of this vehicle" in finding.fact
    assert found(configuration_checks.dead_time, config=config) == expected


def _write_dead_time(folder, roll, gain=CONFIG.planner.gain_per_s, uid=GOOD.identity.uid):
    times = {"roll": roll, "pitch": None, "yaw": None}
    told = {"planner": CONFIG.planner_name, "gain_per_s": gain, "dead_time_s": times}
    told["vehicle_uid"] = uid
    (folder / "summary.json").write_text(json.dumps(told))


def test_an_exception_lets_one_finding_pass_and_no_other():
    evidence = replace(GOOD, survey=Survey({"COM_OF_LOSS_T": 5.0}, GOOD.survey.present_names))
    evidence = replace(evidence, link=QUALITY._replace(round_trip=0.5))
    accepting = changed(CONFIG, {"flight": {"accept": ("COM_OF_LOSS_T",)}}, "test")
    refused = [
        finding.key for finding in blocking_findings(accepting, run_checks(accepting, evidence))
    ]
    assert refused == [Key.ROUND_TRIP]
    assert len(blocking_findings(CONFIG, run_checks(CONFIG, evidence))) == 2


def test_times_that_are_not_the_vehicles_own_and_units_mistaken_are_told():
    wrong = {
        "vehicle": {"identified": None},
        "limits": {"max_yaw_rate_deg_s": 1.57},
        "safety": {"max_body_rate_deg_s": 20.0},
    }
    config = changed(CONFIG, wrong, "test")
    found = {one.key: one for one in configuration_checks.doubtful_values(config, GOOD)}
    assert set(found) == {Key.IDENTIFIED, Key.UNITS, Key.BODY_RATE_KEY}
    assert all(one.result is CheckResult.INEFFECTIVE for one in found.values())
    assert found[Key.UNITS].source == "limits.max_yaw_rate_deg_s"
    assert list(configuration_checks.doubtful_values(CONFIG, GOOD)) == []


def test_px4_is_not_expected_to_divide_thrust_by_the_cosine_of_the_tilt():
    config = changed(CONFIG, {"thrust": {"autopilot_compensates_tilt": True}}, "test")
    (found,) = blocking_findings(config, run_checks(config, GOOD))
    assert found.key == Key.TILT_COMPENSATION
    assert list(configuration_checks.tilt_compensation(CONFIG, GOOD)) == []
    other = replace(GOOD, autopilot=ARDUPILOT)
    assert list(configuration_checks.tilt_compensation(config, other)) == []
