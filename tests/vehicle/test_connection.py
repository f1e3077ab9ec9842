"""Connections that drop, and what is said of a link on which only others are heard."""

import asyncio
from types import SimpleNamespace

import pytest

from companion.mavlink.errors import EndpointError
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats
from companion.mavlink.transport.endpoint import parse_endpoint
from companion.vehicle.connection import Connection, no_beacon_message, no_heartbeat_message


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


def test_a_connection_is_opened_again_whatever_the_first_tries_raise(monkeypatch):
    """As a USB adapter that is unplugged while it is opened: that is no OSError."""
    opened = SimpleNamespace(close=lambda: None, reconnects=True)
    faults = [None, EndpointError("gone"), *[ZeroDivisionError("a fault of ours")] * 4, None]
    dropped, pauses = [], []

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

        async def pause(seconds):
            pauses.append(seconds)

        monkeypatch.setattr("asyncio.sleep", pause)
        await asyncio.wait_for(connection._reopen_task, 5.0)
        assert outbox.transport is opened
        return stats.reconnects

    assert asyncio.run(scene()) == 1
    assert faults == []
    assert pauses == [0.2, 0.4, 0.8, 1.6, 3.0, 3.0]


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


FOREIGN = {"ignored_foreign": 12, "foreign_sources": {(7, 1), (9, 2)}}


@pytest.mark.parametrize(
    ("counted", "told"),
    [
        (
            {"unclaimed": 3, **FOREIGN},
            ", but 3 other frames with the vehicle's ids; let the autopilot send HEARTBEAT on this "
            "link, because only its sender counts as the vehicle; if it is the mock vehicle in "
            "lockstep, set link.lockstep: true",
        ),
        (
            {"bad_signature": 5, **FOREIGN},
            ", but 12 frames from others, such as system/component 7/1; is link.target_system "
            "right?",
        ),
        (
            {"bad_signature": 5, "bad_crc": 2},
            ", but 5 frames that are not signed with the key in link.signing_key_file, or whose "
            "time stamp is refused; give both sides the same key, and set this computer's clock",
        ),
    ],
)
def test_what_came_instead_of_the_vehicles_frames_is_told(counted, told):
    stats = LinkStats()
    for name, value in counted.items():
        setattr(stats, name, value)
    settings = LinkSettings(endpoint="udpin://127.0.0.1:14540", first_beacon_timeout_s=3.0)
    heartbeat = "no heartbeat from system 1 within 2.5 s"
    assert no_heartbeat_message(settings, stats, 2.5) == heartbeat + told
    assert no_beacon_message(settings, stats) == "no lockstep beacon within 3 s" + told


@pytest.mark.parametrize(
    ("endpoint", "damaged", "told"),
    [
        ("serial:///dev/ttyAMA0:921600", 7, ", but 7 damaged frames; is the baud rate right? "
         "(link.endpoint)"),
        ("serial:///dev/ttyAMA0:921600", 0, " on serial:///dev/ttyAMA0:921600; is the vehicle "
         "running, does its port send MAVLink at this baud rate, and are TX and RX crossed?"),
        ("udpin://127.0.0.1:14540", 0, " on udpin://127.0.0.1:14540; is the vehicle running and "
         "sending to this address?"),
    ],
)  # fmt: skip
def test_a_link_on_which_nothing_came_says_what_to_look_at(endpoint, damaged, told):
    settings, stats = LinkSettings(endpoint=endpoint), LinkStats(bad_crc=damaged)
    message = no_heartbeat_message(settings, stats, 2.5)
    assert message == f"no heartbeat from system 1 within 2.5 s{told}"


def test_without_a_beacon_the_endpoint_is_told():
    settings = LinkSettings(endpoint="udpin://127.0.0.1:14540", first_beacon_timeout_s=3.0)
    assert no_beacon_message(settings, LinkStats()) == (
        "no lockstep beacon within 3 s on udpin://127.0.0.1:14540; is the vehicle running, and in "
        "lockstep?"
    )
