"""Real autopilots' recordings, played to our link: what it makes of them, and what it says itself.

The stories are cut from whole recordings by `tests.mavlink.recordings.cut`. What they should come
to was read from the whole ones by pymavlink.
"""

from functools import cache
from pathlib import Path

import pytest

from companion.mavlink.messages import CRC_EXTRA, MESSAGE_IDS
from tests.mavlink.recordings.cut import WHOLE_S
from tests.mavlink.replay import payload, replay

FOLDER = Path(__file__).parent / "recordings"
NO_SECOND_AT_ONCE = 168.71
"""Here that recorded client had two requests of one kind under way, which ours never has."""

STORIES = {  # (s since the beginning of the whole log, mode, armed) at each change
    "ardupilot-idle": [(0.0, "STABILIZE", False)],
    "ardupilot-flight": [
        (0.97, "STABILIZE", False),
        (43.2, "GUIDED", False),
        (44.99, "GUIDED", True),
        (56.99, "GUIDED (body rates)", True),
        (74.63, "LAND", True),
        (99.99, "LAND", False),
    ],
    "px4-idle": [(0.72, "AUTO.LOITER", False)],
    "px4-offboard-entry": [
        (0.55, "AUTO.LOITER", False),
        (31.55, "OFFBOARD", False),
        (48.68, "AUTO.LOITER", False),
    ],
    "px4-flight-companion": [
        (1.0, "AUTO.LOITER", False),
        (10.06, "AUTO.TAKEOFF", True),
        (22.13, "AUTO.LOITER", True),
        (26.16, "OFFBOARD", True),
        (50.3, "AUTO.LOITER", True),
        (52.32, "AUTO.LAND", True),
        (71.43, "AUTO.LOITER", False),
    ],
    "px4-flight-gcs": [
        (1.0, "AUTO.LOITER", False),
        (10.06, "AUTO.TAKEOFF", True),
        (22.13, "AUTO.LOITER", True),
        (26.15, "OFFBOARD", True),
        (50.31, "AUTO.LOITER", True),
        (52.32, "AUTO.LAND", True),
        (70.44, "AUTO.LOITER", False),
    ],
}
RATES_HZ = {  # while everything was recorded
    "ardupilot-idle": {"ATTITUDE_QUATERNION": 200.0, "ATTITUDE": 200.0},
    "ardupilot-flight": {"ATTITUDE_QUATERNION": 100.0, "LOCAL_POSITION_NED": 20.0},
    "px4-idle": {"ATTITUDE": 100.0, "ATTITUDE_QUATERNION": 50.0, "LOCAL_POSITION_NED": 30.0},
    "px4-offboard-entry": {"ATTITUDE": 100.0, "ATTITUDE_QUATERNION": 50.0},
    "px4-flight-companion": {"ATTITUDE_QUATERNION": 100.0, "LOCAL_POSITION_NED": 50.0},
    "px4-flight-gcs": {"ATTITUDE_QUATERNION": 100.0, "LOCAL_POSITION_NED": 50.0},
}
PARAMETERS = {
    "ardupilot-idle": {"SCHED_LOOP_RATE": 400, "GUID_TIMEOUT": 3.0, "FS_OPTIONS": 16},
    "px4-idle": {"COM_OF_LOSS_T": 1.0, "NAV_RCL_ACT": 2, "CBRK_FLIGHTTERM": 121212},
    "px4-flight-gcs": {"MIS_TAKEOFF_ALT": 10.0},
}
EVERY_LOG = pytest.mark.parametrize("name", STORIES)


@cache
def played(name):
    return replay(FOLDER / f"{name}-story.tlog")


@EVERY_LOG
def test_modes_and_arming_are_told_as_they_were(name):
    story = played(name).story
    assert [entry[1:] for entry in story] == [entry[1:] for entry in STORIES[name]]
    assert since_the_first(story) == pytest.approx(since_the_first(STORIES[name]), abs=0.02)


def since_the_first(story):
    return [entry[0] - story[0][0] for entry in story]


@EVERY_LOG
def test_every_frame_is_counted_and_every_sample_is_the_recorded_one(name):
    out = played(name)
    known = {number: n for number, n in out.told.items() if number in CRC_EXTRA}
    assert out.stats.by_message == known
    assert out.stats.unknown == out.told.total() - sum(known.values())
    assert out.stats.bad_crc == out.stats.malformed == out.stats.ignored_foreign == 0
    for ours, theirs in zip(out.samples, out.attitudes, strict=True):
        assert ours.time_boot_ms == theirs.time_boot_ms
        assert ours.q == (theirs.q1, theirs.q2, theirs.q3, theirs.q4)
        assert ours.body_rates == (theirs.rollspeed, theirs.pitchspeed, theirs.yawspeed)
    assert out.stats.outdated == 0
    for message, rate in RATES_HZ[name].items():
        count = out.stats.by_message[MESSAGE_IDS[message]]
        assert count == pytest.approx(rate * WHOLE_S, abs=2), message


@EVERY_LOG
def test_what_the_companion_said_is_what_ours_says(name):
    """Setpoints byte for byte, number and checksum included; commands in all that they say."""
    out = played(name)
    for recorded, ours in out.setpoints:
        assert ours == recorded
    assert len(out.setpoints) > 25 or "idle" in name
    unsaid = [ours for _, ours in out.requests].count(None)
    assert unsaid == (name == "ardupilot-idle")  # see NO_SECOND_AT_ONCE
    assert len(out.requests) > unsaid
    for recorded, ours in out.requests:
        assert ours is None or payload(ours) == payload(recorded)


def test_ardupilot_grants_and_denies_rates_as_recorded():
    answers = {
        asked[2]: came
        for time, asked, came in played("ardupilot-idle").answers
        if asked[:2] == (511, 31.0) and time < NO_SECOND_AT_ONCE
    }
    denied = {interval for interval, came in answers.items() if came == 2}
    granted = {interval for interval, came in answers.items() if came is None}
    assert denied == {2500.0, 2000.0, 1000.0}
    assert {4000.0, 5000.0, 10000.0, 20000.0} < granted


def test_ardupilots_flight_is_commanded_as_recorded():
    answers = [entry[1:] for entry in played("ardupilot-flight").answers if entry[1][0] != 511]
    guided, arm, take_off, land = (176, 1.0, 4.0), (400, 1.0, 0.0), (22, 0.0, 0.0), (176, 1.0, 9.0)
    assert [(asked[:3], came) for asked, came in answers] == [
        (guided, None),
        (arm, None),
        (take_off, None),
        (land, None),
    ]


def test_px4_refuses_to_arm_without_a_stream_as_recorded():
    answers = played("px4-offboard-entry").answers
    assert [came for _, asked, came in answers if asked[:2] == (400, 1.0)][-1] == 1


@pytest.mark.parametrize("name", PARAMETERS)
def test_parameters_are_read_as_recorded(name):
    """PX4's integers travel as bytes, ArduPilot's as numbers."""
    read = {asked: came for _, asked, came in played(name).answers if isinstance(asked, str)}
    assert PARAMETERS[name].items() <= read.items()


def test_texts_and_home_are_as_recorded():
    state = played("ardupilot-flight").state
    words = [entry.text for entry in state.texts]
    assert words.index("ArduPilot Ready") < words.index("Arming motors")
    assert words[-1] == "Disarming motors"
    assert state.home.altitude_m == pytest.approx(584.08)
    assert state.home.down == pytest.approx(0.01)
    idle = [entry.text for entry in played("ardupilot-idle").state.texts]
    assert "Requested rate for message ID 31 too fast. Increase SCHED_LOOP_RATE" in idle
