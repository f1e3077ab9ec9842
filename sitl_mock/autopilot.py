"""The autopilot: messages in, messages out, one vehicle flown, in vehicle time (no I/O)."""

from collections.abc import Callable
from math import radians

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.announcer import Announcer
from sitl_mock.commander import Commander
from sitl_mock.commands import Commands
from sitl_mock.fault_effects import FaultEffects
from sitl_mock.faults import FaultSchedule
from sitl_mock.geodesy import Origin
from sitl_mock.land_detector import LandDetector
from sitl_mock.link import Link
from sitl_mock.mode_control import ModeControl
from sitl_mock.modes import Mode
from sitl_mock.offboard import OffboardStream
from sitl_mock.parameter_protocol import ParameterProtocol
from sitl_mock.parameters import ParameterTable
from sitl_mock.personality import Occasion, Personality
from sitl_mock.px4 import Px4
from sitl_mock.receiver import Receiver
from sitl_mock.settings import MockSettings
from sitl_mock.state import State
from sitl_mock.streams import SLOT_US, StreamSchedule
from sitl_mock.system_telemetry import SystemTelemetry
from sitl_mock.telemetry import Builder, MotionTelemetry
from sitl_mock.vehicle import Vehicle
from sitl_mock.wire import Framer, Message

COMMANDER_PERIOD_US = 50_000
"""The rules of state run this often, vehicle time."""

CONVERGED_SHARE = 0.7
"""The position becomes valid this far into the time before arming is possible (recorded: 3.2 s)."""


class Autopilot:
    """One vehicle with its autopilot.

    Args:
        settings: everything that can be set.
        system_id: MAVLink system id.
    """

    def __init__(self, settings: MockSettings, system_id: int = 1) -> None:
        personality: Personality = Px4()
        overrides = {"MAV_SYS_ID": float(system_id), **settings.parameters}
        self.parameters = ParameterTable(personality.parameters(), overrides)
        home = settings.home
        origin = Origin(home.latitude_deg, home.longitude_deg, home.altitude_m)
        self.vehicle = Vehicle(
            settings.airframe,
            settings.rate_loop,
            settings.wind,
            settings.battery,
            settings.sensors,
            seed=settings.seed,
            heading=radians(home.heading_deg),
        )
        self.state = State(self.vehicle.estimate())
        self._slot_us = _slot_us(settings)
        self._slots = 0
        self._rate_hz = settings.airframe.physics_rate_hz
        self._next_commander_us = 0
        self._converged_us = CONVERGED_SHARE * settings.prearm_delay_s * 1e6
        self.stream = OffboardStream()
        framers = {name: Framer(system_id, 1) for name in ("companion", "gcs")}
        self.companion = _link("companion", framers, personality, settings)
        self.gcs = _link("gcs", framers, personality, settings)
        self.links = [self.companion] + ([self.gcs] if settings.gcs_port else [])
        self._beacon_framer = Framer(system_id, 1)
        self._control = ModeControl(self.state, self.parameters, self.stream)
        self._land_detector = LandDetector(self.state)
        self._announce = Announcer(self.state, personality, self.links)
        self.commander = Commander(
            self.state,
            self.parameters,
            self._control,
            self.stream,
            self._announce,
            ready_us=round(settings.prearm_delay_s * 1e6),
        )
        self._builders: dict[int, Builder] = {
            **MotionTelemetry(self.state, self.vehicle, origin).builders(),
            **SystemTelemetry(
                self.state, self.vehicle, origin, personality, self.stream
            ).builders(),
        }
        self.faults = FaultSchedule(settings.faults)
        self.effects = FaultEffects(
            self.state, self.vehicle, self.commander, self._control, self.links
        )
        self._parameter_protocol = ParameterProtocol(self.parameters)
        commands = Commands(self.state, self.commander, personality, origin, self._builders)
        self._receiver = Receiver(
            self.state,
            self.commander,
            commands,
            self._parameter_protocol,
            self.parameters,
            self.stream,
            personality,
            system_id,
        )

    @property
    def time_us(self) -> int:
        """Vehicle time since boot, us; a whole number of ms."""
        return self.state.time_us

    @property
    def next_us(self) -> int:
        """Vehicle time of the next slot, us."""
        next_us = (self._slots + 1) * self._slot_us
        return next_us - next_us % 1000

    def clear_faults(self) -> None:
        """End all faults."""
        self.effects.apply([], self.faults.clear())

    def handle(self, message: Message, link: Link) -> None:
        """Take one message that came on a link; answers are queued on that link."""
        self._receiver.handle(message, link)

    def set_clock(self, clock_ns: Callable[[], int]) -> None:
        """Give TIMESYNC a finer clock of vehicle time than the ticks are."""
        self._receiver.clock_ns = clock_ns

    def tick(self) -> None:
        """Fly on to the next slot, then queue the telemetry that is due."""
        state = self.state
        next_us = self.next_us
        self._slots += 1
        command = self._control.command((next_us - state.time_us) / 1e6)
        vehicle = self.vehicle
        step = vehicle.step
        for _ in range(next_us * self._rate_hz // 1_000_000 - vehicle.steps):
            step(command)
        state.time_us = next_us
        if not self.effects.clock_frozen:
            state.shown_us = next_us
        state.estimate = vehicle.estimate()
        self._look_about()
        self._parameter_protocol.step()
        self._send_due(self._slots * self._slot_us)

    def boot(self) -> None:
        """Queue the telemetry of the time 0."""
        self._look_about()
        self._send_due(0)

    def beacon(self) -> bytes:
        """Return the lockstep beacon of the present time; no fault touches it."""
        return self._beacon_framer.frame(
            dialect.MAVLink_system_time_message(0, self.state.time_us // 1000)
        )

    def _look_about(self) -> None:
        state, vehicle = self.state, self.vehicle
        was_landed = state.landed
        self._land_detector.step(
            contact=vehicle.on_ground, hover_thrust=self.parameters["MPC_THR_HOVER"]
        )
        if was_landed != state.landed and state.armed:
            landed = Occasion.LANDING_DETECTED if state.landed else Occasion.TAKEOFF_DETECTED
            self._announce(landed, "")
        state.landed_state = self._land_detector.landed_state(
            climbing=not self._control.takeoff_reached
        )
        if state.armed and state.mode is Mode.OFFBOARD and self.effects.offboard_us is None:
            self.effects.offboard_us = state.time_us
        self.effects.apply(*self.faults.update(state.time_us, self.effects.offboard_us))
        if state.time_us >= self._next_commander_us:
            self._next_commander_us += COMMANDER_PERIOD_US
            state.battery_remaining = vehicle.battery.remaining
            self.effects.watch_position(self._converged_us, self.parameters["EKF2_NOAID_TOUT"])
            self.commander.step(crashed=vehicle.crashed)

    def _send_due(self, slot_us: int) -> None:
        builders, silenced = self._builders, self.effects.silenced
        for link in self.links:
            for message_id in link.streams.due(slot_us):
                builder = builders.get(message_id)
                if builder is None or silenced(message_id):
                    continue
                message = builder()
                if message is not None:
                    link.send(message)


def _slot_us(settings: MockSettings) -> int:
    if settings.lockstep.enabled:
        return settings.lockstep.period_ms * 1000
    return SLOT_US[settings.inner_loop_hz]


def _link(
    name: str, framers: dict[str, Framer], personality: Personality, settings: MockSettings
) -> Link:
    lockstep = settings.lockstep.enabled
    rates = dict(personality.stream_rates(name))
    if lockstep and name == "companion":
        del rates[dialect.MAVLINK_MSG_ID_SYSTEM_TIME]  # there, that message is the beacon
    misses = settings.inner_loop_hz == 250 and not lockstep and not settings.exact_rates
    return Link(name, framers[name], StreamSchedule(rates, misses=misses))
