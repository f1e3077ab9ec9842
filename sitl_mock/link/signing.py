"""MAVLink 2 signing on one link; pymavlink makes and judges the signatures."""

import hashlib
import time
from collections.abc import Callable, Collection
from pathlib import Path

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.config.section import ConfigError
from sitl_mock.config.settings import SigningConfig
from sitl_mock.link.framing import SIGNED, Message

_EPOCH_UNIX_S = 1420070400
"""Stamps count 10 us since 2015-01-01 UTC."""
_TICKS_PER_S = 100_000
_FLAGS_AT = 2
_MAGIC_V2 = 0xFD


def key_from_passphrase(path: Path) -> bytes:
    """Return SHA-256 of the file's first line, as ground stations make a key.

    Raises:
        ConfigError: the file cannot be read, or its first line is empty.
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

    Args:
        config: what the user asks for.
        link: its name.
        unsigned_links: where the autopilot obeys frames without a signature by itself.

    Raises:
        ConfigError: the passphrase cannot be used.
    """
    if config is None:
        return None
    link_id = config.link_id + (link == "gcs")
    key = key_from_passphrase(config.passphrase_file)
    asked = config.accept_unsigned
    return Signing(key, link_id, accept_unsigned=link in unsigned_links if asked is None else asked)


class Signing:
    """Signs what leaves on one link, and judges what arrives on it.

    Stamps are of the wall clock even where vehicle time is another, as the other side judges them
    by its own.

    Attributes:
        accepted: frames rightly signed and newer than all before them of their sender.
        unsigned: frames without a signature.
        refused: frames signed with another key, or played again.

    Args:
        key: 32 bytes.
        link_id: number of this link in our signatures, 0..255.
        accept_unsigned: obey frames without a signature, too.
        clock: Unix time in s.
    """

    def __init__(
        self,
        key: bytes,
        link_id: int,
        *,
        accept_unsigned: bool,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self.accepted = self.unsigned = self.refused = 0
        self._accept_unsigned = accept_unsigned
        self._clock = clock
        self._mav = dialect.MAVLink(None)
        self._mav.signing.secret_key = key
        self._mav.signing.link_id = link_id

    def sign(self, frame: bytes) -> bytes:
        """Return a frame of `Framer(signed=True)` with its signature."""
        self._look_at_clock()
        carrier = dialect.MAVLink_message(0, "")
        carrier._msgbuf = bytearray(frame)
        carrier.sign_packet(self._mav)
        return bytes(carrier.get_msgbuf())

    def accepts(self, message: Message) -> bool:
        """Whether a message that arrived may be obeyed; counts it."""
        frame = bytearray(message.get_msgbuf())
        if frame[0] != _MAGIC_V2 or not frame[_FLAGS_AT] & SIGNED:
            self.unsigned += 1
            return self._accept_unsigned
        self._look_at_clock()
        before = dict(self._mav.signing.stream_timestamps)
        if self._mav.check_signature(frame, message.get_srcSystem(), message.get_srcComponent()):
            self.accepted += 1
            return True
        # pymavlink keeps a stamp before it looks at the signature; kept, a forger's could silence
        # the true sender.
        self._mav.signing.stream_timestamps = before
        self.refused += 1
        return False

    def counts(self) -> dict[str, int]:
        """Return how many frames arrived ``accepted``, ``unsigned`` and ``refused``."""
        return {
            "accepted": self.accepted,
            "unsigned": self.unsigned,
            "refused": self.refused,
        }

    def _look_at_clock(self) -> None:
        now = int((self._clock() - _EPOCH_UNIX_S) * _TICKS_PER_S)
        self._mav.signing.timestamp = max(self._mav.signing.timestamp, now)
