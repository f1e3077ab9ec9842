"""All keys of the ``mock:`` section."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from sitl_mock.config.section import Finite, Positive, Section

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
