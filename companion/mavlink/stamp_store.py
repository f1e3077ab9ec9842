"""The newest signature time stamps on disk: one file for each key, written while a link is open.

The file does not reveal the key. Source: the MAVLink message-signing guide, which asks that the
stamps outlive the program.
"""

import hashlib
import json
import os
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

from companion.mavlink.errors import SigningError
from companion.mavlink.signing import Signing
from companion.mavlink.stamps import MOST_TICKS, TICKS_PER_S, Stamps, Stream

_FOLDER = Path("mavlink-companion", "signing")
_MOST_BYTES = 1_000_000
"""Above what 65536 streams of one vehicle take. Larger is no file of ours."""


class StampFile:
    """Time stamps in the user's state directory ($XDG_STATE_HOME, or ~/.local/state), mode 0600.

    Args:
        key: Whose stamps; the file's name is a hash of it.

    Attributes:
        path: The file.

    Raises:
        SigningError: There is no state directory.
    """

    def __init__(self, key: bytes) -> None:
        name = hashlib.sha256(b"name of a time stamp file" + key).hexdigest()[:16]
        self.path = _state_directory() / _FOLDER / f"{name}.json"

    def load(self) -> tuple[Stamps, str | None]:
        """What is kept, and what is to be told if that cannot be read. Never raises."""
        try:
            with self.path.open("rb") as file:
                return _parsed(file.read(_MOST_BYTES)), None
        except FileNotFoundError:
            return Stamps(), None
        except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is damaged"
            return Stamps(), (
                f"the time stamps of signatures in {self.path} cannot be read ({reason}), so a "
                "recording of an earlier flight may be taken for the vehicle; delete that file "
                "once this computer's clock is right"
            )

    def save(self, stamps: Stamps) -> None:
        """Replace the file as a whole.

        Raises:
            OSError: It cannot be written; the old one is as it was.
        """
        self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        text = json.dumps(
            {
                "date": stamps.date,
                "sent": stamps.sent,
                "streams": {"/".join(map(str, key)): kept for key, kept in stamps.streams.items()},
            }
        )
        beside = self.path.with_suffix(f".{os.getpid()}")
        try:
            opened = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
            with os.fdopen(opened, "w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            beside.replace(self.path)
        except OSError:
            beside.unlink(missing_ok=True)
            raise


def _state_directory() -> Path:
    named = Path(os.environ.get("XDG_STATE_HOME", ""))
    if named.is_absolute():  # the standard: any other is to be ignored
        return named
    try:
        return Path.home() / ".local" / "state"
    except RuntimeError:
        raise SigningError(
            "time stamps of signatures have no place: there is no home directory; set "
            "XDG_STATE_HOME to a directory that can be written"
        ) from None


def _parsed(text: bytes) -> Stamps:
    told = json.loads(text)
    streams = {
        _stream(name): tuple(_ticks(stamp) for stamp in stamps)
        for name, stamps in told["streams"].items()
    }
    return Stamps(_ticks(told["date"]), _ticks(told["sent"]), streams)


def _stream(name: str) -> Stream:
    system, component, link = (int(part) for part in name.split("/"))
    return system, component, link


def _ticks(value: Any) -> int:
    if type(value) is not int or not 0 <= value <= MOST_TICKS:
        raise ValueError(value)
    return value


PERIOD_S = 10.0
"""The guide asks for once a minute. A shorter time costs less where the program is killed."""
_RESERVE = 15 * TICKS_PER_S
"""While the link is open the file is ahead of the truth by more than a period: after a kill our
stamps still rise, and nothing that was heard before it is heard again. The vehicle, too, is refused
until its stamps are past that, for 15 s at most."""
_LAST_WRITE_S = 2.0


class StampKeeper:
    """A thread that writes every 10 s, at a new stream, and at the end.

    The event loop never waits for a disk. What fails is told once, in `Signing.remarks`.

    Args:
        signing: Whose stamps; it names the file.
        file: Where to.
    """

    def __init__(self, signing: Signing, file: StampFile) -> None:
        self._signing, self._file = signing, file
        self._ended = self._failed = False
        self._thread = threading.Thread(target=self._run, name="time stamps", daemon=True)

    def start(self) -> None:
        """Write now and from now on."""
        self._thread.start()

    def stop(self) -> None:
        """Write the last stamps; a disk that does not answer is left after 2 s."""
        if self._thread.ident is None:
            return  # not started
        self._ended = True
        self._signing.changed.set()
        self._thread.join(_LAST_WRITE_S)

    def _run(self) -> None:
        while not self._ended:
            self._signing.changed.clear()
            self._write(_ahead(self._signing.stamps()))
            if not self._ended:
                self._signing.changed.wait(PERIOD_S)
        self._write(self._signing.stamps())

    def _write(self, stamps: Stamps) -> None:
        try:
            # Streams of another vehicle with this key belong to another program.
            others = self._file.load()[0].streams
            self._file.save(replace(stamps, streams=others | stamps.streams))
        except OSError as error:
            if not self._failed:
                self._failed = True
                self._signing.remarks.append(
                    f"the time stamps of signatures cannot be kept in {self._file.path} "
                    f"({error.strerror}), so after the next start a recording of this flight may "
                    "be taken for the vehicle; make room there, or set XDG_STATE_HOME to a "
                    "directory that can be written"
                )


def _ahead(stamps: Stamps) -> Stamps:
    streams = {
        stream: tuple(min(stamp + _RESERVE, MOST_TICKS) for stamp in newest)
        for stream, newest in stamps.streams.items()
    }
    return replace(stamps, sent=min(stamps.sent + _RESERVE, MOST_TICKS), streams=streams)
