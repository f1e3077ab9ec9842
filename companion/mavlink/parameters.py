"""Reads and writes parameters. Source: the MAVLink parameter protocol.

PX4 sends integers bytewise: the four bytes of the float field hold the integer. The bytes
of some integers are those of a NaN, which a float may not preserve, so this module uses the bytes.
"""

import asyncio
import struct
from collections.abc import Callable
from math import isfinite
from typing import NamedTuple

from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.errors import ParameterRefused, UnansweredParameter, UnknownParameter
from companion.mavlink.messages import MESSAGE_IDS, Message
from companion.mavlink.outbox import Outbox
from companion.mavlink.pending import AnswerQueue, AnswerQueueRegistry
from companion.mavlink.settings import LinkSettings

_VALUE_LAYOUT = struct.Struct("<4sHH16sB")
_SET_LAYOUT = struct.Struct("<4sBB16sB")
_READ_LAYOUT = struct.Struct("<hBB16s")
_INDEX_BY_NAME = -1  # `param_index` of a request by name
_MAX_NAME_LENGTH = 16

_INTEGER_LAYOUTS = {1: "<Bxxx", 2: "<bxxx", 3: "<Hxx", 4: "<hxx", 5: "<I", 6: "<i"}
_ERROR_TEXTS = {
    1: "the autopilot has no such parameter",
    2: "the value is out of range",
    3: "the parameter is read-only or may not be changed now",
    4: "the autopilot has no such component",
    5: "the parameter is read-only",
}


class _Value(NamedTuple):
    """The four bytes of a value, and its MAV_PARAM_TYPE."""

    raw: bytes
    param_type: int


class ParameterClient:
    """Reads and writes single parameters.

    Args:
        registry: keeps the queues of expected answers, so that a dropped connection ends each wait.
        bytewise: returns whether an integer is sent as its four bytes (PX4) instead of as a float
            (ArduPilot).
    """

    def __init__(
        self,
        settings: LinkSettings,
        outbox: Outbox,
        dispatcher: MessageDispatcher,
        registry: AnswerQueueRegistry,
        bytewise: Callable[[], bool],
    ) -> None:
        self._outbox, self._registry = outbox, registry
        self._target = settings.target_system, settings.target_component
        self._pending: dict[str, AnswerQueue[_Value | int]] = {}  # a value, or a MAV_PARAM_ERROR
        self._locks: dict[str, asyncio.Lock] = {}
        self._bytewise = bytewise
        dispatcher.subscribe_raw("PARAM_VALUE", self._on_value)
        dispatcher.subscribe("PARAM_ERROR", self._on_error)

    async def read(self, name: str, timeout_s: float, retries: int) -> float | int:
        """Read a parameter; see `VehicleClient.read_parameter`."""
        self._require_valid_name(name)
        async with self._locks.setdefault(name, asyncio.Lock()):
            return self._decoded(await self._request_value(name, timeout_s, retries))

    async def write(self, name: str, value: float, timeout_s: float, retries: int) -> float | int:
        """Write a parameter; see `VehicleClient.write_parameter`."""
        self._require_valid_name(name)
        async with self._locks.setdefault(name, asyncio.Lock()):
            param_type = (await self._request_value(name, timeout_s, retries)).param_type
            wanted_value = _Value(self._encoded(name, value, param_type), param_type)
            payload = _SET_LAYOUT.pack(wanted_value.raw, *self._target, name.encode(), param_type)
            reported_value = await self._exchange("PARAM_SET", payload, name, timeout_s, retries)
            if reported_value != wanted_value:
                # It may be a late or second answer to an earlier read.
                reported_value = await self._request_value(name, timeout_s, retries)
            if reported_value != wanted_value:
                raise ParameterRefused(
                    f"{name}: the autopilot keeps {self._decoded(reported_value)} instead of "
                    f"{value}"
                )
            return self._decoded(reported_value)

    async def _request_value(self, name: str, timeout_s: float, retries: int) -> _Value:
        payload = _READ_LAYOUT.pack(_INDEX_BY_NAME, *self._target, name.encode())
        return await self._exchange("PARAM_REQUEST_READ", payload, name, timeout_s, retries)

    async def _exchange(
        self, message: str, payload: bytes, name: str, timeout_s: float, retries: int
    ) -> _Value:
        with AnswerQueue[_Value | int](self._registry) as answers:
            self._pending[name] = answers
            try:
                for _ in range(retries + 1):
                    self._outbox.send_payload(MESSAGE_IDS[message], payload)
                    try:
                        answer = await answers.next(timeout_s)
                    except TimeoutError:
                        continue
                    if isinstance(answer, int):
                        raise _refusal(name, answer)
                    return answer
            finally:
                del self._pending[name]
        raise UnansweredParameter(
            f"{name}: no answer after {retries + 1} tries of {timeout_s:g} s; the autopilot "
            "probably has no parameter of that name (names change between versions)"
        )

    def value_in(self, payload: bytes) -> tuple[str, float | int]:
        """Name and value in the payload of a PARAM_VALUE; the autopilot must be known."""
        name, value = _name_and_value(payload)
        return name, self._decoded(value)

    def _require_valid_name(self, name: str) -> None:
        if not (0 < len(name) <= _MAX_NAME_LENGTH and name.isascii()):
            raise UnknownParameter(f"{name!r} is no parameter name: 1 to 16 ASCII characters")

    def _decoded(self, value: _Value) -> float | int:
        if self._bytewise() and value.param_type in _INTEGER_LAYOUTS:
            integer: int = struct.unpack(_INTEGER_LAYOUTS[value.param_type], value.raw)[0]
            return integer
        number: float = struct.unpack("<f", value.raw)[0]
        # NaN and infinity cannot become integers; the caller gets them unchanged.
        return int(number) if value.param_type in _INTEGER_LAYOUTS and isfinite(number) else number

    def _encoded(self, name: str, value: float, param_type: int) -> bytes:
        if not isfinite(value):
            raise ParameterRefused(f"{name} cannot hold {value}")
        try:
            if param_type not in _INTEGER_LAYOUTS:
                return struct.pack("<f", value)
            if value != int(value):
                raise ParameterRefused(f"{name} is an integer and cannot hold {value}")
            # Packed also when not bytewise, so that the range of the integer type is checked.
            packed = struct.pack(_INTEGER_LAYOUTS[param_type], int(value))
            return packed if self._bytewise() else struct.pack("<f", value)
        except (struct.error, OverflowError, ValueError) as error:
            raise ParameterRefused(f"{name} cannot hold {value}: {error}") from error

    def _on_value(self, payload: bytes) -> None:
        name, value = _name_and_value(payload)
        answers = self._pending.get(name)
        if answers is not None:
            answers.put(value)

    def _on_error(self, message: Message) -> None:
        answers = self._pending.get(message.param_id)
        if answers is not None:
            answers.put(message.error)


def _name_and_value(payload: bytes) -> tuple[str, _Value]:
    padded = payload.ljust(_VALUE_LAYOUT.size, b"\0")
    raw, _, _, name, param_type = _VALUE_LAYOUT.unpack_from(padded)
    return name.split(b"\0", 1)[0].decode("ascii", errors="replace"), _Value(raw, param_type)


def _refusal(name: str, code: int) -> UnknownParameter | ParameterRefused:
    reason = _ERROR_TEXTS.get(code, f"error {code}")
    error_class = UnknownParameter if code == 1 else ParameterRefused
    return error_class(f"{name}: {reason}")
