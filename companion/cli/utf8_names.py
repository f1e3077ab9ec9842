"""Reads file names as UTF-8 where the locale knows only ASCII.

With `LC_ALL=C`, `PYTHONCOERCECLOCALE=0` and `PYTHONUTF8=0`, as some service managers and shells set
them, Python cannot name a file `flüge` that a configuration names.
"""

import os
import sys


def use_utf8_names() -> None:
    """Start this process again in Python's UTF-8 mode if its file names are ASCII.

    The encoding of the output stays. If the process cannot be started again, it goes on.
    """
    if sys.getfilesystemencoding() not in ("ascii", "us-ascii") or not sys.executable:
        return
    encoding = os.environ.get("PYTHONIOENCODING") or getattr(sys.stdout, "encoding", None)
    environment = {**os.environ, "PYTHONUTF8": "1", "PYTHONIOENCODING": encoding or "ascii"}
    try:
        os.execve(sys.executable, [sys.executable, "-X", "utf8", *sys.orig_argv[1:]], environment)
    except OSError:
        return
