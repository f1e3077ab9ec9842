"""A connection that drops before it was open."""

import asyncio
from types import SimpleNamespace

import pytest

from companion.mavlink.errors import EndpointError
from companion.mavlink.transport.endpoint import parse_endpoint
from companion.vehicle.connection import Connection


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
        assert connection._reopening is not None
        await asyncio.wait_for(connection._reopening, 5.0)
        assert outbox.transport is opened
        return stats.reconnects

    assert asyncio.run(scene()) == 1
    assert faults == []
