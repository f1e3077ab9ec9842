"""Dask: starts local worker processes or uses an existing cluster, and runs tasks on it."""

import logging
import signal
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from companion.campaign.unit import UnitResult
from companion.campaign.versions import VersionError, as_versions, require_equal, versions
from companion.child_process import interrupts_blocked, usable_cores
from companion.extras import require
from companion.files.yaml_file import ConfigError

if TYPE_CHECKING:
    from distributed import Client, Future

WORKER_DEATHS_TO_GIVE_UP = 3
"""Number of dead workers after which a unit of work is given up.

A dead worker counts if it ran the unit, or had the unit in its queue. An existing cluster
follows its own setting, `distributed.scheduler.allowed-failures`."""
_CONNECTION_LOST = "the connection to the Dask scheduler is lost"
_CONNECT_TIMEOUT_S = 10.0
_CLOSE_TIMEOUT_S = 5.0
_NEEDED_PACKAGES = ("dask", "distributed", "numba", "pyarrow", "scipy")
_DASK_SETTINGS = {
    "distributed.scheduler.allowed-failures": WORKER_DEATHS_TO_GIVE_UP - 1,
    # Dask's own profiler, which nobody reads here, uses 10 % of a worker's time.
    "distributed.worker.profile.enabled": False,
    # Dask sets the variables of BLAS and OpenMP to 1 itself.
    "distributed.nanny.pre-spawn-environ.NUMBA_NUM_THREADS": "1",
}
"""Dask settings of this process, and of the local cluster that it starts."""


class ClusterError(Exception):
    """The connection to the cluster was lost, or a unit of work was given up."""


class EndedUnit(NamedTuple):
    """A unit of work that was run or given up."""

    number: int
    result: UnitResult | None
    """Rows and wall times; None: the unit was given up."""
    reason: str = ""
    """Why the unit was given up."""


def require_packages() -> None:
    """Check that the extra `campaign` is installed.

    Raises:
        MissingExtraError: a package is missing.
    """
    for package in _NEEDED_PACKAGES:
        require(package, "campaign", "`companion campaign`")


@contextmanager
def cluster_client(scheduler: str | None, workers: int | None) -> "Iterator[Client]":
    """Connect to a cluster whose workers have the same versions as this process.

    Args:
        scheduler: address of an existing cluster's scheduler; None: start local worker processes,
            which end with the context.
        workers: number of local worker processes; None: one for each core.

    Raises:
        ConfigError: the scheduler cannot be reached.
        VersionError: a worker or the scheduler has other versions.
    """
    import dask  # noqa: PLC0415  an extra
    from distributed import Client, LocalCluster  # noqa: PLC0415  an extra

    _silence_dask()
    with dask.config.set(_DASK_SETTINGS):
        if scheduler is not None:
            try:
                client = Client(scheduler, timeout=_CONNECT_TIMEOUT_S)
            except (OSError, ValueError, TypeError) as error:
                raise ConfigError(f"no Dask scheduler answers at {scheduler}: {error}") from error
            cluster = None
        else:
            with interrupts_blocked(), _termination_deferred():
                cluster = LocalCluster(
                    n_workers=workers or usable_cores(),
                    threads_per_worker=1,  # flights are pure Python
                    dashboard_address="127.0.0.1:0",
                    silence_logs=logging.CRITICAL + 1,
                )
            client = Client(cluster)
        try:
            _compare_versions(client)
            yield client
        finally:
            with suppress(Exception):  # the results are already on the disk
                client.close(timeout=_CLOSE_TIMEOUT_S)
                if cluster is not None:
                    cluster.close(timeout=_CLOSE_TIMEOUT_S)


def _silence_dask() -> None:
    """Silence Dask's log messages; this program reports the errors itself."""
    for name in ("tornado", *logging.root.manager.loggerDict):
        if name.startswith(("distributed", "tornado")):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


@contextmanager
def _termination_deferred() -> Iterator[None]:
    """Handle SIGTERM at the end of the block: Dask cannot close a cluster that is still starting.

    SIGTERM is not blocked, because Dask ends the worker processes by this signal.
    """
    if threading.current_thread() is not threading.main_thread():  # signals are not handled here
        yield
        return
    received_signals: list[int] = []
    handler = signal.signal(signal.SIGTERM, lambda number, _: received_signals.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, handler)
        if received_signals:
            signal.raise_signal(signal.SIGTERM)


def wait_for_workers(client: "Client") -> None:
    """Wait until the cluster has a worker; with a queueing system that may take long.

    Raises:
        VersionError: a worker or the scheduler has other versions.
    """
    client.wait_for_workers(1)
    _compare_versions(client)


def number_of_workers(client: "Client") -> int:
    """Number of workers that the cluster has now."""
    return len(client.nthreads())  # `scheduler_info` may lack some


def _compare_versions(client: "Client") -> None:
    """Require that the scheduler and the workers have the versions of this process.

    For the scheduler, only Python's minor version and the version of Dask are compared.
    """
    dask_versions = client.get_versions()
    client_versions, scheduler_versions = (
        _dask_and_python(dask_versions[process_name]) for process_name in ("client", "scheduler")
    )
    require_equal(client_versions, scheduler_versions, "the Dask scheduler")
    for address, worker_versions in client.run(versions, on_error="return").items():
        if isinstance(worker_versions, BaseException):
            raise VersionError(
                f"the worker {address} cannot run this version of companion ({worker_versions}): "
                "install the same version there"
            )
        require_equal(versions(), as_versions(worker_versions), f"the worker {address}")


def _dask_and_python(process: Mapping[str, Any]) -> dict[str, str]:
    """Python's minor version and Dask's version, from an entry of `Client.get_versions`."""
    python = ".".join(str(process["host"]["python"]).split(".")[:2])
    return {"python": python, "distributed": str(process["packages"]["distributed"])}


def run_tasks(client: "Client", tasks: Mapping[int, tuple[Any, ...]]) -> Iterator[EndedUnit]:
    """Run one task for each unit of work; yield each unit when it ends, in any order.

    Dask queues and sends the tasks, and repeats a task whose worker died. `tasks` holds, by number
    of the unit, a function that returns `UnitResult`, followed by its arguments.

    Raises:
        ClusterError: the connection to the scheduler is lost.
        ConfigError: a worker refuses a case.
        VersionError: a worker that joined later has other versions.
    """
    from distributed import as_completed  # noqa: PLC0415  an extra

    futures = {client.submit(*task, pure=False): unit_number for unit_number, task in tasks.items()}
    try:
        for future in as_completed(futures):
            unit_number = futures.pop(future)
            yield _ended_unit(unit_number, future)
            future.release()
    finally:
        with suppress(Exception):
            client.cancel(list(futures), force=True)


def _ended_unit(number: int, future: "Future") -> EndedUnit:
    """The unit of work of a future that has ended."""
    try:
        if future.status == "finished":
            return EndedUnit(number, future.result())
        if future.status == "error":
            return EndedUnit(number, None, _failure_reason(future.exception()))
    except (OSError, CancelledError) as error:  # lost while the rows were in transit
        raise ClusterError(_CONNECTION_LOST) from error
    raise ClusterError(_CONNECTION_LOST)


def _failure_reason(error: BaseException) -> str:
    """Why a unit was given up; a ConfigError is raised instead."""
    from distributed import KilledWorker  # noqa: PLC0415  an extra

    if isinstance(error, ConfigError):
        raise error
    if isinstance(error, KilledWorker):
        return (
            "every worker that flew these cases died, perhaps for lack of memory; read the logs of "
            "the workers"
        )
    return f"{type(error).__name__}: {error}"
