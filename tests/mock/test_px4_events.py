"""PX4's events: numbered, with the recorded bytes, kept and sent again, told of every 3 s."""

import struct
from itertools import pairwise

import pytest
from mock_rig import ACCEPTED, TEMPORARILY_REJECTED, Rig
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.framing import Framer, decode, split_frames
from sitl_mock.px4.events import PX4_EVENTS

EVENT, SEQUENCE, ERROR = 410, 411, 413
NO_STREAM = "0040000014"


class Listener(Rig):
    """A rig that keeps the frames which pymavlink does not know."""

    def __init__(self, **settings):
        self.raw = []
        super().__init__(gcs=False, **settings)

    def _take(self):
        for frame in self.simulation.companion.outbox:
            self.raw.append((self.time, int.from_bytes(frame[7:10], "little"), frame[10:-2]))
        super()._take()

    def of(self, message_id):
        return [(at, payload) for at, number, payload in self.raw if number == message_id]

    def events(self, since=0.0):
        """(id, external level, internal level, arguments, sequence) of each event."""
        out = []
        for at, payload in self.of(EVENT):
            fields = struct.unpack("<IIHBBB40s", payload.ljust(53, b"\0"))
            if at >= since:
                level = fields[5]
                arguments = fields[6].rstrip(b"\0").hex()
                out.append((fields[0], level & 15, level >> 4, arguments, fields[2]))
        return out

    def told(self, since=0.0):
        return [event[:4] for event in self.events(since)]

    def request(self, first, last):
        """Ask for events again; returns the sequences that came and those refused."""
        before = len(self.raw)
        payload = struct.pack("<HHBB", first & 0xFFFF, last & 0xFFFF, 1, 1)
        for message in decode(self.framer.frame_raw(412, 33, payload)):
            self.simulation.handle(message, self.simulation.companion)
        self._take()
        came = [struct.unpack_from("<H", p.ljust(53, b"\0"), 8)[0]
                for _, number, p in self.raw[before:] if number == EVENT]  # fmt: skip
        refused = [struct.unpack("<HHBBB", p.ljust(7, b"\0"))
                   for _, number, p in self.raw[before:] if number == ERROR]  # fmt: skip
        return came, refused


@pytest.fixture(scope="module")
def flown():
    """Ready, armed, flown, and the stream lost in OFFBOARD."""
    rig = Listener(quick=False, prearm_delay_s=4.5, parameters={"MPC_TKO_SPEED": 3.0})
    rig.run(3.0)
    rig.landmarks = {"ready": rig.time}
    rig.simulation.parameters.set("MIS_TAKEOFF_ALT", 3.0)
    assert rig.mode(4, 2) == ACCEPTED
    rig.landmarks["arm"] = rig.time
    assert rig.arm() == ACCEPTED
    rig.run_until(lambda: rig.state.mode.name == "LOITER", 20.0)
    rig.each_tick = rig.rates
    rig.run(2.5)
    assert rig.offboard() == ACCEPTED
    rig.run(0.2)
    rig.each_tick = None
    rig.landmarks["lost"] = rig.time
    rig.run(1.2)
    return rig


def test_the_health_reports_of_a_boot_are_the_recorded_ones(flown):
    """px4-flight-companion.tlog, sequences 4 to 27, but for what only its estimator knows."""
    first, second, third = (
        [number for number in range(len(flown.told())) if flown.told()[number][0] == 27825120]
    )[:3]
    told = flown.told()
    assert told[first : first + 10] == [
        (27825120, 8, 8, "000000130180000000002a0180002a0180"),
        (30203637, 3, 3, "fc007e0011"),
        (28241790, 3, 3, NO_STREAM),
        (27227279, 2, 2, "fed17e0010"),
        (30612409, 3, 3, "fc007e0011"),
        (26788467, 3, 3, "3800000018"),
        (17154777, 6, 6, "0800000014"),
        (17231145, 4, 4, "ffffffff07"),
        (23579003, 6, 6, "ffffffff0c"),
        (18691879, 8, 8, "00020d0238"),
    ]
    assert told[second] == (27825120, 8, 8, "000000120180000000003a0180003a0180")
    assert told[third] == (27825120, 8, 8, "000000100080000000b03a7f80b03a7f80")
    assert told[third + 5] == (18691879, 8, 8, "000a0d0238")
    times = [at for at, payload in flown.of(EVENT) if payload[:4] == struct.pack("<I", 27825120)]
    assert [round(at) for at in times[:3]] == [2, 4, 6]


def test_the_events_of_a_flight_have_the_recorded_numbers(flown):
    told = [event for event in flown.told(flown.landmarks["arm"]) if event[1] != 8]
    named = [event for event in told if event[3][-2:] not in ("14", "07", "0c")]
    assert named[:3] == [(26266355, 6, 6, "04"), (20656071, 6, 6, "00004040"), (21054825, 6, 6, "")]
    # PX4's source: commander_failsafe_enter_generic, OFFBOARD, RTL.
    assert (31382480, 2, 4, "0000060006") in flown.told(flown.landmarks["lost"])


def test_a_landing_is_told_where_it_is_commanded():
    """px4-corners, px4-circle-5ms: NAV_LAND; px4-flight-gcs changes the mode and says nothing."""
    for command, told in (((21,), True), ((176, 1, 4, 6), False)):
        rig = Listener()
        rig.take_off(3.0)
        before = rig.time
        assert rig.command(*command) == ACCEPTED
        rig.run(0.1)
        assert ((20099806, 6, 6, "") in rig.told(before)) is told


def test_sequences_run_on_and_the_latest_is_told_every_three_seconds(flown):
    sequences = [event[4] for event in flown.events()]
    assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
    told = flown.of(SEQUENCE)
    assert told[0][1].ljust(3, b"\0")[2] == 1, "a reset comes before the first event"
    times = [at for at, _ in told[1:]]
    gaps = [later - sooner for sooner, later in pairwise(times)]
    assert gaps == pytest.approx([3.0] * len(gaps), abs=0.06)
    at, payload = told[-1]
    latest = sum(event_at <= at for event_at, _ in flown.of(EVENT))
    assert struct.unpack("<HB", payload.ljust(3, b"\0")) == (sequences[latest - 1], 0)


def test_events_are_sent_again_when_asked_for(flown):
    latest = flown.events()[-1][4]
    assert flown.request(latest - 2, latest) == ([latest - 2, latest - 1, latest], [])
    came, refused = flown.request(latest + 1, latest + 1)
    assert came == []
    assert [(error[0], error[2:]) for error in refused] == [(latest + 1, (1, 191, 0))]
    came, refused = flown.request(0, latest)
    assert came == list(range(latest - 19, latest + 1))
    assert refused[0][:2] == (0, latest - 19)


def test_a_refused_arming_is_told_by_number_on_a_link_without_texts():
    rig = Listener()
    assert rig.offboard() == ACCEPTED
    rig.run(0.1)
    at = rig.time
    assert rig.arm() == TEMPORARILY_REJECTED
    assert (16910493, 2, 6, "") in rig.told(at)
    assert (30054617, 4, 4, "000006") in rig.told()
    assert rig.texts() == []


def test_every_text_but_the_reason_has_an_event():
    without = [occasion.name for occasion, event in PX4_EVENTS.items() if not event.event_id]
    assert without == ["PREFLIGHT_FAIL"]


def test_a_stream_of_bytes_is_split_into_its_frames():
    framer = Framer(255, 190)
    frames = [framer.frame(dialect.MAVLink_ping_message(n, n, 0, 0)) for n in range(4)]
    data = b"\x00noise" + frames[0] + frames[1] + b"\xfe" + frames[2] + frames[3]
    whole, rest = [], b""
    for start in range(0, len(data), 7):
        found, rest = split_frames(rest + data[start : start + 7])
        whole += found
    sequences = [message.seq for frame in whole for message in decode(frame)]
    assert sequences[:2] == [0, 1]
    assert len(rest) < 300
