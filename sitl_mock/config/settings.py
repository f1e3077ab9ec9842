"""All keys of the ``mock:`` section."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator

from sitl_mock.config.airframe import AirframeConfig, BatteryConfig, WindConfig
from sitl_mock.config.endpoint import for_vehicle, parse_endpoint
from sitl_mock.config.faults import Fault
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.config.section import Finite, NonNegative, Positive, Section
from sitl_mock.config.sensors import SensorConfig

PORT_OFFSET = 40
"""The companion link is sent from this many ports above ``port``, as PX4's simulation does."""
GCS_PORT_OFFSET = 4020
"""The ground station link is sent from this many ports above ``gcs_port`` (18570 for 14550)."""
Port = Annotated[int, Field(ge=0, le=65535)]


class HomeConfig(Section):
    """Where the vehicle stands at boot."""

    latitude_deg: Annotated[float, Field(ge=-89.0, le=89.0)] = 47.3977433
    longitude_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 8.5455942
    altitude_m: Finite = 489.4
    """Above mean sea level."""
    heading_deg: Finite = 0.0


class LockstepConfig(Section):
    """The vehicle waits for an answer to each step."""

    enabled: bool = False
    period_ms: Annotated[int, Field(ge=1, le=100)] = 4
    bundle: bool = True
    """Send the frames of a step in one datagram (PX4 sends one each); the beacon stays alone."""
    patience_s: Positive = 2.0
    """Wall time without an answer after which the vehicle runs on in paced time."""


class SigningConfig(Section):
    """MAVLink 2 signing, on every link of the vehicle."""

    passphrase_file: Path
    """Its first line is the passphrase; the key is its SHA-256, as ground stations make it."""
    accept_unsigned: bool | None = None
    """Obey frames without a signature, too; wrongly signed ones never. Null: as the autopilot does,
    ArduPilot on the companion's link (its SERIAL0), PX4 on none."""
    link_id: Annotated[int, Field(ge=0, le=254)] = 0
    """Of the companion's link in our signatures; the ground station's has the next."""


class VehicleSettings(Section):
    """Every key of one vehicle, with the defaults that do not depend on the autopilot."""

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
        parse_endpoint(endpoint)
        return endpoint

    def for_vehicle(self, index: int) -> Self:
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
