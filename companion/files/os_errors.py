"""The reasons of the operating system, in words."""


def reason_of(error: OSError) -> str:
    """Why the system refused, without number and file; errors of Python's own have other words."""
    return error.strerror or str(error)
