"""The Dask worker that runs this code."""

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from distributed import Worker


def running_worker() -> "Worker | None":
    """The Dask worker that runs this code; None: no worker does."""
    if "distributed" not in sys.modules:  # a worker has imported it; the import takes 0.6 s
        return None
    from distributed import get_worker  # noqa: PLC0415  an extra

    try:
        return get_worker()
    except ValueError:
        return None
