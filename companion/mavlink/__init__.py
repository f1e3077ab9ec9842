"""Everything that knows MAVLink: one link to one vehicle, over UDP, TCP or serial."""

from companion.mavlink.command import Command
from companion.mavlink.endpoint import Endpoint, parse_endpoint
from companion.mavlink.errors import (
    CommandRefused,
    CommandTimeout,
    EndpointError,
    InvalidSetpoint,
    LinkError,
    LinkLost,
    LinkTimeout,
    LogError,
    NonFiniteSetpoint,
    NotConnected,
    ParameterError,
    ParameterRefused,
    SigningError,
    UnansweredParameter,
    UnknownMessage,
    UnknownParameter,
    UnsupportedAutopilot,
)
from companion.mavlink.families import family_for
from companion.mavlink.family import AutopilotFamily
from companion.mavlink.link import Link
from companion.mavlink.records import Heartbeat
from companion.mavlink.samples import AttitudeSample
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import Signing, key_from_hex, key_from_passphrase_file
from companion.mavlink.state import VehicleState
from companion.mavlink.stats import LinkStats
from companion.mavlink.streams import StreamRate

__all__ = [
    "AttitudeSample",
    "AutopilotFamily",
    "Command",
    "CommandRefused",
    "CommandTimeout",
    "Endpoint",
    "EndpointError",
    "Heartbeat",
    "InvalidSetpoint",
    "Link",
    "LinkError",
    "LinkLost",
    "LinkSettings",
    "LinkStats",
    "LinkTimeout",
    "LogError",
    "NonFiniteSetpoint",
    "NotConnected",
    "ParameterError",
    "ParameterRefused",
    "Signing",
    "SigningError",
    "StreamRate",
    "UnansweredParameter",
    "UnknownMessage",
    "UnknownParameter",
    "UnsupportedAutopilot",
    "VehicleState",
    "family_for",
    "key_from_hex",
    "key_from_passphrase_file",
    "parse_endpoint",
]
