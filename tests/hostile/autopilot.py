"""A hostile autopilot in lockstep: it does and tells what a script says.

It speaks MAVLink 2 by pymavlink alone. Each step ends with SYSTEM_TIME as a beacon, and it waits
for the answer; what it stamps and tells may lie about time as about everything else. `wire` joins
it to the companion.
"""

import struct
from math import inf
from typing import NamedTuple

from tests.hostile import personality as kinds
from tests.hostile.telemetry import Telemetry
from tests.hostile.vehicle import Vehicle

STEP_S = 0.02
LONGEST_S = 90.0
_CHECKS_TAKE_S = 1.3
_COMMAND_MARKS = {kinds.ARM: "ARM", kinds.TAKEOFF: "TAKEOFF", kinds.LAND: "LAND"}
ACKS = {
    # How a command is answered: whether it is done, the MAV_RESULTs told, and to which system.
    "honest": (True, None, 1),
    "accepts it and does nothing": (False, (0,), 1),
    "refuses it and does it": (True, (2,), 1),
    "refuses it": (False, (2,), 1),
    "does it and never answers": (True, (), 1),
    "never hears it": (False, (), 1),
    "answers twice": (True, (0, 0), 1),
    "does it and answers somebody else": (True, (0,), 77),
    "is in progress for ever": (False, (5,), 1),
}


class Sent(NamedTuple):
    """One message of the companion's, with the vehicle at that moment.

    Attributes:
        t: vehicle time, s; the time of the beacon that it answers.
        name: of the message.
        message: as pymavlink decoded it.
        mode, armed, in_air: what was true then.
    """

    t: float
    name: str
    message: object
    mode: str
    armed: bool
    in_air: bool


class HostileAutopilot:
    """One scripted vehicle.

    Attributes:
        vehicle, telemetry, parameters: what a script changes.
        wire: over sockets, its end of the link; else None.
        marks: what happened first when, s of vehicle time, such as TAKEOFF (see `_note`).
        acks: command → how it is answered, a key of `ACKS`.
        timesync: true time in s → the clock that answers TIMESYNC, s; None: no answers.
        silent_until: nothing but beacons is sent before, s.
        uid: of AUTOPILOT_VERSION.
        sent: what the companion sent.
        acted: when the script acted, s.

    Args:
        kind: the personality.
        script: [(mark, delay in s, action)]; an action takes this autopilot.
        mode: in which it begins.
    """

    def __init__(self, kind, script=(), mode=None):
        begins = mode or ("STABILIZE" if kind.enters_by_setpoint else "READY")
        self.vehicle = Vehicle(kind, begins)
        self.telemetry = Telemetry(self.vehicle)
        self.wire = None
        self.parameters = dict(kind.parameters)
        self.marks, self.acks, self.acted, self.sent = {}, {}, [], []
        self.timesync, self.silent_until, self.uid = (lambda t: t), -inf, 7
        self._script, self._replies, self._heard = list(script), [], []

    def say(self, name, **fields):
        """Send a message of its own in the next step."""
        self._replies += self.telemetry.pack(name, fields)

    @property
    def beacon_ms(self):
        """The time that the beacon of this step tells."""
        return round(1000.0 * self.vehicle.t)

    @property
    def over(self):
        """Whether it has lived long enough."""
        return self.vehicle.t >= LONGEST_S

    def begin(self):
        """Begin at a time that is not 0."""
        self.vehicle.t = 1.0
        self.mark("start")
        self._act()

    def step(self, heard):
        """Go on by a step after these messages; returns the frames that leave in it."""
        vehicle = self.vehicle
        self._heard = heard
        self._handle()
        self._act()
        vehicle.step(STEP_S)
        self._note()
        frames = [*self.telemetry.due(), *self._replies]
        frames = frames if vehicle.t >= self.silent_until else []
        self._replies = []
        return frames

    def _act(self):
        """Do what the script says for now."""
        for event in [each for each in self._script if self._is_due(*each[:2])]:
            self._script.remove(event)
            self.acted.append(self.vehicle.t)
            event[2](self)

    def _is_due(self, mark, delay):
        return mark in self.marks and self.vehicle.t >= self.marks[mark] + delay - 1e-6

    # --- what the companion says

    def _handle(self):
        vehicle = self.vehicle
        for message in self._heard:
            name, state = message.get_type(), (vehicle.mode, vehicle.armed, vehicle.body.in_air)
            self.sent.append(Sent(vehicle.t, name, message, *state))
            answer = getattr(self, "_on_" + name.lower(), None)
            if answer is not None:
                answer(message)

    def _on_set_attitude_target(self, message):
        self.mark("setpoint")
        rates = message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate
        self.vehicle.obey(rates, message.thrust)

    def _on_timesync(self, message):
        if message.tc1 == 0 and self.timesync is not None:
            tc1 = round(self.timesync(self.vehicle.t + STEP_S / 2) * 1e9)
            self.say("TIMESYNC", tc1=tc1, ts1=message.ts1)

    def _on_param_request_read(self, message):
        self.mark("reading")
        self.tell_parameter(message.param_id)

    def tell_parameter(self, name):
        """Send PARAM_VALUE, or that there is none."""
        value, kind = self.parameters.get(name), 9
        if value is None:
            fields = {"target_system": 1, "target_component": 191, "param_id": name.encode()}
            self.say("PARAM_ERROR", **fields, param_index=-1, error=1)
            return
        if isinstance(value, int):
            kind = 6
            if self.vehicle.kind.bytewise:
                (value,) = struct.unpack("<f", struct.pack("<i", value))
        fields = {"param_id": name.encode(), "param_value": value, "param_type": kind}
        self.say("PARAM_VALUE", **fields, param_count=len(self.parameters), param_index=0)

    def _on_command_long(self, message):
        command = message.command
        self.mark(_COMMAND_MARKS.get(command))
        if command == kinds.SET_MODE:
            self.mark(f"SET_MODE {self.vehicle.kind.mode_asked(message)}")
        does, results, target = ACKS[self.acks.get(command, "honest")]
        done = self._do(message) if does else None
        for result in (done,) if results is None else results:
            ack = {"command": command, "result": result, "progress": 0, "result_param2": 0}
            self.say("COMMAND_ACK", **ack, target_system=target, target_component=191)

    def _do(self, message):
        if message.command == kinds.SET_MESSAGE_INTERVAL:
            return self.telemetry.set_interval(message.param1, message.param2)
        if message.command == kinds.REQUEST_MESSAGE:
            frames = self.telemetry.requested(message.param1, self.uid)
            self._replies += frames or []
            return kinds.FAILED if frames is None else kinds.ACCEPTED
        return self.vehicle.command(message)

    # --- marks

    def mark(self, name):
        """Note that it happened, if it had not yet."""
        if name is not None:
            self.marks.setdefault(name, self.vehicle.t)

    def _note(self):
        """Note what happened first when, for the script and for the judges."""
        vehicle, marks = self.vehicle, self.marks
        if vehicle.t - marks.get("reading", inf) > _CHECKS_TAKE_S:
            self.mark("checked")
        if vehicle.armed:
            self.mark("armed")
        elif "armed" in marks:
            self.mark("disarmed")
        if vehicle.body.in_air:
            self.mark("in air")
            self.mark({"READY": "at height", "RATES": "in control"}.get(vehicle.mode))
            if "in control" in marks:
                self.mark({"HOLD": "holding", "LAND": "landing"}.get(vehicle.mode))
        elif "in air" in marks:
            self.mark("down")
