"""Makes standard output and error transliterate the characters that they cannot encode.

A terminal may be ASCII or Latin-1 (`LANG=C`, `PYTHONIOENCODING`), and a file name may be any bytes.
A command that flies must continue in spite of text that the output cannot show, and in spite of an
output that is closed, full or no longer read.
"""

import codecs
import io
import os
import sys
from contextlib import suppress
from pathlib import Path

from companion.files.ascii_text import ascii_for
from companion.files.write_whole import reason_of

_ERROR_HANDLER = "companion.transliterated"


def transliterate_output() -> None:
    """Make standard output and error accept any text.

    Characters that the encoding lacks are transliterated. Text for a closed stream is discarded,
    and so is text that standard error does not take, because nobody could be told of it.
    """
    codecs.register_error(_ERROR_HANDLER, _transliterated)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed, as by `>&-`
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=_ERROR_HANDLER)
    if sys.stdout is sys.__stdout__ and isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout = _Output(sys.stdout)
    if sys.stderr is sys.__stderr__ and isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr = _ErrorOutput(sys.stderr)


class _Output(io.TextIOWrapper):
    """Standard output that remembers a failed write.

    A later flush does not report the failure again if the text was longer than the buffer, or if
    there is no buffer (PYTHONUNBUFFERED, `python -u`).

    Attributes:
        failure: the first failure, or None.
    """

    failure: OSError | None = None

    def __init__(self, stream: io.TextIOWrapper) -> None:
        buffer, line_buffering = stream.buffer, stream.line_buffering
        if isinstance(buffer, io.RawIOBase):  # without a buffer, a long text may be cut off
            buffer, line_buffering = io.BufferedWriter(buffer), True
        super().__init__(buffer, stream.encoding, stream.errors, line_buffering=line_buffering)

    def write(self, text: str) -> int:
        """Write text, and remember a failure."""
        try:
            return super().write(text)
        except OSError as error:
            self.failure = self.failure or error
            raise

    def flush(self) -> None:
        """Flush, and remember a failure."""
        try:
            super().flush()
        except OSError as error:
            self.failure = self.failure or error
            raise


class _ErrorOutput(_Output):
    """Standard error: a failed write raises nothing, so it ends no command and hides no result."""

    def write(self, text: str) -> int:
        """Write text, if possible."""
        with suppress(OSError):
            super().write(text)
        return len(text)

    def flush(self) -> None:
        """Flush, if possible."""
        with suppress(OSError):
            super().flush()


def flush_output() -> str | None:
    """Flush standard output; return why some of the printed text is lost.

    After a failure, later text is discarded, so that Python does not report it again at exit.

    Returns:
        None: nothing is lost. Empty: the reader has stopped, as after `| head`. Otherwise: the
        reason.
    """
    failure: OSError | None = getattr(sys.stdout, "failure", None)
    try:
        sys.stdout.flush()
    except OSError as error:
        failure = failure or error
    if failure is None:
        return None
    with suppress(OSError, ValueError):
        null_descriptor = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null_descriptor, sys.stdout.fileno())
        os.close(null_descriptor)
    return "" if isinstance(failure, BrokenPipeError) else reason_of(failure)


def _transliterated(error: UnicodeError) -> tuple[str, int]:
    """Codec error handler: the characters that cannot be encoded, in ASCII."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return ascii_for(error.object[error.start : error.end]), error.end
