"""The helper process's end of the channel, in this process: requests, refusals, edits."""

import asyncio
import socket
from contextlib import asynccontextmanager

import pytest

from companion.config import Config
from companion.config.files import changed
from companion.files.yaml_file import ConfigError
from companion.flight.changes import ChangeRefusedError
from companion.live import after_flight, helper_process
from companion.live.addresses import ask_to_release, release_socket_name
from companion.live.after_flight import until_unused
from companion.live.channel import Channel, datagrams
from companion.live.checks import ChangeChecks
from companion.live.watched_file import Edit

SLOWER = {"planner": {"gain_per_s": 4.0}}
MAY_BE = "the change may have been applied, so look at the values of the flight"
FIRST = {"config": Config().model_dump(mode="json"), "flies_maneuvers": False, "watched_file": None}


class Flight:
    """The flight's end: answers each request with `answer`, and keeps notes and requests."""

    def __init__(self, end):
        self.end, self.answer, self.told = end, {"text": "done"}, []

    def serve(self):
        for message in self.end.received_messages():
            if message is None:
                return
            self.told.append(message)
            if self.answer is not None and message["kind"] != "note":
                self.end.send({"kind": "answer", "id": message["id"], **self.answer})

    def notes(self):
        return [message["text"] for message in self.told if message["kind"] == "note"]


@asynccontextmanager
async def used(**first):
    """A connection and its flight, whose first message differs from `FIRST` by these keys."""
    ours, theirs = Channel.pair()
    theirs.setblocking(False)
    flight, loop = Flight(ours), asyncio.get_running_loop()
    connection = helper_process.FlightConnection(Channel(theirs), {**FIRST, **first})
    loop.add_reader(ours.fileno(), flight.serve)
    try:
        yield connection, flight
    finally:
        for end in (ours, theirs):
            if end.fileno() >= 0:
                loop.remove_reader(end.fileno())
            end.close()


async def test_a_change_is_checked_and_then_asked_of_the_flight():
    async with used() as (connection, flight):
        assert await connection.change(SLOWER, "a test") == "done"
        assert flight.told == [{"kind": "change", "values": SLOWER, "by": "a test", "id": 0}]
        with pytest.raises(ConfigError, match="at most 20"):
            await connection.change({"planner": {"gain_per_s": 50.0}}, "a test")
        assert len(flight.told) == 1
        flight.answer = {"refusal": "not while landing"}
        with pytest.raises(ChangeRefusedError, match=r"^not while landing$"):
            await connection.undo("a test")


async def test_messages_of_the_flight_reach_the_checks_and_the_listeners():
    async with used() as (connection, flight):
        heard = asyncio.Queue()
        connection.listen(heard.put_nowait)
        now = changed(Config(), SLOWER, "a test").model_dump(mode="json")
        flight.end.send({"kind": "config", "config": now, "can_undo": True})
        flight.end.send({"kind": "drag", "drag": [0.3, 0.0], "source": "learned-aa.json"})
        assert [(await heard.get())["kind"] for _ in range(2)] == ["config", "drag"]
        assert connection.checks.current_config.planner.gain_per_s == 4.0
        assert connection.checks._drag.drag.linear == 0.3


async def test_a_flight_that_has_ended_and_one_that_does_not_read_refuse_in_different_words():
    async with used() as (connection, flight):
        asyncio.get_running_loop().remove_reader(flight.end.fileno())
        for _ in range(5000):
            connection.note("x" * 500)
        with pytest.raises(
            ChangeRefusedError, match="is too busy to take the change; nothing has changed"
        ):
            await connection.undo("a test")
        flight.end.close()
        await connection.flight_ended.wait()
        with pytest.raises(ChangeRefusedError, match="the flight has ended; nothing has changed"):
            await connection.change(SLOWER, "a test")


@pytest.mark.parametrize(
    ("answer", "said", "accepted"),
    [
        ({"refusal": "not while landing"}, "w.yaml is not applied: not while landing", False),
        (None, f"w.yaml: no answer from the flight within 0.02 s; {MAY_BE}", True),
        ({"text": "done"}, None, True),
    ],
)
async def test_what_becomes_of_an_edit_is_noted(monkeypatch, tmp_path, answer, said, accepted):
    """Without an answer the edit may be in force, so an edit that takes it back must be sent."""
    seen = []

    class Watched:
        def __init__(self, *_):
            self.edits = [None, Edit({}, "w.yaml has a fault"), Edit(SLOWER)]

        def newest_edit(self):
            return self.edits.pop(0) if self.edits else None

        def accept(self):
            seen.append("accepted")

    monkeypatch.setattr(helper_process, "WatchedFile", Watched)
    monkeypatch.setattr(helper_process, "_ANSWER_TIMEOUT", 0.02)
    monkeypatch.setattr(helper_process, "_CHECK_PERIOD_S", 0.001)

    async with used(config_as_read=FIRST["config"]) as (connection, flight):
        flight.answer = answer
        watching = asyncio.create_task(helper_process.watch(connection, tmp_path / "w.yaml"))
        await asyncio.sleep(0.3)
        flight.end.close()
        await watching
        begin, fault, *rest = flight.notes()
        assert begin == "edits of w.yaml are applied from now on"
        assert fault == "w.yaml has a fault"
        assert [note.startswith(said) for note in rest] == ([True] if said else [])
        assert seen == (["accepted"] if accepted else [])


def test_a_process_whose_flight_never_began_ends():
    ours, theirs = Channel.pair()
    ours.close()
    asyncio.run(helper_process._serve(theirs.detach(), -1, -1))


def test_an_end_that_broke_counts_as_closed():
    class Broken:
        def recv(self, _):
            raise ConnectionResetError

    channel = Channel(Broken())
    assert list(channel.received_messages()) == [None]
    assert not channel.is_open
    assert list(datagrams(Broken(), 1)) == [b""]


def test_a_turn_takes_no_more_than_it_may():
    channel, theirs = Channel.pair()
    theirs.setblocking(False)
    for number in range(3):
        channel.send({"number": number})
    told = Channel(theirs)
    assert [message["number"] for message in told.received_messages(2)] == [0, 1]
    assert len(list(datagrams(theirs, 0))) == 0
    assert len(list(datagrams(theirs, 5))) == 1
    channel.close()
    theirs.close()


def test_maneuvers_that_are_no_longer_known_forbid_a_change(tmp_path):
    trajectory = {"flight": {"maneuvers": ["trajectory"], "trajectory": str(tmp_path / "t.csv")}}
    checks = ChangeChecks(changed(Config(), trajectory, "a test"), flies_maneuvers=True)
    with pytest.raises(
        ConfigError, match=r"maneuvers of this flight could not be loaded: .*t\.csv"
    ):
        checks.check(SLOWER, "a test")


def test_guidance_whose_values_are_fixed_forbids_a_change():
    told = {"guidance": {"kind": "nmpc"}, "vehicle": {"lag_ms": 40.0, "dead_time_ms": 40.0}}
    checks = ChangeChecks(changed(Config(), told, "a test"), flies_maneuvers=False)
    with pytest.raises(ConfigError, match=r"^a test: guidance.kind nmpc keeps the values"):
        checks.check(SLOWER, "a test")


def test_a_page_stays_while_it_is_open_and_some_seconds_more(monkeypatch):
    monkeypatch.setattr(after_flight, "_LONGEST_TIME_WITHOUT_USERS", 2.0)
    slept = []

    async def sleep(tasks, **_):
        slept.append(1.0)
        await asyncio.sleep(0)
        return tasks, set()

    monkeypatch.setattr(after_flight.asyncio, "wait", sleep)
    asyncio.run(until_unused(0, lambda: len(slept) < 5))
    assert len(slept) == 5 + 2
    slept.clear()
    monkeypatch.setattr(after_flight, "_LONGEST_TIME_AFTER_FLIGHT", 20.0)
    asyncio.run(until_unused(0, lambda: True))
    assert len(slept) == 20


def test_a_page_leaves_for_the_same_user_only(monkeypatch):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    user = after_flight.os.getuid()

    async def asked(getuid):
        monkeypatch.setattr(after_flight.os, "getuid", getuid)
        staying = asyncio.create_task(until_unused(port, lambda: True))
        await asyncio.sleep(0.05)
        answer = await asyncio.to_thread(ask_to_release, port)
        done, _ = await asyncio.wait({staying}, timeout=0.3)
        staying.cancel()
        return answer, bool(done)

    assert asyncio.run(asked(lambda: user + 1)) == (False, False)
    assert asyncio.run(asked(lambda: user)) == (True, True)


def test_a_page_whose_name_is_taken_stays_all_the_same(monkeypatch):
    monkeypatch.setattr(after_flight, "_LONGEST_TIME_WITHOUT_USERS", 0.0)
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(release_socket_name(1))
        asyncio.run(asyncio.wait_for(until_unused(1, lambda: False), 5.0))
