"""Signing: pymavlink judges ours, ours judges pymavlink's, and nothing else gets in."""

import asyncio
import hashlib

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.attitude import BodyRates
from companion.mavlink.errors import LinkTimeout, SigningError
from companion.mavlink.framing import FrameScanner
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import Signing, key_from_passphrase_file
from companion.mavlink.stamps import SignatureResult
from companion.vehicle.link import Link
from tests.mavlink.fakes import FakeVehicle, attitude, heartbeat, linked

KEY = bytes(range(32))
NOW = 1_800_000_000.0
TICKS = round((NOW - 1420070400) * 100_000)


def signer(key=KEY, ticks=TICKS, link_id=3):
    mav = dialect.MAVLink(None, 1, 1)
    mav.signing.secret_key, mav.signing.link_id = key, link_id
    mav.signing.timestamp, mav.signing.sign_outgoing = ticks, True
    return mav


def frame_of(packed):
    [frame] = FrameScanner().feed(packed)
    return frame


def signing(now=NOW):
    return Signing(KEY, clock=lambda: now, monotonic_clock=lambda: 0.0)


def test_pymavlinks_signature_is_accepted_once():
    ours = signing()
    mav = signer()
    first, second = (frame_of(heartbeat().pack(mav)) for _ in range(2))
    assert first.signed
    assert ours.check(first) is SignatureResult.GOOD
    assert ours.check(second) is SignatureResult.GOOD
    assert ours.check(second) is SignatureResult.REPLAYED
    assert ours.check(first) is SignatureResult.REPLAYED


def test_another_key_a_changed_byte_and_no_signature_are_refused():
    ours = signing()
    assert ours.check(frame_of(heartbeat().pack(signer(bytes(32))))) is SignatureResult.WRONG_KEY
    unsigned = frame_of(heartbeat().pack(dialect.MAVLink(None, 1, 1)))
    assert ours.check(unsigned) is SignatureResult.UNSIGNED
    packed = bytearray(heartbeat().pack(signer()))
    packed[-1] ^= 1
    assert ours.check(frame_of(bytes(packed))) is SignatureResult.WRONG_KEY


def test_a_forged_stamp_does_not_silence_the_true_sender():
    ours = signing()
    forged = frame_of(heartbeat().pack(signer(bytes(32), ticks=TICKS + 10**9)))
    assert ours.check(forged) is SignatureResult.WRONG_KEY
    assert ours.check(frame_of(heartbeat().pack(signer()))) is SignatureResult.GOOD


def test_a_recording_of_an_old_flight_is_refused():
    def played(seconds):
        return signing().check(frame_of(heartbeat().pack(signer(ticks=TICKS - seconds * 100_000))))

    assert played(61) is SignatureResult.REPLAYED
    assert played(59) is SignatureResult.GOOD


def test_streams_are_kept_apart():
    ours = signing()
    for ticks, link_id in ((TICKS + 50, 1), (TICKS + 10, 2)):
        frame = frame_of(heartbeat().pack(signer(ticks=ticks, link_id=link_id)))
        assert ours.check(frame) is SignatureResult.GOOD


def test_our_stamps_rise_even_when_no_time_passes():
    ours = Signing(KEY, clock=lambda: NOW, monotonic_clock=lambda: 0.0)
    stamps = [int.from_bytes(ours.sign(b"x")[2:8], "little") for _ in range(3)]
    assert stamps == [TICKS, TICKS + 1, TICKS + 2]


def test_keys(tmp_path):
    phrase = tmp_path / "phrase"
    phrase.write_text("open sesame\n")
    assert key_from_passphrase_file(phrase) == hashlib.sha256(b"open sesame").digest()
    with pytest.raises(SigningError, match="cannot be read"):
        key_from_passphrase_file(tmp_path / "missing")
    phrase.write_text("\n")
    with pytest.raises(SigningError, match="empty"):
        key_from_passphrase_file(phrase)
    with pytest.raises(SigningError, match="32 bytes"):
        Signing(b"short")


async def test_a_signed_link_end_to_end():
    settings = LinkSettings(endpoint="udpin://127.0.0.1:0", signing=signing())
    async with Link(settings) as link:
        vehicle = await FakeVehicle(link.local_address).open_udp()
        vehicle.mav = signer()
        checked = signer()
        vehicle._parser.signing = checked.signing
        vehicle.send(heartbeat())
        await link.wait_connected(5.0)
        link.on_attitude = lambda sample: link.send_setpoint(
            sample.time_boot_ms, BodyRates(0.1, 0.2, 0.3), 0.5
        )
        vehicle.send(attitude(4))
        [setpoint] = await vehicle.hears("SET_ATTITUDE_TARGET")
        assert setpoint.get_signed()
        assert (setpoint.time_boot_ms, setpoint.thrust) == (4, 0.5)
        vehicle.close()


async def test_an_unsigned_vehicle_is_refused_and_that_is_said_once(caplog):
    settings = LinkSettings(endpoint="udpin://127.0.0.1:0", signing=signing())
    async with Link(settings) as link:
        vehicle = await FakeVehicle(link.local_address).open_udp()
        vehicle.send(heartbeat(), heartbeat(), heartbeat())
        with pytest.raises(LinkTimeout, match="3 frames that are not signed with the key"):
            await link.wait_connected(0.1)
        vehicle.close()
    assert caplog.text.count("same key") == 1


async def test_without_a_key_signed_frames_are_heard_too():
    async with linked() as (link, vehicle):
        vehicle.mav = signer()
        heard = asyncio.Event()
        link.on_attitude = lambda sample: heard.set()
        vehicle.send(attitude(4))
        async with asyncio.timeout(5.0):
            await heard.wait()
