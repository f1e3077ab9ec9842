"""The options `--watch`, `--live` and `--foxglove`: the process they start, and its end."""

import argparse
import asyncio
import io
import re
import signal
import sys
from importlib.util import find_spec
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from rich.console import Console

from companion.cli.helper_process import flight_environment, helper_process
from companion.config import Config
from companion.config.files import load
from companion.config.known_drag import KnownDrag
from companion.drag import Drag
from companion.extras import MissingExtraError
from companion.files.yaml_file import ConfigError
from companion.flight.environment import THIS_COMPUTER
from companion.live.addresses import open_page_socket
from companion.live.helper import Helper, HelperTasks
from tests.live.pages import status

CLIMB = {"limits": {"max_climb_m_s": 1.5}}


def started(console=None, folder=None, path=None, **options):
    """The context of the command line with these options."""
    asked = {"watch": False, "live": None, "foxglove": None, **options}
    read = Config() if path is None else load(path)
    shown = console or Console(file=io.StringIO())
    return helper_process(argparse.Namespace(**asked), read, path, read, folder, shown)


def test_without_the_options_nothing_is_started():
    with started() as helper:
        assert helper is None
    assert flight_environment(helper) is THIS_COMPUTER


@pytest.mark.parametrize(
    ("option", "package", "extra"), [("live", "nicegui", "live"), ("foxglove", "foxglove", "foxg")]
)
def test_a_missing_extra_is_told_before_a_port_is_opened(monkeypatch, option, package, extra):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtraError, match=rf"--{option} needs {package}.*\[{extra}"):
        started(**{option: "127.0.0.1:x"}).__enter__()


@pytest.mark.skipif(find_spec("nicegui") is None, reason="the extra `live` is not installed")
@pytest.mark.timeout(120)
def test_the_page_is_served_until_the_next_flight_needs_its_port(tmp_path):
    shown = Console(file=io.StringIO())
    with started(shown, tmp_path, live="127.0.0.1:0") as helper:
        assert flight_environment(helper) is THIS_COMPUTER  # there is no stream
        told = shown.file.getvalue()
        url = re.match(r"Live page: (http://127\.0\.0\.1:(\d+)/)  token", told)
        helper.status(status(1.0))
        page = urlopen(url[1], timeout=60).read().decode()
        assert 'id=\\"live-over\\"' in page
        with pytest.raises(HTTPError) as refusal:
            urlopen(Request(url[1], headers={"Origin": "http://example.com"}), timeout=60)
        assert (refusal.value.code, refusal.value.read()[:12]) == (403, b"another site")
        assert helper._process.poll() is None
    next_one = open_page_socket(f"127.0.0.1:{url[2]}")
    next_one.listening_socket.close()
    assert helper._process.wait(20.0) == 0
    assert (tmp_path / "live.log").read_text() == ""


@pytest.mark.skipif(find_spec("foxglove") is None, reason="the extra `foxglove` is missing")
def test_a_stream_that_lost_its_port_is_noted_and_the_flight_goes_on(monkeypatch):
    """Another program takes the port after the check of the command line."""
    with open_page_socket("127.0.0.1:0").listening_socket as other:
        taken = other.getsockname()
        monkeypatch.setattr(
            "companion.cli.helper_process.stream_address", lambda _: argparse.Namespace(
                host=taken[0], port=taken[1], address_text=lambda: "there"
            )
        )  # fmt: skip
        with started(foxglove="127.0.0.1:0") as helper:
            assert flight_environment(helper).send_batch == helper.feed.send
            note = noted(helper)
    assert note.startswith("there is no live stream: ")
    assert note.endswith("; the flight goes on without it")
    assert helper._process.wait(20.0) == 0


def noted(helper, work=lambda: None):
    """The next note of the process."""
    notes = asyncio.Queue()
    helper.note = notes.put_nowait

    async def until():
        work()
        return await notes.get()

    return asyncio.run(asyncio.wait_for(helper.run_while_serving(until()), 30.0))


def test_a_process_that_is_killed_is_noted_once_and_the_flight_goes_on(tmp_path):
    path = tmp_path / "flown.yaml"
    path.write_text("{}\n")
    with started(path=path, watch=True) as helper:
        assert noted(helper) == "edits of flown.yaml are applied from now on"
        ended = noted(helper, lambda: helper._process.send_signal(signal.SIGKILL))
        assert ended == "the file watcher has ended by itself; the flight goes on without it"
        again = []
        helper.note = again.append
        helper.event(1.0, "the flight goes on")
        helper.status(status(1.0))
        assert again == []
        helper._process.wait()


def test_a_killed_process_is_also_noted_by_the_next_message():
    helper = Helper(HelperTasks(None, Config(), None, None, False, None), Config())
    notes = []
    helper.note = notes.append
    helper._process.kill()
    helper._process.wait()
    for _ in range(3):
        helper.phase("hover", "the maneuver to end")
    assert notes == ["the file watcher has ended by itself; the flight goes on without it"]
    assert helper.dropped == 1
    asyncio.run(helper.run_while_serving(asyncio.sleep(0.05)))
    assert len(notes) == 1
    helper.close("the flight is over")


def test_requests_of_the_process_are_answered():
    helper = Helper(HelperTasks(None, Config(), None, None, False, None), Config())
    sent = []
    helper._send = lambda kind, **content: sent.append((kind, content))
    helper.changes.on_change, helper.changes.on_known_drag = helper._send_change, helper._send_drag
    requests = (
        {"kind": "change", "id": 1, "values": CLIMB, "by": "a test"},
        {"kind": "undo", "id": 2, "by": "a test"},
        {"kind": "undo", "id": 3, "by": "a test"},
        {"kind": "change", "id": 4, "values": {"limits": {"fence_radius_m": 9.0}}},
        {"kind": "change", "id": 5},
    )

    async def handle():
        for message in requests:
            helper._handle(message)

    asyncio.run(handle())
    helper._send_drag(KnownDrag(Drag(0.2, 0.1), Path("learned-aa.json")))
    helper._send_drag(KnownDrag(None, None))
    assert sent[-2:] == [
        ("drag", {"drag": [0.2, 0.1], "source": "learned-aa.json"}),
        ("drag", {"drag": None, "source": None}),
    ]
    helper._process.kill()
    helper._process.wait()
    answers = [content for kind, content in sent if kind == "answer"]
    assert [each["id"] for each in answers] == [1, 2, 3, 4, 5]
    assert "max_climb_m_s from 2 to 1.5" in answers[0]["text"]
    assert "max_climb_m_s from 1.5 to 2" in answers[1]["text"]
    assert [each["refusal"] is None for each in answers] == [True, True, False, False, False]
    made = [content for kind, content in sent if kind == "config"]
    assert [each["config"]["limits"]["max_climb_m_s"] for each in made] == [1.5, 2.0]
    assert made[0]["can_undo"]


def test_a_bad_address_is_refused_before_a_process_is_started():
    with pytest.raises(ConfigError, match="--live nowhere"):
        started(live="nowhere").__enter__()
