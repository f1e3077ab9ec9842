"""One vehicle and its autopilot in vehicle time: messages in, messages out, no I/O."""

from collections.abc import Callable
from math import radians

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.faults import FaultEffects, FaultSchedule
from sitl_mock.autopilot.interface import Autopilot, VehicleParts
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.receiver import Receiver
from sitl_mock.autopilot.setpoints import OffboardStream
from sitl_mock.autopilot.stamp_slips import StampSlips
from sitl_mock.autopilot.state import State
from sitl_mock.autopilots import AUTOPILOTS
from sitl_mock.link.framing import Framer, Message
from sitl_mock.link.link import Link
from sitl_mock.link.signing import link_signing
from sitl_mock.physics.geodesy import Geodetic
from sitl_mock.physics.vehicle import Vehicle
from sitl_mock.physics.vehicle_step import Plant, PythonPlant
from sitl_mock.settings import MockSettings

_SYSTEM_TIME = dialect.MAVLink_system_time_message

COMMANDER_PERIOD_US = 50_000
"""Period of the commander (arming, modes, failsafes) in vehicle time, us."""


class Simulation:
    """One vehicle with its autopilot.

    Attributes:
        vehicle: the simulated vehicle: true motion, battery and sensors.
        state: the estimate, modes and targets of its autopilot.
        parameters: parameters of the autopilot.
        stream: the latest accepted offboard setpoint, and the number of accepted ones.
        commander: arming and modes of the autopilot.
        companion: link to the companion.
        gcs: link to the ground station; nothing is sent on it if ``gcs_port`` is 0.
        links: the links that are used.
        faults: schedule of the faults.
        effects: applies the present faults.
    """

    def __init__(
        self, settings: MockSettings, system_id: int = 1, plant: type[Plant] = PythonPlant
    ) -> None:
        autopilot = AUTOPILOTS[settings.autopilot]
        overrides = {autopilot.system_id_parameter: float(system_id), **settings.parameters}
        self.parameters = ParameterTable(autopilot.parameters, overrides)
        home = settings.home
        self.vehicle = Vehicle(
            settings.airframe,
            settings.rate_loop,
            settings.wind,
            settings.battery,
            settings.sensors,
            seed=settings.seed,
            heading=radians(home.heading_deg),
            plant=plant,
        )
        self.state = State(self.vehicle.estimate())
        self.state.mode = self.state.intended_mode = autopilot.boot_mode
        lockstep = settings.lockstep
        self._slot_us = (
            lockstep.period_ms * 1000 if lockstep.enabled else autopilot.slot_period_us(settings)
        )
        self._slot_count = 0
        self._physics_rate_hz = settings.airframe.physics_rate_hz
        self._next_commander_us = 0
        self.stream = OffboardStream()
        self.companion, self.gcs = _make_links(settings, autopilot, system_id)
        self.links = [self.companion] + ([self.gcs] if settings.gcs_port else [])
        signed = settings.signing is not None
        self._beacon_framer = Framer(system_id, 1, signed=signed)
        self._behaviour = autopilot.behaviour(
            VehicleParts(
                self.state,
                self.parameters,
                self.vehicle,
                self.stream,
                Geodetic(home.latitude_deg, home.longitude_deg, home.altitude_m),
                self.links,
                round(settings.prearm_delay_s * 1e6),
                StampSlips(settings.sensors.stamp_slips_hz, settings.seed),
            )
        )
        self.commander = self._behaviour.commander
        self.faults = FaultSchedule(settings.faults)
        self.effects = FaultEffects(
            self.state, self.vehicle, self.commander, self._behaviour.control, self.links
        )
        self._receiver = Receiver(self.state, self._behaviour, autopilot, system_id)

    @property
    def time_us(self) -> int:
        """Vehicle time since boot, us; a whole number of ms."""
        return self.state.time_us

    @property
    def next_us(self) -> int:
        """Vehicle time after the next simulation step, us, rounded down to a whole ms."""
        next_us = (self._slot_count + 1) * self._slot_us
        return next_us - next_us % 1000

    def clear_faults(self) -> None:
        """End all faults, and cancel those that have not begun."""
        self.effects.apply([], self.faults.clear())

    def handle(self, message: Message, link: Link) -> None:
        """Handle one message received on a link; answers are queued on that link.

        An autopilot whose process has ended (`State.aborted`) ignores the message.
        """
        if not self.state.aborted:
            self._receiver.handle(message, link)

    def set_clock(self, clock_ns: Callable[[], int]) -> None:
        """Set the clock for answers to TIMESYNC: vehicle time, ns, advancing between slots too."""
        self._receiver.clock_ns = clock_ns

    def tick(self) -> None:
        """Simulate to the next slot, then queue the telemetry that is due."""
        state = self.state
        next_us = self.next_us
        self._slot_count += 1
        if state.aborted:
            state.time_us = next_us
            return
        command = self._behaviour.control.command((next_us - state.time_us) / 1e6)
        vehicle = self.vehicle
        vehicle.step(command, next_us * self._physics_rate_hz // 1_000_000 - vehicle.steps)
        state.time_us = next_us
        if not self.effects.clock_frozen:
            state.stamp_us = next_us
        state.estimate = vehicle.estimate()
        self._update_state()
        self._behaviour.parameter_protocol.step()
        self._send_due_messages(self._slot_count * self._slot_us)

    def boot(self) -> None:
        """Queue the telemetry of time 0."""
        self._update_state()
        self._send_due_messages(0)

    def beacon(self) -> bytes:
        """Return the SYSTEM_TIME frame that tells the present time in lockstep, free of faults."""
        payload = _SYSTEM_TIME.unpacker.pack(0, self.state.time_us // 1000)
        return self._beacon_framer.frame_raw(_SYSTEM_TIME.id, _SYSTEM_TIME.crc_extra, payload)

    def _update_state(self) -> None:
        state, vehicle, behaviour = self.state, self.vehicle, self._behaviour
        behaviour.land_detector.step(ground_contact=vehicle.on_ground)
        if behaviour.commander.obeys_setpoints and self.effects.offboard_since_us is None:
            self.effects.offboard_since_us = state.time_us
        begun_faults, ended_faults = self.faults.update(
            state.time_us, self.effects.offboard_since_us
        )
        if begun_faults or ended_faults:
            self.effects.apply(begun_faults, ended_faults)
        if state.time_us >= self._next_commander_us:
            self._next_commander_us += COMMANDER_PERIOD_US
            state.battery_remaining = vehicle.battery.remaining
            self.effects.update_position_valid(
                behaviour.position_valid_from_us, behaviour.position_timeout_us()
            )
            behaviour.commander.step(crashed=vehicle.crashed)

    def _send_due_messages(self, slot_us: int) -> None:
        builders, is_stopped = self._behaviour.builders, self.effects.is_stopped
        for link in self.links:
            for message_id in link.streams.due(slot_us, self.state.status_published_us):
                builder = builders.get(message_id)
                if builder is None or is_stopped(message_id):
                    continue
                message = builder()
                if message is not None:
                    link.send(message)


def _make_links(settings: MockSettings, autopilot: Autopilot, system_id: int) -> tuple[Link, Link]:
    signing = settings.signing

    def link(name: str) -> Link:
        return Link(
            name,
            Framer(system_id, 1, signed=signing is not None),
            autopilot.streams(name, settings),
            link_signing(signing, name, unsigned_links=autopilot.unsigned_links),
        )

    return link("companion"), link("gcs")
