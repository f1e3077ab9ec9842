"""All keys of the ``mock:`` section, apart from the checks that depend on the autopilot."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator

from sitl_mock.config.airframe import AirframeConfig, BatteryConfig, WindConfig
from sitl_mock.config.endpoint import endpoint_for_vehicle, parse_endpoint
from sitl_mock.config.faults import Fault
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.config.section import Finite, NonNegative, Positive, Section
from sitl_mock.config.sensors import SensorConfig

PORT_OFFSET = 40
"""Offset from ``port`` to the UDP port that the vehicle itself binds, as in PX4's simulation."""
GCS_PORT_OFFSET = 4020
"""Offset from ``gcs_port`` to the UDP port that the vehicle itself binds (18570 for 14550)."""
Port = Annotated[int, Field(ge=0, le=65535)]


class HomeConfig(Section):
    """Position and heading at boot."""

    latitude_deg: Annotated[float, Field(ge=-89.0, le=89.0)] = 47.3977433
    longitude_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 8.5455942
    altitude_m: Finite = 489.4
    """Altitude of home above mean sea level."""
    heading_deg: Finite = 0.0


class LockstepConfig(Section):
    """Lockstep: the vehicle waits for an answer to each step."""

    enabled: bool = False
    period_ms: Annotated[int, Field(ge=1, le=100)] = 4
    bundle: bool = True
    """Join the frames of a step, the beacon last, into datagrams of at most 1400 bytes; PX4 sends
    one datagram for each frame."""
    patience_s: Positive = 2.0
    """Wall time without an answer after which the vehicle continues in real time until the latest
    beacon is answered. Before the first beacon is answered, the time counts from the first bytes
    of a client."""


class SigningConfig(Section):
    """MAVLink 2 signing on every link of the vehicle."""

    passphrase_file: Path
    """File whose first line is the passphrase; the passphrase's SHA-256 is the key, as in ground
    stations. A relative path is relative to the configuration file."""
    accept_unsigned: bool | None = None
    """Whether unsigned frames are accepted; frames with a wrong signature never are. Null:
    yes on ArduPilot's companion link (its SERIAL0), no on its other link and on PX4's links."""
    link_id: Annotated[int, Field(ge=0, le=254)] = 0
    """Link id of the companion link in signatures; the ground station link has the next id."""


class VehicleSettings(Section):
    """Every key of one vehicle, with the defaults that do not depend on the autopilot."""

    autopilot: Literal["px4", "ardupilot"] = "px4"
    """The simulated autopilot, which sets the default of ``sensors.ekf``. ArduPilot has its own
    defaults of ``airframe``, ``battery``, ``rate_loop``, ``sensors.rate_lag_ms``,
    ``sensors.stamp_slips_hz``, ``burst_ms`` and ``prearm_delay_s`` too."""
    port: Annotated[int, Field(ge=1, le=65535 - PORT_OFFSET)] = 14540
    endpoint: str = "udp"
    """The companion link. udp: see ``port``. tcpin://HOST:PORT: for one client; the vehicle boots
    when the client connects. serial:///PATH: a pseudo-terminal with a symbolic link at PATH."""
    gcs_port: Annotated[int, Field(ge=0, le=65535 - GCS_PORT_OFFSET)] = 14550
    """UDP port of the ground station; 0 = no ground station link."""
    control_port: Port = 0
    """UDP port of the JSON control channel on 127.0.0.1; 0 = none."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    speed: Annotated[float, Field(ge=0.01, le=1000.0)] = 1.0
    """How much faster than real time the simulation runs; ignored in lockstep."""
    inner_loop_hz: Literal[100, 250, 800] = 250
    """Inner loop rate, which limits the telemetry rates of PX4; ArduPilot uses SCHED_LOOP_RATE
    instead. The rate 100, which PX4's IMU_INTEG_RATE allows, was not recorded; it takes the least
    time to simulate."""
    exact_rates: bool | None = None
    """Whether a stream at the full rate is sent in every slot, that is, in every cycle in which the
    autopilot can send. false: PX4's 250 Hz loop skips some slots, as measured; PX4's other inner
    loop rates and ArduPilot never skip. Null: true in lockstep, else false."""
    burst_ms: NonNegative = 0.0
    """In real time the vehicle runs in bursts with this period of vehicle time, as ArduPilot's
    simulator does; 0 = no bursts. The default for ArduPilot is 5.6."""
    prearm_delay_s: NonNegative = 4.5
    """Duration of the boot. Before its end PX4 refuses arming, and ArduPilot refuses it in modes
    that need a position; in other modes ArduPilot arms after 56 % of this time. Measured: PX4 4.3
    to 6.5 s; ArduPilot 41.6 s, which is its default."""
    lockstep: LockstepConfig = LockstepConfig()
    signing: SigningConfig | None = None
    """Signing of all links; null: frames are not signed, and signatures are not checked."""
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
        """Return the settings of the vehicle with this index: its own ports, path and seed.

        Raises:
            ConfigError: its TCP port would be above 65535.
        """
        return self.model_copy(
            update={
                "port": self.port + index,
                "endpoint": endpoint_for_vehicle(self.endpoint, index),
                "gcs_port": self.gcs_port + index if self.gcs_port else 0,
                "control_port": self.control_port + index if self.control_port else 0,
                "seed": self.seed + index,
            }
        )
