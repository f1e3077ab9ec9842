"""The companion computer: its link to the autopilot, its scheduler, its disk."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from companion.files.yaml_file import PathKey, Section


class LinkConfig(Section):
    """How to reach the autopilot."""

    backend: Literal["direct", "mavsdk"] = "direct"
    """direct: our own connection. mavsdk: MAVSDK holds the connection and carries our frames (extra
    `mavsdk`)."""
    endpoint: Annotated[str, Field(max_length=300)] = "udpin://0.0.0.0:14540"
    """udpin://, udpout://, tcp://, tcpin:// with host:port, or serial://DEVICE:BAUD. udpin and
    tcpin also take ?peer=HOST[:PORT] to accept no other peer. udp://:PORT, as other programs
    write it, means udpin://0.0.0.0:PORT.
    """
    target_system: Annotated[int, Field(ge=1, le=255)] = 1
    """System id of the autopilot; every other system is ignored."""
    target_component: Annotated[int, Field(ge=1, le=255)] = 1
    """Component id of the autopilot."""
    source_system: Annotated[int, Field(ge=1, le=255)] = 1
    """Our own system id; a companion computer has the same system id as its vehicle."""
    source_component: Annotated[int, Field(ge=1, le=255)] = 191
    """Our own component id; 191 is MAV_COMP_ID_ONBOARD_COMPUTER."""
    signing_key_file: PathKey | None = None
    """File whose first line is the signing passphrase. A relative path starts at the folder of the
    file that contains this key. With a passphrase we sign all messages and refuse unsigned ones."""
    lockstep: bool = False
    """Run on the mock vehicle's clock, step by step. Never with a real vehicle."""
    attitude_rate_hz: Annotated[float, Field(ge=20.0, le=1000.0)] = 250.0
    """Rate requested for ATTITUDE_QUATERNION. The control loop runs at the rate at which these
    messages arrive."""
    min_attitude_rate_hz: Annotated[float, Field(ge=10.0, le=1000.0)] = 50.0
    """Refuse to fly at a lower rate of attitudes; in flight, hand back if setpoints are sent at a
    lower rate for 1 s."""
    position_rate_hz: Annotated[float, Field(ge=5.0, le=200.0)] = 50.0
    """Rate requested for LOCAL_POSITION_NED."""
    min_position_rate_hz: Annotated[float, Field(ge=1.0, le=200.0)] = 10.0
    """Refuse to fly at a lower rate of positions; in flight, hand back if it is lower for 1 s."""

    @model_validator(mode="after")
    def _check_consistency(self) -> "LinkConfig":
        if self.min_attitude_rate_hz > self.attitude_rate_hz:
            raise ValueError("min_attitude_rate_hz must not exceed attitude_rate_hz")
        if self.min_position_rate_hz > self.position_rate_hz:
            raise ValueError("min_position_rate_hz must not exceed position_rate_hz")
        if self.backend == "mavsdk" and (self.lockstep or self.signing_key_file is not None):
            raise ValueError(
                "backend: mavsdk can neither fly in lockstep nor sign; set link.backend: direct"
            )
        source, target = self.source_component, self.target_component
        if (self.source_system, source) == (self.target_system, target):
            raise ValueError(
                "source_system and source_component must not both equal target_system and "
                "target_component; 191 is usual for source_component"
            )
        return self


class RealtimeConfig(Section):
    """Real-time settings, which the system grants or refuses; the flight reports the result."""

    scheduler: Literal["other", "fifo"] = "other"
    """other: the normal scheduler. fifo: SCHED_FIFO, which runs before all normal programs."""
    priority: Annotated[int, Field(ge=1, le=90)] = 50
    """Priority of fifo. The kernel's interrupt threads have 50, its watchdogs more than 90."""
    cpu_affinity: Annotated[
        tuple[Annotated[int, Field(ge=0, le=1023)], ...], Field(max_length=1024)
    ] = ()
    """Processors to run on, numbered from 0. Empty: any."""
    lock_memory: bool = False
    """Lock the program's memory in RAM, so that a step never waits for the disk."""
    freeze_gc: bool = False
    """Switch the garbage collector off until the flight has ended."""
    required: bool = False
    """Refuse to fly unless every requested setting is granted."""


class RecordingConfig(Section):
    """Recording of flights."""

    directory: PathKey = Path("flights")
    """Folder in which each flight makes its own folder; relative to the working folder."""
    report: bool = True
    """Write report.html into the flight's folder at the end of `fly`, `demo` and `serve` (extra
    `report`)."""
