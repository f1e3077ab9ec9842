"""The message for an endpoint of clients that cannot be opened."""

import errno

from companion.files.os_errors import reason_of
from companion.mavlink.errors import EndpointError

_HINTS = {
    errno.EADDRINUSE: "the port is in use by another program; end it or choose another port",
    errno.EACCES: "not permitted; use a port of 1024 or above",
    errno.EPERM: "not permitted; use a port of 1024 or above",
    errno.EADDRNOTAVAIL: "no interface of this computer has that address",
}


def refusal(where: str, error: OSError | EndpointError) -> str:
    """The message for an endpoint of `serve.clients` that cannot be opened."""
    if isinstance(error, EndpointError):
        hint = str(error)
    else:
        hint = _HINTS.get(error.errno or 0, reason_of(error))
    return f"serve.clients: {where}: {hint}"
