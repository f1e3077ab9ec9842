"""The autopilot's mode and arming, from HEARTBEAT and CURRENT_MODE."""

from collections.abc import Callable
from math import inf

from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.errors import UnsupportedAutopilot
from companion.mavlink.messages import Message, dialect
from companion.vehicle.autopilot import Autopilot
from companion.vehicle.records import CurrentMode, Heartbeat
from companion.vehicle.registry import MULTIROTORS, autopilot_for

_FAILSAFE_STATES = frozenset({5, 6, 8})
"""MAV_STATE of an autopilot in a failsafe: critical, emergency, flight termination."""


class ModeState:
    """The newest heartbeat and mode; each is `None` until its message has come.

    Args:
        clock: returns the event-loop time, s.

    Attributes:
        heartbeat: the newest HEARTBEAT of the autopilot.
        current_mode: the newest CURRENT_MODE; `mode` is from HEARTBEAT or CURRENT_MODE, the newer.
        heartbeat_is_newest: whether HEARTBEAT is newer than CURRENT_MODE; `armed` is then as new as
            `mode`.
        arming_count: number of times that a heartbeat showed a newly armed vehicle.
        autopilot: how to command the vehicle; known from the first heartbeat of an autopilot that
            this program flies.
        unsupported_error: the error to raise if this program cannot fly the autopilot.
    """

    def __init__(self, dispatcher: MessageDispatcher, clock: Callable[[], float]) -> None:
        self._clock = clock
        self.heartbeat: Heartbeat | None = None
        self.current_mode: CurrentMode | None = None
        self.heartbeat_is_newest = True
        self.arming_count = 0
        self.autopilot: Autopilot | None = None
        self.unsupported_error: UnsupportedAutopilot | None = None
        self._base_mode = 0
        dispatcher.subscribe("HEARTBEAT", self._on_heartbeat)
        dispatcher.subscribe("CURRENT_MODE", self._on_current_mode)

    @property
    def mode(self) -> str | None:
        """Name of the present mode, from the newer of HEARTBEAT and CURRENT_MODE."""
        heartbeat, current = self.heartbeat, self.current_mode
        if heartbeat is None:
            return None
        return heartbeat.mode if current is None or self.heartbeat_is_newest else current.mode

    @property
    def mode_received_at(self) -> float:
        """Event-loop time at which a mode was last received, s; −inf if none was."""
        messages = (self.heartbeat, self.current_mode)
        return max((each.received for each in messages if each is not None), default=-inf)

    @property
    def armed(self) -> bool | None:
        """Whether the vehicle is armed; None before the first heartbeat."""
        return self.heartbeat.armed if self.heartbeat else None

    @property
    def failsafe(self) -> bool:
        """Whether HEARTBEAT's system_status reports a failsafe; False without any heartbeat."""
        return self.heartbeat is not None and self.heartbeat.system_status in _FAILSAFE_STATES

    @property
    def mode_not_intended(self) -> bool:
        """Whether CURRENT_MODE tells that a failsafe chose the present mode, not a user."""
        current = self.current_mode
        return current is not None and self.mode == current.mode != current.intended

    @property
    def mode_by_failsafe(self) -> bool:
        """Whether a failsafe chose the present mode, as far as the autopilot reports it."""
        return self.failsafe or self.mode_not_intended

    def _on_heartbeat(self, message: Message) -> None:
        if message.autopilot == dialect.MAV_AUTOPILOT_INVALID:
            return  # another component that uses the autopilot's id
        if self.autopilot is None:
            try:
                self.autopilot = autopilot_for(message.autopilot, message.type)
                self.unsupported_error = None
            except UnsupportedAutopilot as error:
                self.unsupported_error = error
        elif message.autopilot != self.autopilot.mav_autopilot or message.type not in MULTIROTORS:
            return  # another component: the kind of an autopilot does not change
        armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
        self.arming_count += armed and not self.armed
        mode = str(message.custom_mode)
        if self.autopilot is not None:
            mode = self.autopilot.mode_name(message.base_mode, message.custom_mode)
        self.heartbeat = Heartbeat(self._clock(), mode, armed, message.system_status)
        self._base_mode = message.base_mode
        self.heartbeat_is_newest = True

    def _on_current_mode(self, message: Message) -> None:
        if self.autopilot is None:
            return  # the meaning of the mode's number is not known yet
        mode, intended_mode = (
            self.autopilot.mode_name(self._base_mode, number)
            # MAVLink: an intended mode of 0 is unknown; then the present mode counts as intended.
            for number in (message.custom_mode, message.intended_custom_mode or message.custom_mode)
        )
        self.current_mode = CurrentMode(self._clock(), mode, intended_mode)
        self.heartbeat_is_newest = False
