"""Who may command the vehicle: programs on this computer, clients that sign, trusted clients.

All others may listen and read: parameters, missions, logs, files, single messages.
"""

from collections.abc import Iterable

from companion.mavlink.framing import Frame
from companion.mavlink.messages import dialect
from companion.mavlink.peer import plain_host
from companion.mavlink.signing import Signing
from companion.mavlink.stamps import SignatureResult
from companion.serve.network.client import Client

_READING_MESSAGES = frozenset(
    {
        dialect.MAVLINK_MSG_ID_PING,
        dialect.MAVLINK_MSG_ID_TIMESYNC,
        dialect.MAVLINK_MSG_ID_PARAM_REQUEST_READ,
        dialect.MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
        dialect.MAVLINK_MSG_ID_MISSION_REQUEST_LIST,
        dialect.MAVLINK_MSG_ID_MISSION_REQUEST,
        dialect.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
        dialect.MAVLINK_MSG_ID_MISSION_ACK,
        dialect.MAVLINK_MSG_ID_LOG_REQUEST_LIST,
        dialect.MAVLINK_MSG_ID_LOG_REQUEST_DATA,
        dialect.MAVLINK_MSG_ID_LOG_REQUEST_END,
    }
)
"""Messages that change nothing on the vehicle. HEARTBEAT is not among them: heartbeats of a ground
station hold off the autopilot's failsafe for a lost ground station."""
_READING_COMMANDS = frozenset(
    {
        dialect.MAV_CMD_REQUEST_MESSAGE,
        dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION,
        dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
    }
)
COMMAND_IDS = dialect.MAVLINK_MSG_ID_COMMAND_LONG, dialect.MAVLINK_MSG_ID_COMMAND_INT
_COMMAND_OFFSET = 28
"""Offset of the command's number in COMMAND_LONG and COMMAND_INT, after seven 4-byte fields."""
_FTP_ID = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
_OPCODE_OFFSET = 6
"""Offset of the opcode in FILE_TRANSFER_PROTOCOL, after addresses, sequence number and session."""
_READING_OPCODES = frozenset({0, 1, 2, 3, 4, 5, 14, 15})
"""FTP opcodes that change nothing on the vehicle: None, TerminateSession, ResetSessions,
ListDirectory, OpenFileRO, ReadFile, CalcFileCRC32, BurstReadFile. Source: the MAVLink guide."""


def reads_only(frame: Frame) -> bool:
    """Whether a frame changes nothing on the vehicle."""
    if frame.message_id in COMMAND_IDS:
        padded = frame.payload.ljust(_COMMAND_OFFSET + 2, b"\0")
        return (
            int.from_bytes(padded[_COMMAND_OFFSET : _COMMAND_OFFSET + 2], "little")
            in _READING_COMMANDS
        )
    if frame.message_id == _FTP_ID:
        return frame.payload.ljust(_OPCODE_OFFSET + 1, b"\0")[_OPCODE_OFFSET] in _READING_OPCODES
    return frame.message_id in _READING_MESSAGES


class Permission:
    """Decides which frames of a client are forwarded.

    Args:
        trusted: hosts and serial devices whose clients may command without a signature.
        signing: checks the signatures of clients; None: a signature permits nothing.
    """

    def __init__(self, trusted: Iterable[str], signing: Signing | None) -> None:
        self._trusted = frozenset(map(plain_host, trusted))
        self._signing = signing

    def refusal(self, client: Client, frame: Frame) -> str | None:
        """Why a frame is not forwarded, as a text for the client; None: it is forwarded."""
        if reads_only(frame) or client.is_local or (client.host or client.device) in self._trusted:
            return None
        if self._signing is None:
            return "read-only: name your host or serial device in serve.trusted"
        if self._signing.check(frame) is SignatureResult.GOOD:
            return None
        return "read-only: sign with the vehicle's key, or see serve.trusted"
