"""Frames out of anything: what pymavlink packed comes back whole, the rest never does."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as dialect
from pymavlink.generator.mavcrc import x25crc

from companion.mavlink.framing import FrameScanner, build_frame
from companion.mavlink.messages import CRC_EXTRA
from companion.mavlink.stats import FrameCounter, LinkStats
from tests.mavlink.fakes import attitude, frames_of, heartbeat

SOME = [
    heartbeat(),
    attitude(4),
    dialect.MAVLink_statustext_message(6, b"hello", 0, 0),
    dialect.MAVLink_timesync_message(0, 123456789),
    dialect.MAVLink_param_value_message(b"COM_OF_LOSS_T", 1.0, 9, 900, 17),
]


def scanner(*, streaming=False, stats=None):
    return FrameScanner(streaming=streaming, stats=stats)


def test_several_frames_in_one_datagram():
    packed = frames_of(*SOME)
    found = scanner().feed(b"".join(packed))
    assert [frame.raw for frame in found] == packed
    assert [frame.message_id for frame in found] == [message.get_msgId() for message in SOME]
    assert [frame.sequence for frame in found] == list(range(len(SOME)))
    assert {(frame.system, frame.component) for frame in found} == {(1, 1)}


def test_version_1_frames_are_understood():
    mav = dialect.MAVLink(None, 1, 1)
    packed = [message.pack(mav, force_mavlink1=True) for message in SOME[:2]]
    found = scanner().feed(b"".join(packed))
    assert [(frame.message_id, frame.raw) for frame in found] == [(0, packed[0]), (31, packed[1])]


@given(st.data())
@settings(max_examples=200, deadline=None)
def test_a_stream_may_be_cut_anywhere_and_hold_garbage_between_frames(data):
    packed = frames_of(*SOME)
    garbage = st.binary(max_size=20).map(
        lambda junk: junk.replace(b"\xfd", b"").replace(b"\xfe", b"")
    )
    stream = b"".join(data.draw(garbage) + frame for frame in packed)
    stream += bytes(300)  # what is held back for an unfinished frame must come out
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    receiver = scanner(streaming=True)
    found = []
    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        found += receiver.feed(stream[start:end])
    assert [frame.raw for frame in found] == packed


@given(st.binary(max_size=600))
@settings(max_examples=300, deadline=None)
def test_garbage_that_looks_like_frames_costs_no_frame_after_it(junk):
    stats = LinkStats()
    wanted = frames_of(*SOME)
    found = scanner(streaming=True, stats=stats).feed(junk + b"".join(wanted) + bytes(300))
    raws = [frame.raw for frame in found]
    # A frame may be swallowed only by a well-formed frame of an unknown message around it.
    assert stats.unknown or raws[-len(wanted) :] == wanted


def flagged(frame, flags):
    """The frame with other incompatibility flags, and the checksum that belongs to them."""
    body = bytes((*frame[:2], flags, *frame[3:-2]))
    crc = x25crc(body[1:] + CRC_EXTRA[0])
    return body + crc.crc.to_bytes(2, "little")


@pytest.mark.parametrize("flag", [0x02, 0x80])
def test_unknown_incompatible_flags_are_refused(flag):
    frame = bytearray(frames_of(heartbeat())[0])
    assert len(scanner().feed(flagged(frame, 0))) == 1  # so it is the flag that is refused below
    assert scanner().feed(flagged(frame, flag)) == []
    # With a signature behind it, too, as a scanner that ignored the flag would expect one.
    assert scanner().feed(flagged(frame, flag) + bytes(13)) == []
    assert scanner().feed(flagged(frame, flag | 0x01) + bytes(13)) == []
    assert len(scanner().feed(flagged(frame, 0x01) + bytes(13))) == 1


def test_every_single_bit_error_is_noticed():
    frame = frames_of(attitude(1234))[0]
    for bit in range(8 * len(frame)):
        broken = bytearray(frame)
        broken[bit // 8] ^= 1 << bit % 8
        found = scanner().feed(bytes(broken))
        # Compatibility flags and all else are under the checksum, the magic byte by position.
        assert found == [], f"bit {bit}"


def test_an_unknown_message_is_skipped_whole(monkeypatch):
    stats, payload = LinkStats(), heartbeat().pack(dialect.MAVLink(None))
    with monkeypatch.context() as patch:
        patch.setitem(CRC_EXTRA, 70000, b"\0")
        unknown = build_frame(70000, payload, sequence=0, system=1, component=1)
    wanted = frames_of(heartbeat())[0]
    # Its payload holds a whole heartbeat of its own, which nobody sent.
    assert [frame.raw for frame in scanner(stats=stats).feed(unknown + wanted)] == [wanted]
    assert stats.unknown == 1


def test_a_datagram_that_ends_early_leaves_nothing_behind():
    receiver, frame = scanner(), frames_of(attitude(8))[0]
    assert receiver.feed(frame[:-3]) == []
    assert receiver.feed(frame[-3:]) == []
    assert [found.raw for found in receiver.feed(frame)] == [frame]


@pytest.mark.parametrize("message", SOME, ids=lambda message: message.get_type())
def test_built_frames_are_pymavlinks_byte_for_byte(message):
    mav = dialect.MAVLink(None, 7, 191)
    mav.seq = 200
    packed = message.pack(mav)
    full = bytes(message.get_payload()) + bytes(9)
    built = build_frame(message.get_msgId(), full, sequence=200, system=7, component=191)
    assert built == packed


def test_an_all_zero_payload_keeps_one_byte():
    message = dialect.MAVLink_system_time_message(0, 0)
    packed = message.pack(dialect.MAVLink(None, 1, 191))
    assert packed[1] == 1
    assert build_frame(2, bytes(12), sequence=0, system=1, component=191) == packed


def test_sequence_gaps_wrap_and_late_frames_are_no_loss():
    stats = LinkStats()
    counter = FrameCounter(stats)
    for number in (254, 255, 0, 3, 3, 1, 4):
        counter.count(0, number)
    assert (stats.frames, stats.lost, stats.repeated) == (7, 2, 2)
    counter.reset()
    counter.count(0, 100)
    assert stats.lost == 2


def test_random_bytes_never_make_a_frame():
    source = random.Random(7)
    receiver = scanner()
    for _ in range(3000):
        assert receiver.feed(source.randbytes(source.randrange(80))) == []
