"""`companion serve` refuses what it cannot do, in one sentence."""

import asyncio
import importlib.util

import pytest

from companion.cli.main import main
from companion.config import Config
from companion.config.files import changed
from companion.mavlink import loop as link_loop
from companion.mavlink.transport.free_port import free_port
from companion.serve.session import ServeSession
from tests.flight.fly import CONFIGS

CONFIG = str(CONFIGS / "mock-px4.yaml")


def refused(arguments, capsys):
    code = main(["serve", "--config", CONFIG, *arguments])
    said = " ".join(capsys.readouterr().err.split())
    return code, said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--client", "udp:14550"], "serve.clients: endpoint 'udp:14550' is not understood"),
        (["--client", "udpin://127.0.0.1:99999"], "port 99999 is outside 1..65535"),
        (["--set", "link.lockstep=true"], "serve runs in real time"),
        (["--set", "serve.hold_s=-1"], "hold_s"),
        (["--endpoint", "nonsense"], "endpoint 'nonsense' is not understood"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_2(arguments, words, capsys):
    code, said = refused(arguments, capsys)
    assert code == 2
    assert words in said
    assert "Traceback" not in said


def test_a_vehicle_that_is_not_heard_is_said_once():
    said = []
    settings = {
        "link": {"endpoint": f"udpin://127.0.0.1:{free_port()}"},
        "flight": {"connect_timeout_s": 0.2},
        "serve": {"clients": ()},
    }
    session = ServeSession(changed(Config(), settings, "the test"), said.append)

    async def main():
        asyncio.get_running_loop().call_later(0.6, session.stop)
        await session.run()

    link_loop.run(main())
    assert [text for text in said if text.startswith("no heartbeat")] == [
        f"no heartbeat from system 1 within 0.2 s on {settings['link']['endpoint']}; "
        "is the vehicle running and sending to this address? "
        "(still waiting for the vehicle; clients are served)"
    ]


def test_a_missing_extra_is_named(monkeypatch, capsys):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "ruckig" else find(name)
    )
    code, said = refused([], capsys)
    assert code == 2
    assert "serve.control: true needs ruckig" in said
    assert "[serve]'" in said
