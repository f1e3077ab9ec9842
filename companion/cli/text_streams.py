"""Makes standard output and error transliterate the characters that they cannot encode.

A terminal may be ASCII or Latin-1 (`LANG=C`, `PYTHONIOENCODING`), and a file name may be any bytes.
Neither may end a command that flies.
"""

import codecs
import io
import sys

from companion.files.ascii_text import ascii_for

_HANDLER = "companion.transliterated"


def print_anything() -> None:
    """Make standard output and error transliterate."""
    codecs.register_error(_HANDLER, _transliterated)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # None where it is closed
            stream.reconfigure(errors=_HANDLER)


def _transliterated(error: UnicodeError) -> tuple[str, int]:
    """Codec error handler: the characters that cannot be encoded, in ASCII."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return ascii_for(error.object[error.start : error.end]), error.end
