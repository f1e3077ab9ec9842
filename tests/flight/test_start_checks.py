"""A configuration that cannot be used is refused by each command before anything is begun."""

import pytest

from companion.cli.main import main
from companion.files.yaml_file import ConfigError
from companion.flight import start_checks

ENDPOINT = "link: {endpoint: /dev/x}"
GUIDANCE = "guidance: {kind: nmpc}"


def arguments(command, path):
    return [command, str(path)] if command == "check-config" else [command, "--config", str(path)]


@pytest.mark.parametrize("command", ["check-config", "fly", "serve"])
@pytest.mark.parametrize(("text", "words"), [(ENDPOINT, "link.endpoint: "), (GUIDANCE, "nmpc")])
def test_every_command_refuses_what_cannot_be_used(
    command, text, words, tmp_path, capsys, monkeypatch
):
    def refuse(_):
        raise ConfigError("guidance.kind: nmpc does not work with this vehicle")

    monkeypatch.setattr(start_checks, "predictive_settings", refuse)
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "c.yaml"
    path.write_text(f"{text}\nserve: {{control: true}}\n")
    assert main(arguments(command, path)) == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert list(tmp_path.iterdir()) == [path]
