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
    inbox = SimpleNamespace(connect=lambda *, streaming: None)
    outbox = SimpleNamespace(transport=None)
    connection = Connection(endpoint, inbox, outbox, None, lambda reason: None, opener)
    with pytest.raises(EndpointError, match="dropped at once: the other end closed it"):
        asyncio.run(connection.open())
    assert closed == [endpoint]
    assert outbox.transport is None
