"""Writes the newest time stamps of signatures to disk while a link is open."""

import threading
from dataclasses import replace

from companion.mavlink.signing import Signing
from companion.mavlink.stamp_file import StampFile
from companion.mavlink.stamp_judge import MOST_TICKS, TICKS_PER_S, Stamps

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
