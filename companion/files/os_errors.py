"""Why a file could not be read or written, in words."""

DISK_TIMEOUT = 5.0
"""Time allowed for the disk to take written data, s."""
DISK_HANGS = f"the disk did not answer for {DISK_TIMEOUT:g} s"
"""The reason in messages if the disk takes longer than `DISK_TIMEOUT`."""


def reason_of(error: OSError) -> str:
    """The system's reason without error number and file; the whole text if it gave no reason."""
    return error.strerror or str(error)
