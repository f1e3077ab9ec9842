"""The newest signature time stamps on disk, one file for each key.

Source: the MAVLink message-signing guide, which demands that stamps are kept between runs.
"""

import hashlib
import json
import os
from pathlib import Path
from typing import Any

from companion.files.write_whole import write_whole
from companion.mavlink.errors import SigningError
from companion.mavlink.stamps import LATEST_TICKS, SignatureStream, Stamps

_FOLDER = Path("mavlink-companion", "signing")
_MAX_FILE_BYTES = 4_000_000
"""Largest file read, bytes; 65536 streams of one vehicle need less."""


class StampFile:
    """Time stamps in the user's state directory ($XDG_STATE_HOME, or ~/.local/state), mode 0600.

    Args:
        key: the signing key; the file's name is a hash of it, which does not reveal the key.

    Attributes:
        path: the file.

    Raises:
        SigningError: there is no state directory.
    """

    def __init__(self, key: bytes) -> None:
        name = hashlib.sha256(b"name of a time stamp file" + key).hexdigest()[:16]
        self.path = _state_directory() / _FOLDER / f"{name}.json"

    def load(self) -> tuple[Stamps, str | None]:
        """Read the stamps that were kept; never raises.

        Returns:
            The stamps, empty if there is no file; and a sentence for the user if the file cannot
            be read, else None.
        """
        try:
            with self.path.open("rb") as file:
                return _parsed(file.read(_MAX_FILE_BYTES)), None
        except FileNotFoundError:
            return Stamps(), None
        except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is damaged"
            return Stamps(), (
                f"the time stamps of signatures in {self.path} cannot be read ({reason}), so "
                "frames recorded in an earlier flight may be accepted as the vehicle's; delete "
                "that file once this computer's clock is right"
            )

    def save(self, stamps: Stamps) -> None:
        """Replace the whole file.

        Raises:
            OSError: the file cannot be written; the old one is unchanged.
        """
        self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        text = json.dumps(
            {
                "date": stamps.program_date,
                "sent": stamps.newest_sent,
                "streams": {
                    "/".join(map(str, key)): stored for key, stored in stamps.streams.items()
                },
            }
        )
        write_whole(self.path, text, mode=0o600)


def _state_directory() -> Path:
    directory = Path(os.environ.get("XDG_STATE_HOME", ""))
    if directory.is_absolute():  # the XDG standard: a relative path is ignored
        return directory
    try:
        return Path.home() / ".local" / "state"
    except RuntimeError:
        raise SigningError(
            "the time stamps of signatures cannot be kept, because there is no home directory; "
            "set XDG_STATE_HOME to a directory that can be written"
        ) from None


def _parsed(text: bytes) -> Stamps:
    stored = json.loads(text)
    streams = {
        _stream(name): tuple(_valid_ticks(stamp) for stamp in stamps)
        for name, stamps in stored["streams"].items()
    }
    return Stamps(_valid_ticks(stored["date"]), _valid_ticks(stored["sent"]), streams)


def _stream(name: str) -> SignatureStream:
    system, component, link = (int(part) for part in name.split("/"))
    return system, component, link


def _valid_ticks(value: Any) -> int:
    if type(value) is not int or not 0 <= value <= LATEST_TICKS:
        raise ValueError(value)
    return value
