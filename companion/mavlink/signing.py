"""MAVLink 2 message signing: ours put on, theirs demanded.

Source: the MAVLink message-signing guide. A signature is the first 48 bits of
SHA-256(key + frame + link id + time stamp); the stamp counts 10 us since 2015-01-01 UTC.
"""

import hashlib
import hmac
import re
import time
from collections.abc import Callable
from enum import Enum
from pathlib import Path

from companion.mavlink.errors import SigningError
from companion.mavlink.framing import SIGNATURE_LENGTH, Frame

_EPOCH_UNIX_S = 1420070400
_TICKS_PER_S = 100_000
_NEW_STREAM_WINDOW = 60 * _TICKS_PER_S
_STAMP_BYTES = 6
_HASH_BYTES = 6


def key_from_hex(text: str) -> bytes:
    """A key from 64 hexadecimal digits.

    Raises:
        SigningError: The text is anything else.
    """
    if not re.fullmatch(r"[0-9a-fA-F]{64}", text.strip()):
        raise SigningError("a signing key is 64 hexadecimal digits (32 bytes)")
    return bytes.fromhex(text.strip())


def key_from_passphrase_file(path: Path) -> bytes:
    """SHA-256 of the file's first line, as ground stations make a key from a passphrase.

    Raises:
        SigningError: The file cannot be read or its first line is empty.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SigningError(f"the passphrase file {path} cannot be read: {error}") from error
    if not lines or not lines[0].strip():
        raise SigningError(f"the first line of the passphrase file {path} is empty")
    return hashlib.sha256(lines[0].strip().encode()).digest()


class Verdict(Enum):
    """What a signature is worth."""

    GOOD = "signed with our key, and newer than all before it on its stream"
    UNSIGNED = "not signed"
    WRONG_KEY = "signed with another key"
    REPLAYED = "not newer than what came before: repeated on the way, or a recording"


class Signing:
    """Signs our frames and judges theirs.

    Args:
        key: 32 bytes shared with the vehicle.
        link_id: Number of this link in our signatures, 0..255.
        clock: Unix time in s. Our stamps only ever rise, even if it is set back.

    Raises:
        SigningError: The key is not 32 bytes.
    """

    def __init__(
        self, key: bytes, link_id: int = 0, clock: Callable[[], float] = time.time
    ) -> None:
        if len(key) != 32:
            raise SigningError(f"a signing key has 32 bytes, not {len(key)}")
        self._key = key
        self._link = bytes([link_id])
        self._clock = clock
        self._stamp = 0
        self._streams: dict[tuple[int, int, int], int] = {}

    def sign(self, frame: bytes) -> bytes:
        """Add the signature to a frame built with `signed=True`."""
        self._stamp = max(self._stamp + 1, self._now())
        tail = self._link + self._stamp.to_bytes(_STAMP_BYTES, "little")
        return frame + tail + self._hash(frame + tail)

    def judge(self, frame: Frame) -> Verdict:
        """Judge a frame; only a good one moves what is kept of its stream."""
        if not frame.signed:
            return Verdict.UNSIGNED
        signature = frame.raw[-SIGNATURE_LENGTH:]
        if not hmac.compare_digest(signature[-_HASH_BYTES:], self._hash(frame.raw[:-_HASH_BYTES])):
            return Verdict.WRONG_KEY
        stamp = int.from_bytes(signature[1 : 1 + _STAMP_BYTES], "little")
        stream = (frame.system, frame.component, signature[0])
        # A stream not heard before may lag our clock by a minute at most, or a recording of an
        # old flight could be played to us.
        oldest = self._streams.get(stream, max(self._stamp, self._now()) - _NEW_STREAM_WINDOW)
        if stamp <= oldest:
            return Verdict.REPLAYED
        self._streams[stream] = stamp
        self._stamp = max(self._stamp, stamp)
        return Verdict.GOOD

    def _now(self) -> int:
        return int((self._clock() - _EPOCH_UNIX_S) * _TICKS_PER_S)

    def _hash(self, data: bytes) -> bytes:
        return hashlib.sha256(self._key + data).digest()[:_HASH_BYTES]
