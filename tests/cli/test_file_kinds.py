"""A YAML file of another kind than the command takes: what it is, and what takes it."""

from pathlib import Path

import pytest

from companion.campaign.campaign_file import CampaignFile
from companion.cli.main import main
from companion.config.file_kinds import CAMPAIGN_KEYS, TRAJECTORY_KEYS, FileKind, require_kind
from companion.config.trajectory_file import TrajectoryFile
from tests.flight.fly import CONFIGS

CONFIG, TRAJECTORY = CONFIGS / "px4.yaml", CONFIGS / "trajectories" / "figure8.yaml"
CAMPAIGN = CONFIGS / "campaigns" / "robustness.yaml"


@pytest.mark.parametrize(
    ("command", "given", "words"),
    [
        (["campaign", "run"], CONFIG, "a configuration, not a campaign file; `companion fly --con"),
        (["campaign", "tune"], CONFIG, "a configuration, not a campaign file; `companion fly --co"),
        (["campaign", "run"], TRAJECTORY, "a trajectory file, not a campaign file; `companion fly"),
        (["fly", "--config"], CAMPAIGN, "a campaign file, not a configuration; `companion campai"),
        (["check-config"], CAMPAIGN, "a campaign file, not a configuration; `companion campaign r"),
        (["fly", "--config"], TRAJECTORY, "a trajectory file, not a configuration; `companion fl"),
        (["demo", "--trajectory"], CAMPAIGN, "a campaign file, not a trajectory file; `companion "),
        (["demo", "--trajectory"], CONFIG, "a configuration, not a trajectory file; `companion fl"),
    ],
)
def test_a_file_of_another_kind_is_told_with_the_command_that_takes_it(
    command, given, words, capsys
):
    assert main([*command, str(given)]) == 2
    error = capsys.readouterr().err
    assert f"companion: {given} is {words}" in error
    assert "known key" not in error


def test_the_keys_of_the_kinds_are_those_of_their_models():
    assert set(CAMPAIGN_KEYS) == set(CampaignFile.model_fields)
    assert set(TRAJECTORY_KEYS) == set(TrajectoryFile.model_fields)


@pytest.mark.parametrize("kind", FileKind)
@pytest.mark.parametrize("keys", [(), ("hover",), ("limits",), ("wrong", "keys")])
def test_a_file_that_may_be_either_kind_is_none_of_another(kind, keys):
    if not (keys in (("hover",), ("limits",)) and kind is not FileKind.CONFIG):
        require_kind(Path("a.yaml"), keys, kind)
