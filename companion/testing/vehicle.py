"""A mock vehicle in memory: true state, faults, pilot, and received setpoints."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import common

from companion.extras import require
from companion.testing.setpoints import ReceivedSetpoint, received_setpoint
from sitl_mock.control_channel import Truth, add_fault, truth
from sitl_mock.exchange import Exchange, ReceivedDatagram
from sitl_mock.link.framing import decode
from sitl_mock.physics.vehicle_step import Plant, PythonPlant
from sitl_mock.settings import load_settings
from sitl_mock.simulation import Simulation

DatagramRelay = Callable[[bytes], Iterable[bytes]]
"""Takes a datagram that was sent; returns the datagrams that arrive in its place."""

_GROUND_STATION = 255, 190
"""MAVLink ids of a ground station."""
_COMMAND_PARAMETER_COUNT = 7


def _plant_class(compiled: bool) -> type[Plant]:
    """The class that computes the physics, compiled or in plain Python."""
    if not compiled:
        return PythonPlant
    require("numba", "study", "a compiled mock vehicle")
    from sitl_mock.physics.compiled import CompiledPlant  # noqa: PLC0415  imports numba

    return CompiledPlant


class MockVehicle:
    """A multirotor with its autopilot, without sockets. It keeps its state between flights.

    Args:
        autopilot: "px4" or "ardupilot"; None: the autopilot of `config`, by default PX4.
        config: a YAML file whose section `mock` is read.
        lockstep: whether the program answers each step before the next one, as with
            `link.lockstep`; a mapping sets more keys of `mock.lockstep`. Without lockstep the
            program receives samples as over UDP: it answers each one on arrival, and its timers
            run between the vehicle's steps.
        delay_s: delay of each datagram, s; only without lockstep.
        compiled: whether the physics are compiled by numba. The flight is the same to the bit.
            Compiling is worth it from 2 minutes of flight in a process: loading takes 0.6 s in each
            process, and the first process on a computer compiles for 10 s.
        settings: keys of the section `mock`, such as `wind`, `faults`, `parameters` or `seed`.
            `gcs_port` has no effect.

    Attributes:
        autopilot: "px4" or "ardupilot".
        settings: the whole section `mock`, with defaults.
        in_lockstep: whether the vehicle runs in lockstep with the program.
        delay_s: delay of each datagram, s; it has no effect in lockstep.
        setpoints: setpoints that reached the autopilot, oldest first. Clear the list to save
            memory.
        after_step: called after each step; `at` and `when` add to it.
        to_companion: changes datagrams that the vehicle sends; None: no change.
        from_companion: changes datagrams that the vehicle receives; None: no change.

    Raises:
        MissingExtraError: `compiled` is asked for, and numba is not installed.
        sitl_mock.config.section.ConfigError: a key or a value is wrong.
    """

    def __init__(
        self,
        autopilot: str | None = None,
        *,
        config: Path | None = None,
        lockstep: bool | Mapping[str, Any] = True,
        delay_s: float = 0.0,
        compiled: bool = False,
        **settings: Any,
    ) -> None:
        if isinstance(lockstep, bool):
            lockstep = {"enabled": lockstep}
        autopilot_key = {} if autopilot is None else {"autopilot": autopilot}
        lockstep_key = {"lockstep": {"enabled": True, **lockstep}}
        # Without a socket, nothing receives telemetry for a ground station, so none is made.
        overrides = {**autopilot_key, **settings, **lockstep_key, "gcs_port": 0}
        all_settings = load_settings(config, overrides, "MockVehicle")
        self.autopilot: str = all_settings.autopilot
        self.in_lockstep, self.delay_s = all_settings.lockstep.enabled, delay_s
        self.setpoints: list[ReceivedSetpoint] = []
        self.after_step: list[Callable[[], None]] = []
        self.to_companion: DatagramRelay | None = None
        self.from_companion: DatagramRelay | None = None
        self.settings = all_settings
        self._simulation = Simulation(all_settings, plant=_plant_class(compiled))
        self._exchange = Exchange(all_settings, self._simulation)
        self._exchange.on_message = self._record_setpoint
        self._arrived_datagrams: list[ReceivedDatagram] = []
        self._has_begun = False

    # --- true state

    @property
    def time(self) -> float:
        """Vehicle time since boot, s."""
        return self._simulation.time_us / 1e6

    def state(self) -> Truth:
        """The present true state."""
        return truth(self._simulation)

    # --- faults, pilot and ground station

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Inject a fault, given as an entry of `mock.faults`.

        The fault begins in the next step, or at its `at_s` or `after_offboard_s`.

        Raises:
            sitl_mock.config.section.ConfigError: there is no such fault.
        """
        add_fault(self._simulation, fault)

    def clear_faults(self) -> None:
        """End all faults."""
        self._simulation.clear_faults()

    def take_over(self, mode: str = "POSCTL") -> None:
        """Let the pilot take over in the next step, in this mode (PX4's names)."""
        self.inject({"kind": "pilot_takeover", "mode": mode})

    def command(self, number: int, *parameters: float) -> None:
        """Let a ground station send a COMMAND_LONG (MAV_CMD, its parameters)."""
        padded_parameters = (*parameters, *[0.0] * (_COMMAND_PARAMETER_COUNT - len(parameters)))
        self.transmit(common.MAVLink_command_long_message(1, 1, number, 0, *padded_parameters))

    def transmit(self, message: Any, sender: tuple[int, int] = _GROUND_STATION) -> None:
        """Let a station, with the system and component ids `sender`, send a pymavlink message."""
        frame = message.pack(common.MAVLink(None, *sender))
        self.receive(bytes(frame))

    def at(self, time: float, action: Callable[[], object]) -> None:
        """Call `action` once when vehicle time has reached `time`, s."""
        self.when(lambda: self.time >= time, action)

    def when(self, condition: Callable[[], bool], action: Callable[[], object]) -> None:
        """Call `action` once after the first step at which `condition` holds."""

        def check() -> None:
            if condition():
                self.after_step.remove(check)
                action()

        self.after_step.append(check)

    # --- time without the program

    def run(self, seconds: float) -> None:
        """Run the vehicle for `seconds` s without the program."""
        end = self.time + seconds
        while self.time < end:
            self.step()

    def until(self, condition: Callable[[Truth], bool], seconds: float = 60.0) -> Truth:
        """Run the vehicle without the program until `condition` holds; return its state then.

        Raises:
            AssertionError: the condition does not hold within `seconds` of vehicle time.
        """
        end = self.time + seconds
        while not condition(state := self.state()):
            if self.time >= end:
                raise AssertionError(
                    f"the condition did not hold within {seconds:g} s; the state is {state}"
                )
            self.step()
        return state

    # --- the vehicle's end of the wire

    @property
    def next_step_at(self) -> float:
        """Vehicle time of the next step, s."""
        return self._simulation.next_us / 1e6

    def set_clock(self, clock_ns: Callable[[], int]) -> None:
        """Set the clock (vehicle time, ns) with which the vehicle answers TIMESYNC.

        This clock also advances between two steps, unlike `time`.
        """
        simulation = self._simulation

        def vehicle_time_ns() -> int:
            if simulation.effects.clock_frozen:
                return simulation.state.stamp_us * 1000
            return min(max(clock_ns(), simulation.time_us * 1000), simulation.next_us * 1000)

        simulation.set_clock(vehicle_time_ns)

    def receive(self, datagram: bytes) -> None:
        """Take a datagram of the program; in lockstep the vehicle handles it in the next step."""
        relay = self.from_companion
        for each in (datagram,) if relay is None else relay(datagram):
            self._arrived_datagrams.append((each, decode(each)))
        if not self.in_lockstep:
            arrived_datagrams, self._arrived_datagrams = self._arrived_datagrams, []
            self._exchange.deliver(arrived_datagrams, self._simulation.companion)

    def take_sent(self) -> list[bytes]:
        """Take the datagrams that the vehicle has sent since the last call."""
        return self._relayed(self._exchange.take_outgoing(self._simulation.companion))

    def begin(self) -> list[bytes]:
        """Boot, unless done before; return the first datagrams (in lockstep the first beacon)."""
        if self._has_begun:
            return []
        self._has_begun = True
        if self.in_lockstep:
            beacon = self._simulation.beacon()
            return self._relayed([self._simulation.companion.sign(beacon)])
        self._simulation.boot()
        return self.take_sent()

    def step(self) -> list[bytes]:
        """Simulate one step; return the datagrams that the vehicle sends in it."""
        self._has_begun = True
        arrived_datagrams, self._arrived_datagrams = self._arrived_datagrams, []
        beacon = self._exchange.step(arrived_datagrams)
        datagrams = self._exchange.take_outgoing(self._simulation.companion, beacon)
        for callback in tuple(self.after_step):
            callback()
        return self._relayed(datagrams)

    def take_clock_slip(self) -> float:
        """Time that `slip_clock` faults took from the vehicle's clock since the last call, s."""
        return self._simulation.effects.take_clock_slip()

    def _relayed(self, datagrams: list[bytes]) -> list[bytes]:
        relay = self.to_companion
        if relay is None:
            return datagrams
        return [arriving for sent in datagrams for arriving in relay(sent)]

    def _record_setpoint(self, message: Any) -> None:
        setpoint = received_setpoint(message, self.time)
        if setpoint is not None:
            self.setpoints.append(setpoint)
