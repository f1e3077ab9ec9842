"""PX4's events in words: recorded values, and what the STATUSTEXTs beside them said."""

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.mavlink.framing import FrameScanner
from companion.mavlink.texts import TextAssembler
from companion.vehicle.px4.events import EventReader, event_id

# Arguments as recorded (px4-flight-companion, px4-flight-gcs, px4-offboard-entry).
RECORDED = [
    (26266355, 0x66, "04", "Armed by external command"),
    (32794487, 0x66, "06", "Disarmed by landing"),
    (16910493, 0x62, "", "Arming denied: Resolve system health failures first"),
    (20656071, 0x66, "00002041", "Using default takeoff altitude: 10.0 m"),
    (21054825, 0x66, "", "Takeoff detected"),
    (26622124, 0x66, "", "Landing detected"),
    (20099806, 0x66, "", "Landing at current position"),  # px4-circle-5ms, px4-corners
    (27494155, 0x66, "", "Onboard controller regained"),
    (29547634, 0x42, "0000040608", "Failsafe activated, triggering descend"),  # GPS off in LAND
    (30054617, 0x44, "000006", "Failsafe warning triggered"),
    (17980399, 0x66, "ea070b15042a1c", "Logging to 2026-11-21/04_42_28.ulg"),
]
SUMMARY, HEALTH = 27825120, 18691879
NO_STREAM, NO_MISSION, NO_PILOT, NO_POSITION = 28241790, 17154777, 17231145, 30612409


class Scene:
    def __init__(self):
        self.now = 0.0
        self.texts = TextAssembler()
        self.reader = EventReader(self.texts, lambda: self.now)
        self.sequence = 65534

    def event(self, number, levels=0x66, arguments=b""):
        self.sequence = (self.sequence + 1) & 0xFFFF
        head = number.to_bytes(4, "little") + bytes(4) + self.sequence.to_bytes(2, "little")
        self.reader.take((head + bytes((0, 0, levels)) + arguments).rstrip(b"\0"))

    def report(self, *failing):
        self.event(SUMMARY, 0x88)
        for number, level in failing:
            self.event(number, level << 4 | level, b"\0\x40\0\0\x14")
        self.event(HEALTH, 0x88)

    @property
    def said(self):
        return [(text.severity, text.text) for text in self.texts.texts]


@pytest.mark.parametrize(("number", "levels", "arguments", "words"), RECORDED)
def test_recorded_events_in_words(number, levels, arguments, words):
    scene = Scene()
    scene.event(number, levels, bytes.fromhex(arguments))
    assert scene.said == [(levels & 15, words)]


def test_an_unknown_value_is_shown_as_a_number_and_an_unknown_event_as_its_number():
    scene = Scene()
    scene.event(29547634, 0x42, bytes.fromhex("00000406ee"))
    scene.event(123, 0x44)
    (_, failsafe), (severity, unknown) = scene.said
    assert "238" in failsafe
    assert (severity, unknown) == (4, "unknown PX4 event 123")


def test_failsafes_say_why_and_what():
    scene = Scene()
    offboard = (0x00060000).to_bytes(4, "little")
    for name, arguments in (
        ("commander_failsafe_enter_hold", bytes((6, 5, 0, 2))),
        ("commander_failsafe_enter", bytes((6, 2))),
        ("commander_failsafe_enter_generic", bytes((7,))),
    ):
        scene.event(event_id(name), 0x42, offboard + arguments)
    assert scene.said == [
        (2, "Failsafe activated due to GCS connection loss, triggering RTL in 5 seconds"),
        (2, "Failsafe activated due to GCS connection loss, triggering RTL"),
        (2, "Failsafe activated, triggering land"),
    ]


def test_a_health_report_says_what_is_new_and_no_mere_remark():
    scene = Scene()
    scene.report((NO_STREAM, 3), (NO_POSITION, 3), (NO_MISSION, 6), (NO_PILOT, 4))
    assert scene.said == [
        (3, "Navigation error: No valid position estimate"),
        (4, "No manual control input"),
    ]
    scene.report((NO_POSITION, 3), (NO_PILOT, 4))
    assert len(scene.said) == 2
    scene.report((NO_PILOT, 4))
    scene.now = 5.0
    scene.report((NO_POSITION, 3), (NO_PILOT, 4))
    assert scene.said[2:] == [(3, "Navigation error: No valid position estimate")]


def test_an_unknown_event_is_named_by_its_number_once():
    scene = Scene()
    for at in (0.0, 5.0):
        scene.now = at
        scene.event(16777217, 0x44)
    scene.event(16777218, 0x88)  # for programs only
    assert scene.said == [(4, "unknown PX4 event 16777217")]


def test_an_event_sent_again_is_taken_once():
    scene = Scene()
    scene.event(21054825)
    scene.now, scene.sequence = 5.0, scene.sequence - 1
    scene.event(21054825)
    assert len(scene.said) == 1


@pytest.mark.parametrize("text_first", [True, False])
def test_what_comes_as_text_and_as_event_is_kept_once(text_first):
    scene = Scene()
    text = dialect.MAVLink_statustext_message(6, b"Takeoff detected\t", 0, 0)
    steps = [lambda: scene.texts.take(text, scene.now), lambda: scene.event(21054825)]
    for step in steps if text_first else reversed(steps):
        step()
    scene.now = 60.0
    scene.texts.take(text, scene.now)
    assert [words for _, words in scene.said] == ["Takeoff detected"] * 2


def test_recorded_frames_of_events_are_intact():
    """px4-flight-gcs.tlog at 68.018 s, and the sequence number after it."""
    event = bytes.fromhex("fd0d0000d801019a0100ac389601a0080100260000006644a1")
    sequence = bytes.fromhex("fd010000fc01019b0100264098")
    frames = FrameScanner().feed(event + sequence)
    assert [frame.message_id for frame in frames] == [410, 411]
    scene = Scene()
    scene.reader.take(frames[0].payload)
    assert scene.said == [(6, "Landing detected")]
