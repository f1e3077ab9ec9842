"""Connections that drop, and what is said of a link on which only others are heard."""

import asyncio
from types import SimpleNamespace

import pytest

from companion.mavlink.errors import EndpointError
from companion.mavlink.stats import LinkStats
from companion.mavlink.transport.endpoint import parse_endpoint
from companion.vehicle.connection import Connection, no_beacon_message


def test_a_connection_that_is_dropped_at_once_says_why_and_is_closed():
    closed = []

    async def opener(endpoint, inbox, lost):
        lost("the other end closed it")
        return SimpleNamespace(close=lambda: closed.append(endpoint))

    endpoint = parse_endpoint("tcpout://127.0.0.1:5760")
    inbox = SimpleNamespace(start_connection=lambda *, streaming: None)
    outbox = SimpleNamespace(transport=None)
    connection = Connection(endpoint, inbox, outbox, None, lambda reason: None, opener)
    with pytest.raises(EndpointError, match="dropped at once: the other end closed it"):
        asyncio.run(connection.open())
    assert closed == [endpoint]
    assert outbox.transport is None


def test_a_connection_is_opened_again_whatever_the_first_tries_raise():
    """As a USB adapter that is unplugged while it is opened: that is no OSError."""
    opened = SimpleNamespace(close=lambda: None, reconnects=True)
    faults = [None, EndpointError("gone"), ZeroDivisionError("a fault of ours"), None]
    dropped = []

    async def opener(endpoint, inbox, lost):
        dropped.append(lost)
        fault = faults.pop(0)
        if fault is not None:
            raise fault
        return opened

    async def scene():
        endpoint = parse_endpoint("tcpout://127.0.0.1:5760")
        inbox = SimpleNamespace(start_connection=lambda *, streaming: None)
        outbox, stats = SimpleNamespace(transport=None), SimpleNamespace(reconnects=0)
        connection = Connection(endpoint, inbox, outbox, stats, lambda reason: None, opener)
        await connection.open()
        dropped[0]("unplugged")
        assert outbox.transport is None
        assert connection._reopen_task is not None
        await asyncio.wait_for(connection._reopen_task, 5.0)
        assert outbox.transport is opened
        return stats.reconnects

    assert asyncio.run(scene()) == 1
    assert faults == []


def test_a_server_whose_client_went_away_listens_on_and_reads_the_next_one_as_a_stream():
    opened = SimpleNamespace(close=lambda: None, reconnects=False)
    told, started = [], []

    async def opener(endpoint, inbox, lost):
        told.append(lost)
        return opened

    async def scene():
        endpoint = parse_endpoint("tcpin://127.0.0.1:5760")
        inbox = SimpleNamespace(start_connection=lambda *, streaming: started.append(streaming))
        outbox, stats, dropped = SimpleNamespace(transport=None), LinkStats(), []
        connection = Connection(endpoint, inbox, outbox, stats, dropped.append, opener)
        await connection.open()
        started.clear()
        told[0]("the client went away")
        assert outbox.transport is opened
        assert (stats.reconnects, dropped) == (1, ["the client went away"])

    asyncio.run(scene())
    assert started == [True]


def test_frames_of_another_vehicle_only_are_named_with_their_sender():
    stats = LinkStats()
    stats.ignored_foreign = 12
    stats.foreign_sources.update({(7, 1), (9, 2)})
    settings = SimpleNamespace(first_beacon_timeout_s=3.0, endpoint="udpin://127.0.0.1:14540")
    assert "12 frames from others, such as system/component 7/1;" in no_beacon_message(
        settings, stats
    )
