"""The schedule of the faults, and their effects on the vehicle."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import nan, radians

from pymavlink.dialects.v20 import ardupilotmega
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.commander import Commander, ModeControl
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.config.faults import (
    EstimatorReset,
    FreezeClock,
    GpsLoss,
    LinkFault,
    LowBattery,
    NanField,
    PilotTakeover,
    RefuseArming,
    SlipClock,
    StopTelemetry,
    VehicleFault,
)
from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link
from sitl_mock.physics.vehicle import Vehicle


@dataclass
class _ScheduledFault:
    """A fault, its state, and the vehicle time at which it was injected, us."""

    fault: LinkFault | VehicleFault
    injected_us: int
    active: bool = False
    has_ended: bool = False


class FaultSchedule:
    """The faults that are still to come or active now.

    Attributes:
        link_faults: the link faults that are active now.
    """

    def __init__(self, faults: tuple[LinkFault | VehicleFault, ...]) -> None:
        self._entries = [_ScheduledFault(fault, 0) for fault in faults]
        self.link_faults: tuple[LinkFault, ...] = ()

    def add(self, fault: LinkFault | VehicleFault, now_us: int) -> None:
        """Add a fault; without a start it begins at the next update."""
        self._entries.append(_ScheduledFault(fault, now_us))

    def clear(self) -> list[VehicleFault]:
        """Remove all faults; return the vehicle faults that were active."""
        active_faults = [
            e.fault for e in self._entries if e.active and not isinstance(e.fault, LinkFault)
        ]
        self._entries = []
        self.link_faults = ()
        return active_faults

    def update(
        self, now_us: int, offboard_since_us: int | None
    ) -> tuple[list[VehicleFault], list[VehicleFault]]:
        """Advance to a time; return the vehicle faults that began and those that ended.

        Args:
            now_us: vehicle time.
            offboard_since_us: vehicle time when setpoints first had control; None: not yet.
        """
        if not self._entries:
            return [], []
        begun_faults: list[VehicleFault] = []
        ended_faults: list[VehicleFault] = []
        any_changed = False
        for entry in self._entries:
            is_active = self._is_active(entry, now_us, offboard_since_us)
            if is_active == entry.active:
                continue
            any_changed = True
            entry.active = is_active
            entry.has_ended = not is_active
            if not isinstance(entry.fault, LinkFault):
                (begun_faults if is_active else ended_faults).append(entry.fault)
        if any_changed:
            self._entries = [entry for entry in self._entries if not entry.has_ended]
            self.link_faults = tuple(
                e.fault for e in self._entries if e.active and isinstance(e.fault, LinkFault)
            )
        return begun_faults, ended_faults

    @staticmethod
    def _is_active(entry: _ScheduledFault, now_us: int, offboard_since_us: int | None) -> bool:
        fault = entry.fault
        if fault.after_offboard_s is not None:
            if offboard_since_us is None:
                return False
            start_us = max(offboard_since_us + fault.after_offboard_s * 1e6, entry.injected_us)
        elif fault.at_s is not None:
            start_us = max(fault.at_s * 1e6, entry.injected_us)
        else:
            start_us = entry.injected_us
        if now_us < start_us:
            return False
        return fault.duration_s is None or now_us < start_us + fault.duration_s * 1e6


@dataclass(eq=False)
class FaultEffects:
    """Applies vehicle faults; `Exchange` applies those of the link."""

    _state: State
    _vehicle: Vehicle
    """The simulated vehicle; faults change its estimator and its battery."""
    _commander: Commander
    """Refuses arming or changes the mode when a fault demands it."""
    _control: ModeControl
    """Control in the present mode; an estimator reset moves its held position and heading."""
    _links: list[Link]
    """Links whose messages `NanField` faults change."""
    offboard_since_us: int | None = field(default=None, init=False)
    """Vehicle time when setpoints first controlled the vehicle, us; None: not yet."""
    clock_frozen: bool = field(default=False, init=False)
    _telemetry_stops: list[StopTelemetry] = field(default_factory=list, init=False)
    _nan_fields: list[NanField] = field(default_factory=list, init=False)
    _gps_lost_us: int = field(default=0, init=False)
    _slip_s: float = field(default=0.0, init=False)

    def apply(self, begun_faults: list[VehicleFault], ended_faults: list[VehicleFault]) -> None:
        """Apply the faults that began, and undo those that ended, as far as they can be undone."""
        for fault in begun_faults:
            self._begin(fault)
        for fault in ended_faults:
            self._end(fault)

    def take_clock_slip(self) -> float:
        """Return the wall time lost to `SlipClock` faults since the last call, s."""
        slip_s, self._slip_s = self._slip_s, 0.0
        return slip_s

    def is_stopped(self, message_id: int) -> bool:
        """Whether a `StopTelemetry` fault stops a message now."""
        if not self._telemetry_stops:
            return False
        message_class = dialect.mavlink_map.get(message_id) or ardupilotmega.mavlink_map[message_id]
        name = message_class.msgname
        return any(not fault.messages or name in fault.messages for fault in self._telemetry_stops)

    def update_position_valid(self, position_valid_from_us: float, timeout_us: float) -> None:
        """Update ``position_valid`` of the autopilot's state.

        Args:
            position_valid_from_us: vehicle time from which on the position is valid.
            timeout_us: time for which the position stays valid without GPS.
        """
        state = self._state
        lost = not state.gps_ok and state.time_us - self._gps_lost_us >= timeout_us
        state.position_valid = state.time_us >= position_valid_from_us and not lost

    def _begin(self, fault: VehicleFault) -> None:
        match fault:
            case StopTelemetry():
                self._telemetry_stops.append(fault)
            case FreezeClock():
                self.clock_frozen = True
            case SlipClock():
                self._slip_s += fault.slip_ms * 1e-3
            case NanField():
                self._nan_fields.append(fault)
                self._set_link_hooks()
            case PilotTakeover():
                self._commander.take_over(Mode[fault.mode])
            case EstimatorReset():
                yaw_step = radians(fault.yaw_deg)
                self._vehicle.estimator.shift(yaw=yaw_step, position_ned=fault.position_ned_m)
                self._control.shift(yaw_step, fault.position_ned_m)
            case RefuseArming():
                self._commander.arming_refusal = fault.reason
            case LowBattery():
                self._vehicle.set_battery_remaining(fault.remaining)
            case GpsLoss():
                self._state.gps_ok = False
                self._gps_lost_us = self._state.time_us

    def _end(self, fault: VehicleFault) -> None:
        match fault:
            case StopTelemetry():
                self._telemetry_stops.remove(fault)
            case FreezeClock():
                self.clock_frozen = False
            case NanField():
                self._nan_fields.remove(fault)
                self._set_link_hooks()
            case PilotTakeover():
                self._commander.pilot_simulated = False
            case RefuseArming():
                self._commander.arming_refusal = None
            case GpsLoss():
                self._state.gps_ok = True
            case EstimatorReset() | LowBattery() | SlipClock():
                pass  # these cannot be undone

    def _set_link_hooks(self) -> None:
        for link in self._links:
            link.tamper = self._corrupt if self._nan_fields else None

    def _corrupt(self, message: Message) -> None:
        for fault in self._nan_fields:
            if message.get_type() == fault.message:
                value = getattr(message, fault.field)
                corrupted = [nan] * len(value) if isinstance(value, Sequence) else nan
                setattr(message, fault.field, corrupted)
