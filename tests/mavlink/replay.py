"""A recorded log played to our link, which takes the part of the companion in it.

What the vehicle sent arrives. Where the recorded companion sent a setpoint, a command or a request
for a parameter, ours is told to do the same, and what leaves is kept beside what was recorded. Time
is the log's. What was recorded is read by pymavlink, which shares no code with us.

    python -m tests.mavlink.replay LOG...    what came of whole logs
"""

import asyncio
import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.attitude.types import BodyRates
from companion.mavlink.codec import SetpointEncoder
from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.errors import CommandRefused, CommandTimeout, UnknownParameter
from companion.mavlink.outbox import Outbox
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats
from companion.vehicle.client import VehicleClient
from companion.vehicle.clock import VehicleClock
from companion.vehicle.inbox import Inbox, LinkCallbacks
from companion.vehicle.state import VehicleState

VEHICLE = (1, 1)
STAMP, OVERHEAD, SIGNATURE, MAVLINK_2 = 8, 12, 13, 0xFD
BY_RATES = 128
_PATIENCE_S = 1.0
_TURNS = 6  # of the event loop after each record: an answer passes through a few callbacks
_AFTER_THE_END_S = 3.0


class LogClock(asyncio.SelectorEventLoop):
    """An event loop whose time is the log's."""

    now = 0.0

    def time(self):
        return self.now


class Recorder:
    """A transport that leads nowhere and keeps the newest frame."""

    frame = None

    def send(self, frame):
        self.frame = frame
        return True


@dataclass
class Replayed:
    """What our side made of a log; times in s since its first record.

    `story` has (time, mode, armed) at each change, `samples` ours and `attitudes` pymavlink's;
    `told` counts the vehicle's frames by message id. `setpoints` and `requests` are pairs of
    frames, (recorded, ours). `answers` are (time, what was asked for, what came of it),
    `notices` what the link says of keys and ids that do not fit.
    """

    story: list = field(default_factory=list)
    samples: list = field(default_factory=list)
    attitudes: list = field(default_factory=list)
    told: Counter = field(default_factory=Counter)
    setpoints: list = field(default_factory=list)
    requests: list = field(default_factory=list)
    answers: list = field(default_factory=list)
    notices: list = field(default_factory=list)
    stats: LinkStats | None = None
    state: VehicleState | None = None


def records(path):
    """(stamp in s, frame) of each record; the recordings hold MAVLink 2 alone."""
    data, at = Path(path).read_bytes(), 0
    while at < len(data):
        assert data[at + STAMP] == MAVLINK_2
        signature = SIGNATURE if data[at + STAMP + 2] & 1 else 0
        end = at + STAMP + OVERHEAD + data[at + STAMP + 1] + signature
        yield int.from_bytes(data[at : at + STAMP], "big") * 1e-6, data[at + STAMP : end]
        at = end


def source(frame):
    """System and component of its sender."""
    return frame[5], frame[6]


def number(frame):
    """Its message id."""
    return int.from_bytes(frame[7:10], "little")


def decoded(frame):
    """pymavlink's message, or None of one that its dialect has not."""
    if number(frame) not in dialect.mavlink_map:
        return None
    parser = dialect.MAVLink(None)
    (message,) = parser.parse_buffer(frame)
    return message


def payload(frame):
    """Source, message id and payload, which MAVLink 2 may send without its last zeros."""
    return None if frame is None else (frame[5:10], frame[10:-2].rstrip(b"\0"))


def replay(path):
    """Play a log from its beginning to its end."""
    with asyncio.Runner(loop_factory=LogClock) as runner:
        return runner.run(_Player(list(records(path))).play())


class _Player:
    def __init__(self, log):
        self._log = log
        self.out = Replayed()

    async def play(self):
        self._loop = asyncio.get_running_loop()
        self._wire()
        began = self._log[0][0]
        async with asyncio.TaskGroup() as self._tasks:
            for stamp, frame in self._log:
                await self._until(stamp - began)
                if source(frame) == VEHICLE:
                    self._from_vehicle(frame)
                else:
                    await self._from_companion(frame)
                await self._turns()
            await self._until(self._loop.now + _AFTER_THE_END_S)
        return self.out

    def _wire(self):
        """The parts of a link, without its own heartbeat and clock questions."""
        ours = next(source(frame) for _, frame in self._log if source(frame) != VEHICLE)
        settings = LinkSettings("udpout://nowhere:1", 1, 1, *ours)
        stats = LinkStats()
        dispatcher = MessageDispatcher(stats)
        clock = VehicleClock()
        outbox = Outbox(settings, stats, None)
        callbacks, notices = LinkCallbacks(), self.out.notices
        callbacks.on_attitude = self.out.samples.append
        self._inbox = Inbox(
            settings, stats, dispatcher, callbacks, None, notices.append, clock, outbox
        )
        outbox.transport = self._recorder = Recorder()
        self._setpoints = SetpointEncoder(*ours, *VEHICLE, signed=False)
        self._conversation = VehicleClient(
            settings, outbox, dispatcher, stats, self._loop.time, clock
        )
        self.out.stats, self.out.state = stats, self._conversation.state

    async def _until(self, time):
        """Let the log's time pass, and what is due on our side happen."""
        while self._loop.now + 0.1 < time:
            self._loop.now += 0.1
            await self._turns()
        self._loop.now = max(time, self._loop.now)

    async def _turns(self):
        for _ in range(_TURNS):
            await asyncio.sleep(0)

    def _from_vehicle(self, frame):
        out = self.out
        out.told[number(frame)] += 1
        message = decoded(frame)
        if number(frame) == dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION:
            out.attitudes.append(message)
        self._inbox.receive(frame, 0)
        now = (out.state.mode, out.state.armed)
        if out.state.mode is not None and (not out.story or out.story[-1][1:] != now):
            out.story.append((self._loop.now, *now))

    async def _from_companion(self, frame):
        message = decoded(frame)
        match message.get_type():
            case "SET_ATTITUDE_TARGET" if message.type_mask == BY_RATES:
                rates = BodyRates(
                    message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate
                )
                ours = self._setpoints.frame(frame[4], message.time_boot_ms, rates, message.thrust)
                self.out.setpoints.append((frame, ours))
            case "COMMAND_LONG" if (message.target_system, message.target_component) == VEHICLE:
                params = [getattr(message, f"param{place}") for place in range(1, 8)]
                question = self._conversation.command(
                    message.command, *params, timeout_s=_PATIENCE_S, retries=0
                )
                await self._ask(frame, (message.command, *params[:3]), question)
            case "PARAM_REQUEST_READ":
                name = message.param_id
                question = self._conversation.read_parameter(name, timeout_s=_PATIENCE_S, retries=0)
                await self._ask(frame, name, question)

    async def _ask(self, frame, asked, question):
        """Let our side ask, too; the recorded vehicle's answer is what it will get."""
        time, self._recorder.frame = self._loop.now, None

        async def outcome():
            try:
                answer = await question
            except (CommandTimeout, UnknownParameter):
                answer = "no answer"
            except CommandRefused as refused:
                answer = refused.result
            self.out.answers.append((time, asked, answer))

        self._tasks.create_task(outcome())
        await self._turns()
        self.out.requests.append((frame, self._recorder.frame))


def _main():
    for path in sys.argv[1:]:
        out = replay(path)
        exact = sum(recorded == ours for recorded, ours in out.setpoints)
        alike = sum(payload(recorded) == payload(ours) for recorded, ours in out.requests)
        stats = {name: count for name, count in vars(out.stats).items() if count}
        del stats["by_message"]
        print(Path(path).name, f"{out.told.total()} frames told, ours counts {stats}", sep="\n")
        print(f"{len(out.samples)} samples of {len(out.attitudes)}")
        print(f"{exact} setpoints to the byte of {len(out.setpoints)}")
        print(f"{alike} requests alike of {len(out.requests)}")
        print(*out.story, *out.answers, sep="\n")


if __name__ == "__main__":
    _main()
