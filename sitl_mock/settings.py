"""The ``mock:`` section of a configuration file: everything that can be set."""

from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field, ValidationError, ValidationInfo, field_validator, model_validator

from sitl_mock.ardupilot.defaults import ARDUPILOT_PARAMETERS, with_ardupilot_defaults
from sitl_mock.autopilot.parameters import Parameter, ParameterRefusedError, ParameterTable
from sitl_mock.config.airframe import AirframeConfig, BatteryConfig, WindConfig
from sitl_mock.config.faults import Fault
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.config.section import (
    ConfigError,
    Finite,
    NonNegative,
    Section,
    explain,
    suggestion,
)
from sitl_mock.config.sensors import SensorConfig
from sitl_mock.config.settings import (
    GCS_PORT_OFFSET,
    PORT_OFFSET,
    HomeConfig,
    LockstepConfig,
    Port,
    SigningConfig,
)
from sitl_mock.config.wiring import for_vehicle, parse_wiring
from sitl_mock.config.yaml_file import load_yaml
from sitl_mock.px4.parameters import PX4_PARAMETERS

_PARAMETERS = {"px4": PX4_PARAMETERS, "ardupilot": ARDUPILOT_PARAMETERS}
SMOOTH = {"position_noise_m": 0.0, "velocity_noise_m_s": 0.0, "position_delay_ms": 0.0}


class MockSettings(Section):
    """Everything about one mock vehicle."""

    autopilot: Literal["px4", "ardupilot"] = "px4"
    """Whose rules it follows; each brings the errors of its navigation filter along, ArduPilot's
    its own airframe, battery and rate loop, too."""
    port: Annotated[int, Field(ge=1, le=65535 - PORT_OFFSET)] = 14540
    endpoint: str = "udp"
    """The companion's wire: udp (by ``port``), tcpin://HOST:PORT (for one client, and nothing boots
    before it is there) or serial:///PATH (a pseudo-terminal, PATH a link to it)."""
    gcs_port: Annotated[int, Field(ge=0, le=65535 - GCS_PORT_OFFSET)] = 14550
    """0 = no ground station link."""
    control_port: Port = 0
    """JSON control channel on 127.0.0.1; 0 = none."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    speed: Annotated[float, Field(ge=0.01, le=1000.0)] = 1.0
    """Vehicle seconds per wall second, when not in lockstep."""
    inner_loop_hz: Literal[250, 800] = 250
    """Sets which telemetry rates PX4 achieves; ArduPilot has SCHED_LOOP_RATE for it."""
    exact_rates: bool | None = None
    """Never skip a slot at the full rate, as PX4's loop does; null: only in lockstep."""
    burst_ms: NonNegative = 0.0
    """In paced time the vehicle lives in bursts, one in this vehicle time, as ArduPilot's simulator
    does, whose default is 5.6; 0 = it does not."""
    prearm_delay_s: NonNegative = 4.5
    """Arming is refused before; PX4 took 4.3 to 6.5 s, and ArduPilot, whose default it is, 41.6."""
    lockstep: LockstepConfig = LockstepConfig()
    signing: SigningConfig | None = None
    """None: nothing is signed, and signatures are not looked at."""
    home: HomeConfig = HomeConfig()
    parameters: dict[str, Finite] = Field(default_factory=dict)
    """Autopilot parameters that differ from their defaults."""
    airframe: AirframeConfig = AirframeConfig()
    rate_loop: RateLoopConfig = RateLoopConfig()
    wind: WindConfig = WindConfig()
    battery: BatteryConfig = BatteryConfig()
    sensors: SensorConfig = SensorConfig()
    faults: tuple[Fault, ...] = ()

    @field_validator("endpoint")
    @classmethod
    def _known_endpoint(cls, endpoint: str) -> str:
        parse_wiring(endpoint)
        return endpoint

    @model_validator(mode="before")
    @classmethod
    def _as_the_family_is(cls, section: object) -> object:
        if not isinstance(section, dict):
            return section
        section = {**section, "sensors": _with_ekf(section)}
        if section.get("autopilot") == "ardupilot":
            return with_ardupilot_defaults(section)
        return section

    @field_validator("parameters")
    @classmethod
    def _known_parameters(
        cls, parameters: dict[str, float], info: ValidationInfo
    ) -> dict[str, float]:
        known = _PARAMETERS[info.data.get("autopilot", "px4")]
        names = [parameter.name for parameter in known]
        for name in parameters:
            if name not in names:
                raise ValueError(f"unknown parameter {name}{suggestion(name, names)}")
        try:
            ParameterTable(known, parameters)
        except ParameterRefusedError as error:
            raise ValueError(str(error)) from error
        return parameters

    @property
    def known_parameters(self) -> tuple[Parameter, ...]:
        """The autopilot's parameters with their defaults."""
        return _PARAMETERS[self.autopilot]

    def for_vehicle(self, index: int) -> "MockSettings":
        """Return the settings of the vehicle with this index: its own ports and its own luck."""
        return self.model_copy(
            update={
                "port": self.port + index,
                "endpoint": for_vehicle(self.endpoint, index),
                "gcs_port": self.gcs_port + index if self.gcs_port else 0,
                "control_port": self.control_port + index if self.control_port else 0,
                "seed": self.seed + index,
            }
        )


def _with_ekf(section: dict[str, Any]) -> object:
    """Return the sensors' settings, with the errors of the autopilot's own navigation filter."""
    sensors = section.get("sensors", {})
    if not isinstance(sensors, dict):
        return sensors
    filled = {"ekf": section.get("autopilot", "px4"), **sensors}
    # What a navigation filter tells is smooth, and no older than the attitude.
    return filled if filled["ekf"] in (None, "none") else {**SMOOTH, **filled}


def load_settings(path: Path | None, overrides: dict[str, Any]) -> MockSettings:
    """Read the ``mock:`` section of a YAML file; without a file, the defaults.

    Args:
        path: the file; its other sections are not looked at.
        overrides: values of top-level keys (and of ``lockstep``) from the command line.

    Raises:
        ConfigError: the file cannot be read, or says something that cannot be.
    """
    where = "the command line" if path is None else str(path)
    section = {} if path is None else _mock_section(path)
    lockstep = {**section.get("lockstep", {}), **overrides.pop("lockstep", {})}
    merged = {**section, **overrides} | ({"lockstep": lockstep} if lockstep else {})
    try:
        return MockSettings.model_validate(merged)
    except ValidationError as error:
        raise ConfigError(f"{where}: {explain(error, MockSettings)}") from error


def _mock_section(path: Path) -> dict[str, Any]:
    try:
        document = load_yaml(path)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, ValueError, TypeError, OverflowError) as error:
        problem = " ".join(str(error).split())
        raise ConfigError(f"{path}: is not valid YAML: {problem:.300}") from error
    section = document.get("mock") if isinstance(document, dict) else document
    if section is None:
        section = {}
    if not isinstance(section, dict):
        raise ConfigError(f"{path}: the `mock` section must be a mapping of keys to values")
    lockstep = section.get("lockstep")
    if lockstep is None:
        return {**section, "lockstep": {}}
    if not isinstance(lockstep, dict):
        raise ConfigError(f"{path}: mock.lockstep must be a mapping, e.g. {{enabled: true}}")
    return section
