"""MAVLink 2 message signing: signs frames, checks signatures, and keeps the newest time stamps.

Source: the MAVLink message-signing guide. A signature is the first 48 bits of
SHA-256(key + frame + link id + time stamp); the time stamp counts 10 us since 2015-01-01 UTC.
"""

import hashlib
import hmac
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from companion.mavlink.errors import SigningError
from companion.mavlink.framing import SIGNATURE_LENGTH, Frame
from companion.mavlink.stamp_file import StampFile
from companion.mavlink.stamps import (
    LATEST_TICKS,
    TICKS_PER_S,
    SignatureResult,
    StampChecker,
    Stamps,
)

_STAMP_BYTES = 6
_HASH_BYTES = 6

_ID_BYTES = slice(7, 10)  # of a version 2 frame
_PAYLOAD_OFFSET = 10
_TIMESYNC_ID = 111
_TIMESYNC_ID_BYTES = _TIMESYNC_ID.to_bytes(3, "little")
_MAX_REQUESTS = 16  # TIMESYNC requests whose answers are recognised

WRITE_PERIOD_S = 10.0
"""Time between two writes of the stamps, s. MAVLink's guide demands one write a minute."""
_STAMP_RESERVE = 15 * TICKS_PER_S
"""Time added to the newest stamps in the file while the link is open, ticks.

The reserve is longer than `WRITE_PERIOD_S`. So even if this program is killed, its next run sends
newer stamps, and refuses recorded frames of this run. The next run also refuses the vehicle's
frames until their stamps are newer than the stamps in the file, for 15 s at most.
"""
_LAST_WRITE_TIMEOUT_S = 2.0
"""Time allowed for the last write of the stamps, s."""


def key_from_passphrase_file(path: Path) -> bytes:
    """Make a key from a passphrase as ground stations do: SHA-256 of the file's first line.

    Blanks at both ends of the line do not count.

    Raises:
        SigningError: the file cannot be read or its first line is empty.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SigningError(f"the passphrase file {path} cannot be read: {error}") from error
    if not lines or not lines[0].strip():
        raise SigningError(f"the first line of the passphrase file {path} is empty")
    return hashlib.sha256(lines[0].strip().encode()).digest()


class Signing:
    """Signs frames that are sent, and checks the signatures of frames received.

    Args:
        key: 32 bytes shared with the vehicle.
        link_id: link id in the signatures that are sent, 0..255.
        clock: returns Unix time in s; called once, at the start.
        monotonic_clock: returns monotonic time in s, by which the stamps advance after the start.

    Attributes:
        file: keeps the newest stamps from one run to the next; `None`: they are not kept.
        remarks: sentences about time stamps for the user; the code that shows them removes them.
        write_requested: set when the time stamps should be written to the file soon.
        needs_timesync_answer: whether the last frame was refused only because its time stamp is far
            ahead of this program's date. The vehicle can prove the stamp by answering a TIMESYNC
            request.

    Raises:
        SigningError: the key is not 32 bytes.
    """

    def __init__(
        self,
        key: bytes,
        link_id: int = 0,
        clock: Callable[[], float] = time.time,
        monotonic_clock: Callable[[], float] = time.monotonic,
        file: StampFile | None = None,
    ) -> None:
        if len(key) != 32:
            raise SigningError(f"a signing key has 32 bytes, not {len(key)}")
        self._key = key
        self._link_id = bytes([link_id])
        self.file = file
        stored_stamps, load_error = file.load() if file is not None else (Stamps(), None)
        self._stamp_checker = StampChecker(stored_stamps, clock, monotonic_clock)
        self.remarks = self._stamp_checker.remarks
        self.write_requested = self._stamp_checker.write_requested
        if load_error is not None:
            self.remarks.append(load_error)
        self._newest_stamp = stored_stamps.newest_sent
        self._timesync_requests: deque[bytes] = deque(maxlen=_MAX_REQUESTS)
        self.needs_timesync_answer = False

    def sign(self, frame: bytes) -> bytes:
        """Append the signature to a frame built with `signed=True`."""
        self._newest_stamp = max(self._newest_stamp + 1, self._stamp_checker.program_date())
        if frame[_ID_BYTES] == _TIMESYNC_ID_BYTES:
            tc1, ts1 = _timesync_fields(frame[_PAYLOAD_OFFSET : _PAYLOAD_OFFSET + frame[1]])
            if not any(tc1):
                self._timesync_requests.append(ts1)
        signature_start = self._link_id + self._newest_stamp.to_bytes(_STAMP_BYTES, "little")
        return frame + signature_start + self._hash(frame + signature_start)

    def check(self, frame: Frame) -> SignatureResult:
        """Check the signature of a frame; only a good one updates the stamps of its stream."""
        self.needs_timesync_answer = False
        if not frame.signed:
            return SignatureResult.UNSIGNED
        signature = frame.raw[-SIGNATURE_LENGTH:]
        if not hmac.compare_digest(signature[-_HASH_BYTES:], self._hash(frame.raw[:-_HASH_BYTES])):
            return SignatureResult.WRONG_KEY
        stamp = int.from_bytes(signature[1 : 1 + _STAMP_BYTES], "little")
        stream = (frame.system, frame.component, signature[0])
        answers_timesync = self._answers_timesync(frame)
        result = self._stamp_checker.check(stream, stamp, answers_timesync=answers_timesync)
        if result is SignatureResult.GOOD:
            self._newest_stamp = max(self._newest_stamp, stamp)
        elif (
            result is SignatureResult.DATED_TOO_FAR_AHEAD
            and self._stamp_checker.timesync_answer_would_prove(stamp)
        ):
            # The vehicle would ignore a request with a stamp older than those it has seen.
            self._newest_stamp = max(self._newest_stamp, stamp)
            self.needs_timesync_answer = True
        return result

    def stamps(self) -> Stamps:
        """The stamps of this run, to be written to the file; called by another thread."""
        return Stamps(
            self._stamp_checker.program_date(), self._newest_stamp, self._stamp_checker.streams()
        )

    def _answers_timesync(self, frame: Frame) -> bool:
        """Whether a frame answers a TIMESYNC request of this run, which no recording can do."""
        if frame.message_id != _TIMESYNC_ID:
            return False
        tc1, ts1 = _timesync_fields(frame.payload)
        return any(tc1) and any(ts1) and ts1 in self._timesync_requests

    def _hash(self, data: bytes) -> bytes:
        return hashlib.sha256(self._key + data).digest()[:_HASH_BYTES]


def _timesync_fields(payload: bytes) -> tuple[bytes, bytes]:
    """Fields tc1 and ts1 of TIMESYNC; tc1 is zero in a request, and an answer repeats ts1."""
    padded = payload.ljust(16, b"\0")
    return padded[:8], padded[8:16]


class StampWriter:
    """Writes the stamps every 10 s, when a new stream is heard, and at the end, in a thread.

    So the event loop never waits for a disk. A failure is reported once, in `Signing.remarks`.
    """

    def __init__(self, signing: Signing, file: StampFile) -> None:
        self._signing, self._file = signing, file
        self._is_ending = self._failure_reported = False
        self._thread = threading.Thread(target=self._run, name="time stamps", daemon=True)

    def start(self) -> None:
        """Start writing; the first write is now."""
        self._thread.start()

    def stop(self) -> None:
        """Write the last stamps; wait 2 s at most for the disk."""
        if self._thread.ident is None:
            return  # not started
        self._is_ending = True
        self._signing.write_requested.set()
        self._thread.join(_LAST_WRITE_TIMEOUT_S)

    def _run(self) -> None:
        while not self._is_ending:
            self._signing.write_requested.clear()
            self._write(_with_reserve(self._signing.stamps()))
            if not self._is_ending:
                self._signing.write_requested.wait(WRITE_PERIOD_S)
        self._write(self._signing.stamps())

    def _write(self, stamps: Stamps) -> None:
        try:
            # The file may also hold streams that other programs heard, of vehicles with this key.
            stored_streams = self._file.load()[0].streams
            self._file.save(replace(stamps, streams=stored_streams | stamps.streams))
        except OSError as error:
            if not self._failure_reported:
                self._failure_reported = True
                self._signing.remarks.append(
                    f"the time stamps of signatures cannot be written to {self._file.path} "
                    f"({error.strerror}), so after the next start a recording of this flight may "
                    "be accepted as the vehicle; free space there, or set XDG_STATE_HOME to a "
                    "directory that can be written"
                )


def _with_reserve(stamps: Stamps) -> Stamps:
    streams = {
        stream: tuple(min(stamp + _STAMP_RESERVE, LATEST_TICKS) for stamp in newest)
        for stream, newest in stamps.streams.items()
    }
    return replace(
        stamps, newest_sent=min(stamps.newest_sent + _STAMP_RESERVE, LATEST_TICKS), streams=streams
    )
