"""MAVLink 2 signing on one link; pymavlink computes and verifies the signatures."""

import hashlib
import time
from collections.abc import Callable, Collection
from pathlib import Path

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.config.section import ConfigError
from sitl_mock.config.settings import SigningConfig
from sitl_mock.link.framing import SIGNED_FLAG, Message

_EPOCH_UNIX_S = 1420070400
"""Unix time at which signature timestamps (units of 10 us) begin, s: 2015-01-01 UTC."""
_TICKS_PER_S = 100_000
_FLAGS_OFFSET = 2
_MAGIC_V2 = 0xFD


def key_from_passphrase(path: Path) -> bytes:
    """Return SHA-256 of the file's first line without surrounding spaces, as ground stations do.

    Raises:
        ConfigError: the file cannot be read or is not UTF-8, or its first line is empty.
    """
    try:
        passphrase = path.read_text(encoding="utf-8").partition("\n")[0].strip()
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"mock.signing.passphrase_file: {path} cannot be read: {error}"
        ) from error
    if not passphrase:
        raise ConfigError(f"mock.signing.passphrase_file: the first line of {path} is empty")
    return hashlib.sha256(passphrase.encode()).digest()


def link_signing(
    config: SigningConfig | None, link: str, *, unsigned_links: Collection[str] = ()
) -> "Signing | None":
    """Return the signing of a link (``companion`` or ``gcs``), None if there is none.

    On ``unsigned_links`` the autopilot accepts unsigned frames by default.

    Raises:
        ConfigError: the passphrase cannot be used.
    """
    if config is None:
        return None
    link_id = config.link_id + (link == "gcs")
    key = key_from_passphrase(config.passphrase_file)
    requested = config.accept_unsigned
    return Signing(
        key, link_id, accept_unsigned=link in unsigned_links if requested is None else requested
    )


class Signing:
    """Signs outgoing frames of one link, and verifies incoming ones.

    Timestamps follow the wall clock, not vehicle time, because the other side compares them with
    its wall clock.

    Attributes:
        accepted_count: number of frames with a valid signature and a newer time stamp than all
            earlier ones of their stream (system, component, link id).
        unsigned_count: number of frames without a signature, whether accepted or not.
        refused_count: number of frames signed with another key, replayed, or (on a stream not heard
            before) more than a minute older than the newest time stamp.

    Args:
        key: 32 bytes.
        link_id: id of this link in our signatures, 0..255.
        accept_unsigned: whether to accept frames without a signature.
        clock: unix time in s.
    """

    def __init__(
        self,
        key: bytes,
        link_id: int,
        *,
        accept_unsigned: bool,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self.accepted_count = self.unsigned_count = self.refused_count = 0
        self._accept_unsigned = accept_unsigned
        self._clock = clock
        self._mav = dialect.MAVLink(None)
        self._mav.signing.secret_key = key
        self._mav.signing.link_id = link_id

    def sign(self, frame: bytes) -> bytes:
        """Return a frame of `Framer(signed=True)` with its signature."""
        self._update_timestamp()
        packet = dialect.MAVLink_message(0, "")
        packet._msgbuf = bytearray(frame)
        packet.sign_packet(self._mav)
        return bytes(packet.get_msgbuf())

    def accepts(self, message: Message) -> bool:
        """Whether a received message is accepted; also count it in the attributes."""
        frame = bytearray(message.get_msgbuf())
        if frame[0] != _MAGIC_V2 or not frame[_FLAGS_OFFSET] & SIGNED_FLAG:
            self.unsigned_count += 1
            return self._accept_unsigned
        self._update_timestamp()
        old_timestamps = dict(self._mav.signing.stream_timestamps)
        if self._mav.check_signature(frame, message.get_srcSystem(), message.get_srcComponent()):
            self.accepted_count += 1
            return True
        # pymavlink stores the timestamp before it verifies the signature. We restore the old one,
        # else a forged future timestamp would lock out the true sender.
        self._mav.signing.stream_timestamps = old_timestamps
        self.refused_count += 1
        return False

    def counts(self) -> dict[str, int]:
        """Return the numbers of ``accepted``, ``unsigned`` and ``refused`` frames."""
        return {
            "accepted": self.accepted_count,
            "unsigned": self.unsigned_count,
            "refused": self.refused_count,
        }

    def _update_timestamp(self) -> None:
        now = int((self._clock() - _EPOCH_UNIX_S) * _TICKS_PER_S)
        self._mav.signing.timestamp = max(self._mav.signing.timestamp, now)
