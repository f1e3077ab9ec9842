"""The ``mock:`` section of a configuration file, with the defaults of its autopilot."""

from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError, ValidationInfo, field_validator, model_validator

from sitl_mock.autopilot.parameters import ParameterRefusedError, ParameterTable
from sitl_mock.autopilots import AUTOPILOTS
from sitl_mock.config.section import ConfigError, error_path, explain, suggestion
from sitl_mock.config.settings import VehicleSettings
from sitl_mock.config.yaml_file import Document, FileRefusedError, explain_yaml, load_yaml

SENSORS_WITH_FILTER = {"position_noise_m": 0.0, "velocity_noise_m_s": 0.0, "position_delay_ms": 0.0}
"""Defaults of ``sensors`` with a navigation filter, whose output is smooth and as recent as the
attitude."""


class MockSettings(VehicleSettings):
    """Every key of one vehicle, checked and completed by the rules of its autopilot."""

    @model_validator(mode="before")
    @classmethod
    def _with_defaults(cls, section: object) -> object:
        if not isinstance(section, dict):
            return section
        section = {**section, "sensors": _with_ekf(section)}
        autopilot = AUTOPILOTS.get(str(section.get("autopilot", "px4")))
        return section if autopilot is None else autopilot.with_defaults(section)

    @field_validator("parameters")
    @classmethod
    def _known_parameters(
        cls, parameters: dict[str, float], info: ValidationInfo
    ) -> dict[str, float]:
        known_parameters = AUTOPILOTS[info.data.get("autopilot", "px4")].parameters
        names = [parameter.name for parameter in known_parameters]
        for name in parameters:
            if name not in names:
                raise ValueError(f"unknown parameter {name}{suggestion(name, names)}")
        try:
            ParameterTable(known_parameters, parameters)
        except ParameterRefusedError as error:
            raise ValueError(str(error)) from error
        return parameters


def _with_ekf(section: dict[str, Any]) -> object:
    """Return the ``sensors`` section with the navigation filter of this autopilot as default."""
    sensors = section.get("sensors", {})
    if not isinstance(sensors, dict):
        return sensors
    completed_sensors = {"ekf": section.get("autopilot", "px4"), **sensors}
    return (
        completed_sensors
        if completed_sensors["ekf"] in (None, "none")
        else {**SENSORS_WITH_FILTER, **completed_sensors}
    )


def load_settings(
    path: Path | None, overrides: dict[str, Any], origin: str = "the command line"
) -> MockSettings:
    """Read the ``mock:`` section of a YAML file; without a file, the defaults.

    ``overrides`` replace keys of the section and of ``lockstep``. Without a file, error
    messages name ``origin`` as their source.

    Raises:
        ConfigError: the file cannot be read, or a key or value is invalid.
    """
    source = origin if path is None else str(path)
    document = Document(None, None) if path is None else _read_document(path)
    section = {} if path is None else _mock_section(document.value, path)
    lockstep = {**section.get("lockstep", {}), **overrides.get("lockstep", {})}
    merged_section = {**section, **overrides} | ({"lockstep": lockstep} if lockstep else {})
    try:
        return MockSettings.model_validate(merged_section)
    except ValidationError as error:
        line = document.line(error_path(error))
        location = source if line is None else f"{source}, line {line}"
        raise ConfigError(f"{location}: {explain(error, MockSettings)}") from error


def _read_document(path: Path) -> Document:
    try:
        return load_yaml(path)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    except FileRefusedError as error:
        raise ConfigError(f"{path}: {error}") from error
    except (yaml.YAMLError, ValueError, TypeError, OverflowError) as error:
        raise ConfigError(f"{path}: {explain_yaml(error)}") from error


def _mock_section(document: object, path: Path) -> dict[str, Any]:
    section = document.get("mock") if isinstance(document, dict) else document
    if section is None:
        section = {}
    if not isinstance(section, dict):
        raise ConfigError(f"{path}: the `mock` section must be a mapping of keys to values")
    signing = section.get("signing")
    if isinstance(signing, dict) and isinstance(signing.get("passphrase_file"), str):
        file = path.parent / signing["passphrase_file"]
        section = {**section, "signing": {**signing, "passphrase_file": str(file)}}
    lockstep = section.get("lockstep")
    if lockstep is None:
        return {**section, "lockstep": {}}
    if not isinstance(lockstep, dict):
        raise ConfigError(f"{path}: mock.lockstep must be a mapping, e.g. {{enabled: true}}")
    return section
