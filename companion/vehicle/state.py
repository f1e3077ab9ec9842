"""The vehicle's newest telemetry. Values that are not finite are never kept."""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

from companion.attitude import Quaternion, is_unit
from companion.mavlink.codec import decode_reset_counter
from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.messages import Message
from companion.mavlink.stats import LinkStats
from companion.mavlink.texts import TextAssembler
from companion.vehicle.autopilot import Readiness
from companion.vehicle.clock import VehicleClock
from companion.vehicle.mode_state import ModeState
from companion.vehicle.records import (
    GPS_FIX_3D,
    AttitudeTarget,
    AttitudeTargetThrust,
    Battery,
    EstimatorStatus,
    GlobalPosition,
    Gps,
    Home,
    LandedState,
    LocalPosition,
    PrearmStatus,
    gps_fault,
    is_outdated,
)

GROUND_HEIGHT = 1.5
"""Largest height above home that counts as on the ground, m, because the estimate drifts."""
_UNKNOWN_MV = 65535
_PREARM_CHECK_BIT = 0x10000000
_LANDED_UNDEFINED, LANDED_ON_GROUND, LANDED_TAKEOFF = 0, 1, 3


@dataclass
class _NewestRecords:
    landed_state: LandedState | None = None
    position: LocalPosition | None = None
    battery: Battery | None = None
    attitude_target_thrust: AttitudeTargetThrust | None = None
    attitude_target: AttitudeTarget | None = None
    global_position: GlobalPosition | None = None
    gps: Gps | None = None
    home: Home | None = None
    estimator: EstimatorStatus | None = None
    position_count: int = 0
    prearm: PrearmStatus | None = None
    gps_was_good: bool = False
    reset_counter: int | None = None


class VehicleState(ModeState, _NewestRecords):
    """The newest record of each kind of telemetry; each is `None` until its message has come.

    Mode and arming are in the base class `ModeState`.

    Attributes:
        landed_state: `LandedState`, even if it is outdated; `landed`, `flying` and `taking_off`
            then count it as unknown.
        position: `LocalPosition` with the newest time stamp of the vehicle.
        attitude_target: `AttitudeTarget`; only of an autopilot with `rates_about_target_axes`, and
            only with a unit quaternion.
        global_position: `GlobalPosition`; `None` until the vehicle knows it.
        attitude_target_thrust, battery, gps, home, estimator, prearm: see the record of each.
        position_count: number of positions accepted.
        gps_was_good: whether GPS has had a 3D fix since the link was opened.
        reset_counter: counter in ODOMETRY that rises whenever the estimate jumps.
        texts: texts of the autopilot, newest last.
    """

    def __init__(
        self,
        dispatcher: MessageDispatcher,
        stats: LinkStats,
        texts: TextAssembler,
        clock: Callable[[], float],
        vehicle_clock: VehicleClock,
    ) -> None:
        _NewestRecords.__init__(self)
        ModeState.__init__(self, dispatcher, clock)
        self._stats, self._vehicle_clock = stats, vehicle_clock
        self.texts = texts.texts
        for name, callback in {
            "EXTENDED_SYS_STATE": self._on_extended_sys_state,
            "LOCAL_POSITION_NED": self._on_local_position,
            "SYS_STATUS": self._on_sys_status,
            "BATTERY_STATUS": self._on_battery,
            "ATTITUDE_TARGET": self._on_attitude_target,
            "GLOBAL_POSITION_INT": self._on_global_position,
            "GPS_RAW_INT": self._on_gps,
            "HOME_POSITION": self._on_home,
            "ESTIMATOR_STATUS": self._on_estimator,
            "EKF_STATUS_REPORT": self._on_estimator,
            "STATUSTEXT": lambda message: texts.take(message, clock()),
        }.items():
            dispatcher.subscribe(name, callback)
        dispatcher.subscribe_raw("ODOMETRY", self._on_odometry)

    def forget(self) -> None:
        """Forget all but heartbeat, autopilot and texts; the rest may be of another vehicle."""
        self.current_mode, self.arming_count = None, 0
        _NewestRecords.__init__(self)

    @property
    def landed(self) -> bool:
        """Whether the autopilot reports that it is on the ground; False if unknown."""
        return self._landed_state() == LANDED_ON_GROUND

    @property
    def flying(self) -> bool:
        """Whether the autopilot reports that it is in the air; False if unknown."""
        return self._landed_state() not in (None, _LANDED_UNDEFINED, LANDED_ON_GROUND)

    @property
    def taking_off(self) -> bool:
        """Whether the autopilot reports that it is taking off."""
        return self._landed_state() == LANDED_TAKEOFF

    @property
    def battery_silent(self) -> bool:
        """Whether the battery, or its charge, was reported before and is no longer reported."""
        battery, now = self.battery, self._clock()
        arrivals = () if battery is None else (battery.received, battery.charge_received)
        return any(time is not None and is_outdated(time, now) for time in arrivals)

    @property
    def height(self) -> float | None:
        """Height above home, m; None while position or home is unknown."""
        if self.position is None or self.home is None:
            return None
        return self.home.down - self.position.position_ned[2]

    @property
    def readiness(self) -> Readiness:
        """The telemetry that decides about arming; outdated telemetry counts as unknown."""
        now = self._clock()
        prearm, estimator, position = self.prearm, self.estimator, self.position
        return Readiness(
            None if prearm is None or is_outdated(prearm.received, now) else prearm.passed,
            None if estimator is None or is_outdated(estimator.received, now) else estimator.flags,
            position is not None and not is_outdated(position.received, now),
            self.home is not None,
        )

    @property
    def gps_fault(self) -> str | None:
        """Fault of a GPS that has had a 3D fix, in words; `None`: no fault."""
        return gps_fault(self.gps, self._clock()) if self.gps_was_good else None

    def _on_extended_sys_state(self, message: Message) -> None:
        self.landed_state = LandedState(self._clock(), message.landed_state)

    def _landed_state(self) -> int | None:
        landed, now = self.landed_state, self._clock()
        return None if landed is None or is_outdated(landed.received, now) else landed.state

    def _on_local_position(self, message: Message) -> None:
        values = (message.x, message.y, message.z, message.vx, message.vy, message.vz)
        if not all(map(isfinite, values)):
            self._stats.refuse_non_finite("LOCAL_POSITION_NED", self._clock())
            return
        clock, now, newest = self._vehicle_clock, self._clock(), self.position
        stamp = clock.vehicle_time(message.time_boot_ms)
        if clock.is_ahead(stamp, now):
            self._stats.stamped_ahead += 1
        elif (
            newest is not None
            and stamp <= newest.vehicle_time
            and not clock.is_ahead(newest.vehicle_time, now)  # came before the clock was known
        ):
            self._stats.outdated += 1
        else:
            self.position_count += 1
            self.position = LocalPosition(now, stamp, values[:3], values[3:])

    def _on_sys_status(self, message: Message) -> None:
        millivolts = message.voltage_battery
        self._take_battery(
            None if millivolts == _UNKNOWN_MV else millivolts / 1000.0, message.battery_remaining
        )
        prearm_passed = bool(message.onboard_control_sensors_health & _PREARM_CHECK_BIT)
        self.prearm = PrearmStatus(self._clock(), prearm_passed)

    def _on_odometry(self, payload: bytes) -> None:
        self.reset_counter = decode_reset_counter(payload)

    def _on_battery(self, message: Message) -> None:
        if message.id != 0:
            return
        # A battery without known cells reports its whole voltage in parts of 65534 mV.
        cells = [cell for cell in message.voltages if cell != _UNKNOWN_MV]
        cells += [cell for cell in message.voltages_ext if cell not in (0, _UNKNOWN_MV)]
        self._take_battery(sum(cells) / 1000.0 if cells else None, message.battery_remaining)

    def _take_battery(self, voltage_v: float | None, percent: int) -> None:
        remaining = None if percent < 0 else percent / 100.0
        now = self._clock()
        newest = Battery(now, voltage_v, remaining, None if remaining is None else now)
        self.battery = newest if self.battery is None else self.battery.replaced_by(newest)

    def _on_attitude_target(self, message: Message) -> None:
        if 0.0 <= message.thrust <= 1.0:
            self.attitude_target_thrust = AttitudeTargetThrust(self._clock(), message.thrust)
        elif not isfinite(message.thrust):
            self._stats.refuse_non_finite("ATTITUDE_TARGET", self._clock())
        autopilot = self.autopilot
        if autopilot is not None and autopilot.rates_about_target_axes:
            self._take_attitude_target(message.time_boot_ms, tuple(message.q))

    def _take_attitude_target(self, time_boot_ms: int, q: Quaternion) -> None:
        if is_unit(q):
            self.attitude_target = AttitudeTarget(time_boot_ms, q)
        elif not all(map(isfinite, q)):
            self._stats.refuse_non_finite("ATTITUDE_TARGET", self._clock())

    def _on_global_position(self, message: Message) -> None:
        if message.lat == message.lon == 0:
            return  # ArduPilot sends zeros until it knows its position
        self.global_position = GlobalPosition(self._clock(), message.lat / 1e7, message.lon / 1e7)

    def _on_gps(self, message: Message) -> None:
        count = message.satellites_visible
        satellites = None if count == 255 else count
        self.gps = Gps(self._clock(), message.fix_type, satellites, message.alt / 1000.0)
        self.gps_was_good = self.gps_was_good or message.fix_type >= GPS_FIX_3D

    def _on_home(self, message: Message) -> None:
        if not isfinite(message.z):
            self._stats.refuse_non_finite("HOME_POSITION", self._clock())
            return
        self.home = Home(
            self._clock(),
            message.latitude / 1e7,
            message.longitude / 1e7,
            message.altitude / 1000.0,
            message.z,
        )

    def _on_estimator(self, message: Message) -> None:
        self.estimator = EstimatorStatus(self._clock(), message.flags)
