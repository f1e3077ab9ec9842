"""The reasons of the operating system, in words."""


def reason_of(error: OSError) -> str:
    """The system's reason without error number and file; for an error without one, its text."""
    return error.strerror or str(error)
