"""The shipped configurations: complete, correct, and described by the shipped schema."""

from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel

from companion.cli.main import main
from companion.config import Config
from companion.config.files import json_schema, load
from companion.config.vehicle import VehicleConfig
from sitl_mock.settings import MockSettings, load_settings

CONFIGS = Path(__file__).parents[2] / "configs"
VEHICLES = sorted(CONFIGS.glob("vehicle-*.yaml"))
FILES = [CONFIGS / f"{name}.yaml" for name in ("mock-px4", "px4", "mock-ardupilot", "ardupilot")]


@pytest.mark.parametrize("path", FILES, ids=[p.name for p in FILES])
def test_a_shipped_configuration_is_right_and_names_every_key(path, capsys):
    load(path)
    assert main(["check-config", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}: ok\n"
    data = yaml.safe_load(path.read_text())
    data |= yaml.safe_load((CONFIGS / data["include"]).read_text())
    for section, field in Config.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            assert list(data[section]) == list(field.annotation.model_fields), section


@pytest.mark.parametrize("path", VEHICLES, ids=[p.name for p in VEHICLES])
def test_a_shipped_vehicle_is_one_that_can_be_planned_with(path):
    data = yaml.safe_load(path.read_text())
    assert list(data) == ["vehicle"]
    assert list(data["vehicle"]) == list(VehicleConfig.model_fields)
    assert load(path).planner_name == "model-following"


@pytest.mark.parametrize("path", [*FILES, *VEHICLES], ids=lambda p: p.name)
def test_what_differs_from_the_default_is_marked_so(path):
    """A comment `# default: …` stands exactly at the keys that differ, and tells the truth."""
    default = Config()
    section = ""
    for line in path.read_text().splitlines():
        if line.startswith("mock:"):
            break
        if line and not line[0].isspace() and line.endswith(":"):
            section = line[:-1]
        if not line.startswith("  ") or line.lstrip().startswith("#"):
            continue
        pair, _, marked = line.partition("  # default: ")
        ((key, value),) = yaml.safe_load(pair).items()
        standard = getattr(getattr(default, section), key)
        standard = list(standard) if isinstance(standard, tuple) else standard
        standard = str(standard) if isinstance(standard, Path) else standard
        assert yaml.safe_load(marked) == standard if marked else value == standard, line
        assert bool(marked) == (value != standard), line


def test_a_real_vehicle_is_not_armed_by_default():
    assert Config().flight.arm is False
    assert load(CONFIGS / "px4.yaml").flight.arm is False
    assert load(CONFIGS / "ardupilot.yaml").flight.arm is False


def test_the_schema_is_the_one_that_is_printed(capsys):
    assert (CONFIGS / "companion.schema.json").read_text() == json_schema()
    assert main(["check-config", "--schema"]) == 0
    assert capsys.readouterr().out == json_schema()


def test_every_key_is_described():
    for section, field in Config.model_fields.items():
        model = field.annotation
        if isinstance(model, type) and issubclass(model, BaseModel):
            for key, inner in model.model_fields.items():
                assert inner.description, f"{section}.{key}"


def test_the_bundled_vehicle_is_configured_with_its_defaults():
    """As its comment says, but for two parameters; the default of every key that is shown, too."""
    safer = MockSettings(parameters={"COM_LOW_BAT_ACT": 3, "COM_OF_LOSS_T": 0.75})
    assert load_settings(CONFIGS / "mock-px4.yaml", {}) == safer
    shown = yaml.safe_load((CONFIGS / "mock-px4.yaml").read_text())["mock"]
    assert list(shown) == list(MockSettings.model_fields)
