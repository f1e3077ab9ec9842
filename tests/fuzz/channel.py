"""The way between a vehicle and a flight, and what goes wrong on it: a script of events."""

import asyncio
from collections.abc import Callable, Iterable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from tests.fuzz.frames import frame_of
from tests.fuzz.judge import Judge
from tests.fuzz.messages import EVERY, KINDS, sends
from tests.fuzz.vehicle import STEP, Vehicle
from tests.fuzz.wires import Wire

Event = dict[str, Any]
_UPLINK_S = 0.004
_EVENT = 410
_KINDS = {kind.msgname: kind for kind in KINDS.values()}


class Channel:
    """Brings each side what the other says, and does what the script says.

    An event begins `after` seconds after the phase named in `phase` did; most last `seconds`.

    Args:
        vehicle: one side.
        judge: sees all that passes.
        events: the script.
        interrupt: what Ctrl-C does.
    """

    def __init__(
        self, vehicle: Vehicle, judge: Judge, events: Iterable[Event], interrupt: Callable[[], Any]
    ) -> None:
        self.wire = Wire(self._uplink)
        self._vehicle, self._judge, self._interrupt = vehicle, judge, interrupt
        self._loop = asyncio.get_running_loop()
        self._waiting = [dict(event) for event in events]
        self._active: list[tuple[Event, float]] = []
        self._held: list[tuple[bytes, float]] = []
        self._mav = dialect.MAVLink(None, 1, 1)
        self._steps = 0
        self._shift_ms = 0
        vehicle.say = self.say

    def phase(self, name: str) -> None:
        """A phase of the flight begins: what waits for it is due."""
        now = self._loop.time()
        due = [event for event in self._waiting if event.get("phase", "connect") == name]
        self._waiting = [event for event in self._waiting if event not in due]
        for event in due:
            self._loop.call_at(now + event.get("after", 0.0), self._begin, event)

    async def run(self) -> None:
        """Let the vehicle live until cancelled."""
        while True:
            self._vehicle.step()
            self._steps += 1
            for name, every in EVERY.items():
                if self._steps % every == 0 and sends(self._vehicle.family, name):
                    self.say(self._vehicle.message(name))
            await asyncio.sleep(STEP)

    # --- to the flight

    def say(self, message: Any, source: tuple[int, int] = (1, 1)) -> None:
        """Send a message of the vehicle's, with what the script does to it."""
        name = message.get_type()
        if hasattr(message, "time_boot_ms"):
            message.time_boot_ms = (message.time_boot_ms + self._shift_ms) & 0xFFFFFFFF
        copies, late = 1, 0.0
        for event in self._now():
            match event["kind"]:
                case "field" if event["message"] == name:
                    _set(message, event["field"], event["value"])
                case "silence" if name in (event["messages"] or [name]):
                    return
                case "copies":
                    copies = event["count"]
                case "delay":
                    late = event["by"]
        frame = _packed(self._mav, message, source)
        if frame is None:
            return
        made_at = self._loop.time()
        for _ in range(copies):
            self._carry(frame, made_at, late)

    def _carry(self, frame: bytes, made_at: float, late: float) -> None:
        kinds = {event["kind"] for event in self._now()}
        if kinds & {"hold", "swap"}:
            self._held.append((frame, made_at))
            if "hold" not in kinds and len(self._held) >= 2:
                self._let_go(backwards=True)
            return
        self._let_go()
        if late > 0.0:
            self._loop.call_later(late, self._deliver, frame, made_at)
        else:
            self._deliver(frame, made_at)

    def _let_go(self, *, backwards: bool = False) -> None:
        held, self._held = self._held, []
        for frame, made_at in reversed(held) if backwards else held:
            self._deliver(frame, made_at)

    def _deliver(self, frame: bytes, made_at: float) -> None:
        self._judge.arrives(frame, made_at, self._loop.time())
        self.wire.deliver(frame, received_ns=0)
        self._judge.delivered()

    # --- from the flight

    def _uplink(self, frame: bytes) -> None:
        message = self._judge.sent(frame)
        if not any(event["kind"] == "deaf" for event in self._now()):
            self._loop.call_later(_UPLINK_S, self._vehicle.hear, message)

    # --- the script

    def _now(self) -> list[Event]:
        now = self._loop.time()
        self._active = [(event, until) for event, until in self._active if until > now]
        return [event for event, _ in self._active]

    def _begin(self, event: Event) -> None:
        vehicle = self._vehicle
        match event["kind"]:
            case "say":
                self._inject(event, event.get("count", 1))
            case "bytes":
                self._deliver(bytes.fromhex(event["hex"]), self._loop.time())
            case "event":
                frame = frame_of(_EVENT, bytes.fromhex(event["payload"]))
                self._deliver(frame, self._loop.time())
            case "stamps":
                self._shift_ms += event["by_ms"]
                self._judge.clock_set()
            case "restart":
                vehicle.boot_s, vehicle.armed, self._mav.seq = 0.0, False, 0
                self._judge.clock_set()
            case "mode":
                vehicle.mode, vehicle.by_rates = event["mode"], False
            case "armed":
                vehicle.armed = event["armed"]
            case "jump":
                vehicle.position = [
                    a + b for a, b in zip(vehicle.position, event["by"], strict=True)
                ]
            case "interrupt":
                self._interrupt()
            case "ack":
                vehicle.acks[event["command"]] = event["result"]
            case _:
                self._active.append((event, self._loop.time() + event["seconds"]))

    def _inject(self, event: Event, count: int) -> None:
        message = self._vehicle.message(event["message"]) if event["message"] in EVERY else None
        if message is None:
            message = _blank(event["message"])
        for field, value in event["fields"].items():
            _set(message, field, value)
        source = tuple(event.get("source", (1, 1)))
        frame = _packed(self._mav, message, source)
        if frame is not None:
            self._deliver(frame, self._loop.time())
        if count > 1:
            self._loop.call_later(event.get("period", STEP), self._inject, event, count - 1)


def _blank(name: str) -> Any:
    """A message with nothing in it."""
    kind = _KINDS[name]
    empty = [
        b"" if type_ == "char" else [0] * length if length else 0
        for type_, length in zip(kind.fieldtypes, _lengths(kind), strict=True)
    ]
    return kind(*empty)


def _lengths(kind: Any) -> list[int]:
    """Of each field in the order of the fields: 0 for one that is no list."""
    return [kind.array_lengths[kind.orders[k]] for k in range(len(kind.orders))]


def _set(message: Any, field: str, value: Any) -> None:
    """Set a field as far as the message has it."""
    old = getattr(message, field, None)
    if isinstance(value, dict):
        if not isinstance(old, int | float):
            return
        value = old + value["add"] if isinstance(old, float) else old + int(value["add"])
    if isinstance(old, list | tuple):
        value = [value if isinstance(value, type(old[0])) else old[0], *old[1:]]
    if isinstance(old, str | bytes):
        value = str(value).encode("ascii", "replace")[:16]
    if old is not None:
        setattr(message, field, value)


def _packed(mav: Any, message: Any, source: tuple[int, int]) -> bytes | None:
    """The frame, or None for values that its fields cannot hold."""
    mav.srcSystem, mav.srcComponent = source
    try:
        frame = bytes(message.pack(mav))
    except Exception:  # struct.error, OverflowError, TypeError: no such message can be sent
        return None
    if source == (1, 1):
        mav.seq = (mav.seq + 1) & 0xFF
    return frame
