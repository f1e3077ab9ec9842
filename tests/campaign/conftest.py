"""A Dask worker in this process, for campaigns whose flights take no time."""

from contextlib import contextmanager

import pytest


@pytest.fixture(scope="module")
def dask():
    """A client of a worker in this process."""
    from distributed import Client, LocalCluster  # noqa: PLC0415  slow to import

    options = {"processes": False, "dashboard_address": "127.0.0.1:0", "protocol": "inproc://"}
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, **options) as made,
        Client(made) as client,
    ):
        yield client


@pytest.fixture
def connected(dask, monkeypatch):
    """Replaces `cluster.cluster_client`: it connects to that worker.

    What a test lets the worker do instead of flying holds until the worker is idle: the rest of a
    run that ended early flew whole flights after the test, and closing the worker took 30 s.
    """

    @contextmanager
    def connect(*_):
        yield dask

    yield connect
    dask.submit(int, pure=False).result()  # its only thread takes one task after the other
