"""`companion serve` refuses what it cannot do, in one sentence."""

import importlib.util

import pytest

from companion.cli.main import main
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


def test_a_missing_extra_is_named(monkeypatch, capsys):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "ruckig" else find(name)
    )
    code, said = refused([], capsys)
    assert code == 2
    assert "serve.control: true needs ruckig" in said
    assert "[serve]'" in said
