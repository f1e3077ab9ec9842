"""Bytes from a wire: nothing raises, nothing damaged is passed on, nothing piles up.

Which frame is intact is judged by pymavlink alone.
"""

import struct
from collections import Counter
from itertools import pairwise
from math import isfinite
from typing import Any

from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect
from pymavlink.generator.mavcrc import x25crc

from companion.mavlink.framing import Frame, FrameScanner
from companion.mavlink.messages import CRC_EXTRA
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import Signing
from companion.vehicle.link import Link
from companion.vehicle.records import AttitudeSample
from tests.fuzz import virtual_time
from tests.fuzz.target import Case, Target
from tests.fuzz.wires import Wire

_LONGEST_FRAME = 280
_KEY = bytes(range(32))
_UNIX_S = 1_767_225_600.0
"""The computer's date, 2026."""
_STAMP = int((_UNIX_S - 1_420_070_400) * 1e5)
_ENDPOINTS = {False: "udpin://127.0.0.1:0", True: "tcp://127.0.0.1:5760"}
_LACKED = {410: 160, 411: 106, 436: 193}
"""CRC_EXTRA of EVENT, CURRENT_EVENT_SEQUENCE and CURRENT_MODE (MAVLink common), which pymavlink's
dialect of ArduPilot lacks."""
_HEARD = (
    *("HEARTBEAT", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED", "SYS_STATUS", "STATUSTEXT"),
    *("EXTENDED_SYS_STATE", "BATTERY_STATUS", "ATTITUDE_TARGET", "GLOBAL_POSITION_INT", "ODOMETRY"),
    *("GPS_RAW_INT", "HOME_POSITION", "ESTIMATOR_STATUS", "EKF_STATUS_REPORT", "COMMAND_ACK"),
    *("PARAM_VALUE", "PARAM_ERROR", "TIMESYNC", "AUTOPILOT_VERSION"),
)
_NUMBERS = {kind.msgname: number for number, kind in dialect.mavlink_map.items()}


def _check(case: Case) -> None:
    pieces = [bytes.fromhex(piece) for piece in case["pieces"]]
    streaming, signed = case["streaming"], case["signed"]
    chunks = _cut(b"".join(pieces), case["cuts"]) if streaming else pieces
    _scan(chunks, pieces, case)
    virtual_time.run(_receive(chunks, set(case["claims"]), streaming=streaming, signed=signed))


def _cut(data: bytes, cuts: list[int]) -> list[bytes]:
    places = sorted({0, len(data), *(cut for cut in cuts if cut < len(data))})
    return [data[start:end] for start, end in pairwise(places)]


def _scan(chunks: list[bytes], pieces: list[bytes], case: Case) -> None:
    scanner = FrameScanner(streaming=case["streaming"])
    found: list[Frame] = []
    for chunk in chunks:
        found += scanner.feed(chunk)
        assert len(scanner._incomplete_frame) <= _LONGEST_FRAME * case["streaming"]
    for frame in found:
        _intact(frame)
    if case["whole"]:
        raws = Counter(frame.raw for frame in (*found, *scanner.feed(bytes(_LONGEST_FRAME))))
        missing = Counter(piece for piece in pieces if piece) - raws
        assert not missing, f"not delivered: {[raw.hex() for raw in missing]}"


def _intact(frame: Frame) -> None:
    """See that pymavlink takes the frame, and reads the same from it."""
    if frame.message_id in _LACKED:
        assert frame.raw == frame_of(
            frame.message_id,
            frame.payload,
            (frame.system, frame.component),
            frame.sequence,
            signature=frame.raw[12 + frame.raw[1] :] if frame.signed else b"",
        )
        return
    try:
        message = dialect.MAVLink(None).decode(bytearray(frame.raw))
    except dialect.MAVError as error:
        # Intact, but with text that is not ASCII: pymavlink makes no message of it.
        assert str(error).startswith("Unable to instantiate"), error  # noqa: PT017
        return
    header = message.get_header()
    theirs = header.msgId, header.srcSystem, header.srcComponent, header.seq
    assert (frame.message_id, frame.system, frame.component, frame.sequence) == theirs
    assert frame.signed == bool(header.incompat_flags & 1)


async def _receive(chunks: list[bytes], claims: set[int], *, streaming: bool, signed: bool) -> None:
    """Let a whole link read it, with all that listens to it."""
    accepted: list[bytes] = []
    errors: list[Exception] = []
    samples: list[AttitudeSample] = []
    wire = Wire()
    signing = Signing(_KEY, clock=lambda: _UNIX_S) if signed else None
    settings = LinkSettings(endpoint=_ENDPOINTS[streaming], signing=signing)
    link = Link(settings, lambda _, raw: accepted.append(raw), wire.open, lambda _: None)
    link.on_attitude, link.on_error = samples.append, errors.append
    async with link:
        for number, chunk in enumerate(chunks):
            before = len(samples)
            wire.deliver(chunk, who="another" if number in claims else None)
            assert len(samples) - before <= 1 + len(chunk) // 12
    for raw in accepted:
        _accepted(raw, signed=signed)
    assert not errors, errors
    for sample in samples:
        assert all(map(isfinite, (*sample.q, *sample.body_rates))), sample
    assert len(link.state.texts) <= 100


def _accepted(raw: bytes, *, signed: bool) -> None:
    """See that an accepted frame is the vehicle's, or ours, and signed where that is asked for."""
    source = (raw[5], raw[6]) if raw[0] == 0xFD else (raw[3], raw[4])
    assert source in ((1, 1), (1, 191)), f"taken from {source}"
    if signed and source == (1, 1):
        assert raw[0] == 0xFD, "taken, and cannot be signed"
        parser = dialect.MAVLink(None)
        parser.signing.secret_key, parser.signing.timestamp = _KEY, _STAMP
        assert parser.check_signature(bytearray(raw), *source), f"badly signed: {raw.hex()}"


# --- cases

_floats = st.sampled_from(
    [
        struct.pack("<f", value)
        for value in (0.0, 1.0, -1.0, float("nan"), float("inf"), -float("inf"), 1e-40, 3e38)
    ]
)
_payloads = st.one_of(
    st.binary(max_size=40),
    st.lists(st.one_of(_floats, st.binary(min_size=4, max_size=4)), max_size=64).map(b"".join),
    st.binary(min_size=250, max_size=255),
)
_ids = st.one_of(
    st.sampled_from(
        [_NUMBERS[name] for name in _HEARD if name in _NUMBERS]
        + [number for number in _LACKED if number in CRC_EXTRA]
    ),
    st.sampled_from(sorted(dialect.mavlink_map)),
)
_sources = st.one_of(
    st.just((1, 1)),
    st.just((1, 1)),
    st.sampled_from([(1, 2), (2, 1), (255, 190), (0, 0), (1, 191)]),
)


def frame_of(
    number: int,
    payload: bytes,
    source: tuple[int, int] = (1, 1),
    sequence: int = 0,
    *,
    version: int = 2,
    extra: int | None = None,
    stamp: int | None = None,
    signature: bytes = b"",
) -> bytes:
    """A frame by the MAVLink serialization guide, checked and signed by pymavlink's own means."""
    if extra is None:
        extra = _LACKED.get(number)
        extra = dialect.mavlink_map[number].crc_extra if extra is None else extra
    payload = payload[:255]
    if version == 1:
        body = struct.pack("<BBBBB", len(payload), sequence, *source, number & 0xFF) + payload
        head = b"\xfe"
    else:
        ids = struct.pack("<I", number)[:3]
        flags = 0 if stamp is None and not signature else 1
        body = struct.pack("<BBBBBB", len(payload), flags, 0, sequence, *source) + ids + payload
        head = b"\xfd"
    crc = x25crc(body)
    crc.accumulate(bytes([extra]))
    frame = head + body + struct.pack("<H", crc.crc) + signature
    if stamp is None or version == 1:
        return frame
    signer = dialect.MAVLink(None)
    signer.signing.secret_key, signer.signing.timestamp = _KEY, stamp
    signer.signing.link_id = 3
    message = dialect.MAVLink_message(number, "ANY")
    message._msgbuf = bytearray(frame)
    message.sign_packet(signer)
    return bytes(message._msgbuf)


@st.composite
def _frames(draw: Any) -> bytes:
    """A valid frame, of any message and anybody."""
    version = draw(st.sampled_from((2, 2, 2, 1)))
    number = draw(_ids)
    stamp = draw(
        st.one_of(
            st.none(),
            st.integers(-10_000_000, 10_000_000).map(lambda ticks: _STAMP + ticks),
            st.sampled_from((1, _STAMP, 2**48 - 1)),
        )
    )
    if version == 1 and number > 255:
        version = 2
    payload = draw(_payloads) or b"\0"
    sequence = draw(st.integers(0, 255))
    return frame_of(number, payload, draw(_sources), sequence, version=version, stamp=stamp)


@st.composite
def _damaged(draw: Any) -> bytes:
    """A frame with bits turned, cut, lengthened, or within another one."""
    frame = bytearray(draw(_frames()))
    match draw(st.sampled_from(("bits", "cut", "longer", "inside", "unknown", "flags"))):
        case "bits":
            for bit in draw(st.lists(st.integers(0, 8 * len(frame) - 1), min_size=1, max_size=4)):
                frame[bit // 8] ^= 1 << bit % 8
        case "cut":
            del frame[draw(st.integers(0, len(frame))) :]
        case "longer":
            at = draw(st.integers(0, len(frame)))
            frame[at:at] = draw(st.binary(min_size=1, max_size=20))
        case "inside":
            return frame_of(draw(_ids), bytes(frame))
        case "unknown":
            number = draw(st.sampled_from((70_000, 0xFFFFFF, 13)))
            return frame_of(number, bytes(frame), extra=draw(st.integers(0, 255)))
        case _:
            frame[min(2, len(frame) - 1)] |= draw(st.integers(1, 255))
    return bytes(frame)


_junk = st.binary(max_size=20).map(lambda junk: junk.translate(None, b"\xfd\xfe"))


@st.composite
def _cases(draw: Any) -> Case:
    whole = draw(st.booleans())
    piece = _frames() if whole else st.one_of(_frames(), _damaged(), _junk, st.binary(max_size=80))
    pieces = draw(st.lists(piece, max_size=12))
    return {
        "pieces": [bytes(piece).hex() for piece in pieces],
        "whole": whole,
        "streaming": draw(st.booleans()),
        "signed": draw(st.booleans()),
        "claims": draw(st.lists(st.integers(0, 11), max_size=2)),
        "cuts": draw(st.lists(st.integers(0, 2000), max_size=12)),
    }


TARGET = Target("frames", _cases(), _check)
