"""Why a file could not be read or written, in words."""

DISK_TIMEOUT = 5.0
"""Time allowed for the disk to take written data, s."""
DISK_HANGS = f"the disk did not answer for {DISK_TIMEOUT:g} s"
"""Reason if it takes longer."""


def reason_of(error: OSError) -> str:
    """The system's reason without error number and file; for an error without one, its text."""
    return error.strerror or str(error)
