"""A bench for the autopilot without sockets: commands in, telemetry out, vehicle time at will."""

from collections import defaultdict
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega
from pymavlink.dialects.v20 import development as dialect

from companion.batch import can_compile
from sitl_mock.link.framing import Framer, decode
from sitl_mock.physics.vehicle_step import PythonPlant
from sitl_mock.settings import MockSettings
from sitl_mock.simulation import Simulation

if can_compile():
    from sitl_mock.physics.compiled import CompiledPlant as Plant
else:
    Plant = PythonPlant

HOVER = 0.4903
IGNORE_ATTITUDE = 128
CUSTOM = 1
QUICK = {"MPC_TKO_RAMP_T": 0.3, "COM_SPOOLUP_TIME": 0.1, "MPC_TKO_SPEED": 5.0}
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4


class Rig:
    """One autopilot and a client that speaks to it over its companion link.

    Unless ``quick`` is off, it boots and takes off faster than PX4 does.
    """

    def __init__(
        self, *, gcs: bool = True, boot: bool = True, quick: bool = True, **settings: Any
    ) -> None:
        if quick and boot:
            settings["parameters"] = {**QUICK, **settings.get("parameters", {})}
            settings.setdefault("prearm_delay_s", 0.2)
        settings.setdefault("lockstep", {"enabled": True})
        settings.setdefault("gcs_port", 0)
        self.simulation = Simulation(MockSettings.model_validate(settings), plant=Plant)
        self.framer = Framer(255, 190) if gcs else Framer(1, 191)
        self.heartbeat_type = dialect.MAV_TYPE_GCS if gcs else dialect.MAV_TYPE_ONBOARD_CONTROLLER
        self._frames: list[tuple[float, bytes]] = []
        self._read: dict[int, list[Any]] = {}
        self._numbers: dict[int, list[int]] = defaultdict(list)  # of frames, by message
        self.each_tick: Callable[[], None] | None = None
        if boot:
            self.heartbeat()
            self.run(settings.get("prearm_delay_s", 4.5) + 0.1)

    @property
    def time(self) -> float:
        return self.simulation.time_us / 1e6

    @property
    def state(self):
        return self.simulation.state

    @property
    def truth(self):
        return self.simulation.vehicle.truth

    def say(self, message: Any) -> None:
        """Deliver a message through the wire format, as the socket would."""
        self.say_frame(self.framer.frame(message))

    def say_frame(self, frame: bytes) -> None:
        """Deliver a frame as it is."""
        for each in decode(frame):
            self.simulation.handle(each, self.simulation.companion)
        self._take()

    def heartbeat(self) -> None:
        self.say(dialect.MAVLink_heartbeat_message(self.heartbeat_type, 8, 0, 0, 4, 3))

    def run(self, seconds: float) -> None:
        end = self.simulation.time_us + round(seconds * 1e6)
        while self.simulation.time_us < end:
            if self.each_tick is not None:
                self.each_tick()
            self.simulation.tick()
            self._take()

    def run_until(self, condition: Callable[[], bool], limit: float) -> None:
        end = self.time + limit
        while not condition():
            assert self.time < end, f"not within {limit} s"
            self.run(0.004)

    def _take(self) -> None:
        for frame in self.simulation.companion.take_frames():
            self._numbers[int.from_bytes(frame[7:10], "little")].append(len(self._frames))
            self._frames.append((self.time, frame))

    def _decoded(self, frame: bytes) -> list[Any]:
        return decode(frame)

    def _messages_of(self, number: int) -> list[Any]:
        """The messages of one frame; decoding costs as much as flying, so only what is read is."""
        if number not in self._read:
            self._read[number] = self._decoded(self._frames[number][1])
        return self._read[number]

    @property
    def received(self) -> list[tuple[float, Any]]:
        """Time and message of all that was heard."""
        times = enumerate(at for at, _ in self._frames)
        return [(at, message) for number, at in times for message in self._messages_of(number)]

    def forget(self) -> None:
        """Forget what was heard."""
        self._frames, self._read = [], {}
        self._numbers.clear()

    def messages(self, name: str, since: float = 0.0) -> list[Any]:
        wanted = getattr(ardupilotmega, f"MAVLINK_MSG_ID_{name}", None)
        if wanted is None:
            wanted = getattr(dialect, f"MAVLINK_MSG_ID_{name}")
        return [
            message
            for number in self._numbers.get(wanted, ())
            if self._frames[number][0] >= since
            for message in self._messages_of(number)
        ]

    def texts(self) -> list[str]:
        """Every text said so far, its chunks put together."""
        whole: dict[int, str] = {}
        for message in self.messages("STATUSTEXT"):
            whole[message.id] = whole.get(message.id, "") + message.text
        return list(whole.values())

    def command(self, number: int, *parameters: float) -> int:
        """Send a COMMAND_LONG and return the result of its one acknowledgement."""
        before = len(self.messages("COMMAND_ACK"))
        padded = [*parameters, *([0.0] * (7 - len(parameters)))]
        self.say(dialect.MAVLink_command_long_message(1, 1, number, 0, *padded))
        acks = self.messages("COMMAND_ACK")[before:]
        assert len(acks) == 1
        assert acks[0].command == number
        return int(acks[0].result)

    def mode(self, main: int, sub: int = 0) -> int:
        return self.command(dialect.MAV_CMD_DO_SET_MODE, CUSTOM, main, sub)

    def arm(self) -> int:
        return self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    def offboard(self) -> int:
        return self.mode(6)

    def rates(
        self,
        roll: float = 0.0,
        pitch: float = 0.0,
        yaw: float = 0.0,
        thrust: float = HOVER,
        *,
        mask: int = IGNORE_ATTITUDE,
        q: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0),
        target: tuple[int, int] = (1, 1),
    ) -> None:
        self.say(
            dialect.MAVLink_set_attitude_target_message(
                self.simulation.time_us // 1000, *target, mask, q, roll, pitch, yaw, thrust
            )
        )

    def take_off(self, height: float = 3.0) -> None:
        """Arm, climb and arrive in LOITER."""
        self.simulation.parameters.set("MIS_TAKEOFF_ALT", height)
        assert self.mode(4, 2) == ACCEPTED
        assert self.arm() == ACCEPTED
        self.run_until(lambda: self.state.mode.name == "LOITER", 20.0)

    def fly_offboard(self, height: float = 3.0, **setpoint: Any) -> None:
        """Take off and hand over to a stream of setpoints that goes on by itself."""
        self.take_off(height)
        self.each_tick = lambda: self.rates(**setpoint)
        self.run(0.1)
        assert self.offboard() == ACCEPTED
