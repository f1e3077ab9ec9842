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
def connected(dask):
    """Replaces `cluster.cluster_client`: it connects to that worker."""

    @contextmanager
    def connect(*_):
        yield dask

    return connect
