"""What each error of a command means to the shell, and how it is told."""

import asyncio

from rich.console import Console

from companion.demo import VehicleStoppedError
from companion.extras import MissingExtraError
from companion.files.yaml_file import ConfigError
from companion.mavlink.errors import EndpointError, LinkError, LogError, SigningError
from companion.realtime import RealtimeError
from companion.recording.figure import FigureError

USAGE = (
    ConfigError,
    EndpointError,
    FigureError,
    LogError,
    MissingExtraError,
    RealtimeError,
    SigningError,
)
"""The command line or the configuration is wrong."""
FLIGHT = LinkError, OSError, VehicleStoppedError
"""The flight failed, or what it needs did."""
CANCELLED = asyncio.CancelledError


def say(text: str) -> None:
    """Print one sentence on standard error."""
    Console(stderr=True).print(f"companion: {text}", markup=False, highlight=False, soft_wrap=True)
