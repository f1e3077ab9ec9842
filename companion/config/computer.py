"""The companion computer: its link to the autopilot, its scheduler, its disk."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, StrictBool, model_validator

from companion.files.yaml_file import PathKey, Section


class LinkConfig(Section):
    """How to reach the autopilot."""

    backend: Literal["direct", "mavsdk"] = "direct"
    """direct, or mavsdk: MAVSDK holds the connection, and our frames go by it (extra `mavsdk`)."""
    endpoint: Annotated[str, Field(max_length=300)] = "udpin://0.0.0.0:14540"
    """udpin://, udpout://, tcp://, tcpin:// with host:port, or serial://DEVICE:BAUD; udpin and
    tcpin also take ?peer=HOST[:PORT], to hear no other."""
    target_system: Annotated[int, Field(ge=1, le=255)] = 1
    """System id of the autopilot; every other system is ignored."""
    target_component: Annotated[int, Field(ge=1, le=255)] = 1
    """Component id of the autopilot."""
    source_system: Annotated[int, Field(ge=1, le=255)] = 1
    """Our own system id; a companion computer shares its vehicle's."""
    source_component: Annotated[int, Field(ge=1, le=255)] = 191
    """Our own component id; 191 is MAV_COMP_ID_ONBOARD_COMPUTER."""
    signing_key_file: PathKey | None = None
    """File whose first line is the passphrase: sign what we send, refuse what is not signed."""
    lockstep: StrictBool = False
    """Run on the bundled vehicle's clock, step by step. Never with a real vehicle."""
    attitude_rate_hz: Annotated[float, Field(ge=20.0, le=1000.0)] = 250.0
    """Asked of the autopilot for ATTITUDE_QUATERNION; the loop runs at what really arrives."""
    min_attitude_rate_hz: Annotated[float, Field(ge=10.0, le=1000.0)] = 50.0
    """Refuse to fly if less than this arrives."""
    position_rate_hz: Annotated[float, Field(ge=5.0, le=200.0)] = 50.0
    """Asked for LOCAL_POSITION_NED."""
    min_position_rate_hz: Annotated[float, Field(ge=1.0, le=200.0)] = 10.0
    """Refuse to fly if less than this arrives."""

    @model_validator(mode="after")
    def _consistent(self) -> "LinkConfig":
        if self.min_attitude_rate_hz > self.attitude_rate_hz:
            raise ValueError("min_attitude_rate_hz must not exceed attitude_rate_hz")
        if self.min_position_rate_hz > self.position_rate_hz:
            raise ValueError("min_position_rate_hz must not exceed position_rate_hz")
        if self.backend == "mavsdk" and (self.lockstep or self.signing_key_file is not None):
            raise ValueError("backend: mavsdk can neither fly in lockstep nor sign; use direct")
        ours, theirs = self.source_component, self.target_component
        if (self.source_system, ours) == (self.target_system, theirs):
            raise ValueError("source_system and source_component are the autopilot's own")
        return self


class RealtimeConfig(Section):
    """What is asked of the operating system: each is granted or not, and the flight says which."""

    scheduler: Literal["other", "fifo"] = "other"
    """other: as every program. fifo: before all of them (SCHED_FIFO), while it has work."""
    priority: Annotated[int, Field(ge=1, le=90)] = 50
    """Of fifo; the kernel's own threads for interrupts have 50, and above 90 are watchdogs."""
    cpu_affinity: Annotated[
        tuple[Annotated[int, Field(ge=0, le=1023)], ...], Field(max_length=1024)
    ] = ()
    """Run on these processors only, numbered from 0; none named: on any."""
    lock_memory: StrictBool = False
    """Keep all of the program's memory in RAM: no wait for the disk in the middle of a step."""
    freeze_gc: StrictBool = False
    """No garbage collection in flight; what it would have found is freed afterwards."""
    required: StrictBool = False
    """Refuse to fly unless all that is asked for is granted."""


class RecordingConfig(Section):
    """What is written down."""

    directory: PathKey = Path("flights")
    """Each flight makes a folder of its own in here."""
