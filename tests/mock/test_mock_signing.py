"""Signed frames in and out of the mock; pymavlink's own signing is the other side."""

import hashlib

import pytest
from mock_rig import Rig
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.config.section import ConfigError
from sitl_mock.config.settings import SigningConfig
from sitl_mock.link.framing import decode
from sitl_mock.link.signing import Signing, key_from_passphrase, link_signing

PASSPHRASE = "a passphrase"
KEY = hashlib.sha256(PASSPHRASE.encode()).digest()
NOW = 1_800_000_000.0
TICKS = round((NOW - 1420070400) * 100_000)
ARM = dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, *[0.0] * 6)


def signer(key=KEY, ticks=None, link_id=7):
    mav = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    mav.signing.secret_key, mav.signing.link_id = key, link_id
    mav.signing.timestamp = TICKS if ticks is None else ticks
    mav.signing.sign_outgoing = True
    return mav


def packed(mav, number=0):
    [message] = decode(bytes(dialect.MAVLink_ping_message(number, number, 0, 0).pack(mav)))
    return message


def ours(**options):
    return Signing(KEY, 3, accept_unsigned=False, clock=lambda: NOW, **options)


def test_what_it_signs_pymavlink_accepts(tmp_path):
    (tmp_path / "phrase").write_text(PASSPHRASE + "\nand more\n")
    rig = Rig(boot=False, signing={"passphrase_file": tmp_path / "phrase", "link_id": 5})
    judge = dialect.MAVLink(None)
    judge.signing.secret_key = KEY
    rig.simulation.boot()
    frames = rig.simulation.companion.take_frames()
    assert len(frames) > 5
    for frame in frames:
        assert judge.decode(bytearray(frame)).get_link_id() == 5
    assert judge.signing.goodsig_count == len(frames)


def test_it_admits_each_frame_of_the_right_key_once():
    signing, mav = ours(), signer()
    first, second = packed(mav, 1), packed(mav, 2)
    assert signing.accepts(first)
    assert signing.accepts(second)
    assert not signing.accepts(second)
    assert not signing.accepts(first)
    assert signing.counts() == {"accepted": 2, "unsigned": 0, "refused": 2}


def test_another_key_or_none_is_refused_and_an_old_recording_too():
    signing = ours()
    assert not signing.accepts(packed(signer(bytes(32))))
    assert not signing.accepts(packed(signer(ticks=TICKS - 61 * 100_000)))
    unsigned = packed(dialect.MAVLink(None, srcSystem=255, srcComponent=190))
    assert not signing.accepts(unsigned)
    assert signing.counts() == {"accepted": 0, "unsigned": 1, "refused": 2}


def test_a_forged_stamp_does_not_silence_the_true_sender():
    signing = ours()
    assert not signing.accepts(packed(signer(bytes(32), ticks=TICKS + 10**9)))
    assert signing.accepts(packed(signer()))


def test_streams_have_stamps_of_their_own():
    signing = ours()
    assert signing.accepts(packed(signer(ticks=TICKS + 50, link_id=1)))
    assert signing.accepts(packed(signer(ticks=TICKS + 10, link_id=2)))


def test_unsigned_frames_may_be_asked_for_wrongly_signed_ones_never():
    signing = Signing(KEY, 0, accept_unsigned=True, clock=lambda: NOW)
    assert signing.accepts(packed(dialect.MAVLink(None, srcSystem=255, srcComponent=190)))
    assert not signing.accepts(packed(signer(bytes(32))))


def test_only_what_is_signed_arms_the_vehicle(tmp_path):
    (tmp_path / "phrase").write_text(PASSPHRASE)
    rig = Rig(boot=False, prearm_delay_s=0.2, signing={"passphrase_file": tmp_path / "phrase"})
    rig.run(0.4)
    clock = rig.simulation.companion.signing._clock
    ticks = int((clock() - 1420070400) * 100_000)
    for mav, armed in (
        (dialect.MAVLink(None, srcSystem=255, srcComponent=190), False),
        (signer(bytes(32), ticks=ticks), False),
        (signer(ticks=ticks), True),
    ):
        [message] = decode(bytes(ARM.pack(mav)))
        rig.simulation.handle(message, rig.simulation.companion)
        assert rig.state.armed is armed


def test_ardupilot_obeys_what_is_unsigned_on_its_first_link_only(tmp_path):
    """Measured: on SERIAL0 (TCP 5760) an unsigned command is obeyed, on 5762 it is not."""
    (tmp_path / "phrase").write_text(PASSPHRASE)
    for asked, obeyed in (({}, [True, False]), ({"accept_unsigned": False}, [False, False])):
        signing = {"passphrase_file": tmp_path / "phrase", **asked}
        rig = Rig(boot=False, autopilot="ardupilot", gcs_port=14550, signing=signing)
        unsigned = ARM.pack(dialect.MAVLink(None, srcSystem=255, srcComponent=190))
        [message] = decode(bytes(unsigned))
        assert [link.signing.accepts(message) for link in rig.simulation.links] == obeyed


def test_a_passphrase_that_cannot_be_used_is_one_clear_error(tmp_path):
    assert link_signing(None, "companion") is None
    with pytest.raises(ConfigError, match="cannot be read"):
        link_signing(SigningConfig(passphrase_file=tmp_path / "none"), "companion")
    (tmp_path / "empty").write_text("\n")
    with pytest.raises(ConfigError, match="first line"):
        key_from_passphrase(tmp_path / "empty")
