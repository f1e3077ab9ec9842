"""What arrives: checked, and passed on to the control loop and to the router."""

import asyncio
from collections.abc import Callable
from math import inf

from fastcrc import crc16

from companion.attitude.types import BodyRates, Quaternion
from companion.mavlink.codec import (
    ATTITUDE_QUATERNION,
    SYSTEM_TIME,
    decode_attitude,
    decode_beacon,
)
from companion.mavlink.framing import V2, Frame, FrameScanner
from companion.mavlink.lockstep import LockstepClient, LockstepEventLoop
from companion.mavlink.messages import CRC_EXTRA
from companion.mavlink.peer import HEARTBEAT, PeerRule
from companion.mavlink.router import Router
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import Verdict
from companion.mavlink.stats import LinkStats, SequenceTracker
from companion.mavlink.transport import Tap
from companion.vehicle.clock import VehicleClock
from companion.vehicle.samples import AttitudeSample

Notice = Callable[[str], None]
"""Takes a sentence about the link that its user should read."""

_SOURCE_AND_ID = slice(5, 10)  # system, component and the three bytes of the message id
_ATTITUDE_EXTRA = CRC_EXTRA[ATTITUDE_QUATERNION]

_REFUSED = {
    Verdict.UNSIGNED: "the vehicle does not sign its frames, so they are refused; give it the same "
    "key as link.signing_key_file, or leave signing out on both sides",
    Verdict.WRONG_KEY: "the vehicle signs its frames with another key, so they are refused; give "
    "both sides the same key (link.signing_key_file)",
}
"""What is said of time stamps `Signing.remarks` says."""

_WE_DO_NOT_SIGN = (
    "the vehicle signs its frames and we do not, so it may obey nothing we send; set "
    "link.signing_key_file to a file with its passphrase"
)


class Inbox:
    """Checks what arrives and passes it on: samples to the control loop, the rest to the router.

    Attributes:
        on_attitude: Called with each attitude sample, synchronously.
        on_foreign: Called with each frame of a system or component that we do not listen to.
        lockstep: Set when vehicle time drives the loop.

    Args:
        settings: Whom to hear, and the key.
        stats: Counts.
        router: Takes all but the samples.
        tap: Is shown every frame that is accepted.
        notice: Is told, once each, of what keeps the two sides from understanding each other.
        clock: The vehicle's; is fed by every sample.
        last_setpoint: Loop time of the last setpoint sent, s.
    """

    def __init__(
        self,
        settings: LinkSettings,
        stats: LinkStats,
        router: Router,
        tap: Tap | None,
        notice: Notice,
        clock: VehicleClock,
        last_setpoint: Callable[[], float] = lambda: -inf,
    ) -> None:
        self._clock = clock
        self._source = (settings.target_system, settings.target_component)
        self._signing = settings.signing
        self._stats, self._router, self._tap = stats, router, tap
        self._loop = asyncio.get_running_loop()
        self._attitude_source = bytes((*self._source, ATTITUDE_QUATERNION, 0, 0))
        self._quick = False
        self._sequence = SequenceTracker()
        self._explained = 0
        self._notice = notice
        self._noticed: set[str] = set()
        self._candidate: str | None = None
        self._held: list[tuple[Frame, int]] = []
        self._samples: list[AttitudeSample] = []
        self.on_attitude: Callable[[AttitudeSample], None] | None = None
        self.on_foreign: Callable[[Frame], None] | None = None
        self.lockstep: LockstepClient | None = None
        self._peer_rule = PeerRule(
            stats,
            self._notice_once,
            self._loop.time,
            last_setpoint,
            every_frame_claims=settings.signing is not None or settings.lockstep,
        )
        self.connect(streaming=False)

    def connect(self, *, streaming: bool) -> None:
        """Begin with a fresh connection."""
        self._scanner = FrameScanner(CRC_EXTRA, streaming=streaming, stats=self._stats)
        self._sequence.reset()
        self._quick = not streaming and self._signing is None and self.lockstep is None

    def follow_vehicle_time(
        self, loop: LockstepEventLoop, answer: Callable[[int], None]
    ) -> LockstepClient:
        """From now on hold what arrives until the vehicle closes its step."""
        self._quick = False
        self.lockstep = LockstepClient(loop, self._process, self._deliver, answer)
        return self.lockstep

    def receive(self, data: bytes, received_ns: int) -> bool:
        """Take bytes from the transport; true if a frame in them was accepted. Never raises."""
        try:
            if self._quick and data[_SOURCE_AND_ID] == self._attitude_source:
                return self._take_attitude(data, received_ns) or self._take(data, received_ns)
            return self._take(data, received_ns)
        except Exception as error:  # of the tap; subscribers are offboard_active one by one
            self._router.report(error)
            return False

    def claim(self, data: bytes, received_ns: int, who: str) -> bool:
        """Take bytes of `who`, who is not the peer; true if that makes it the peer.

        Without a valid claim in them nothing is accepted. Never raises.
        """
        admitted = [frame for frame in self._scanner.feed(data) if self._admit(frame)]
        if not any(map(self._peer_rule.is_claim, admitted)):
            self._stats.unclaimed += len(admitted)
            return False
        self._candidate = None
        self._peer_rule.fix(who)
        try:
            for frame in admitted:
                self._accept(frame, received_ns)
        except Exception as error:  # of the tap
            self._router.report(error)
        return True

    def may_answer(self, who: str) -> bool:
        """Whether a question is to be sent to `who`, whose claim an answer alone would prove."""
        if self._signing is None or not self._signing.awaits_answer:
            return False
        self._candidate = who
        return True

    def claim_lapsed(self) -> bool:
        """Whether another sender may take the peer's place."""
        return self._peer_rule.lapsed()

    def stranger(self, who: str) -> None:
        """`who`, whom the endpoint does not name, was ignored."""
        self._peer_rule.ignore(who)

    def _take_attitude(self, data: bytes, received_ns: int) -> bool:
        """The way of a datagram that is one sample and nothing else: control first, count later.

        False, and nothing done, if it is not just that. At 250 Hz the caches are cold when a
        sample comes, and each line before the answer counts five times what it does in a loop.
        """
        end = len(data) - 2
        if data[0] != V2 or data[1] + 10 != end or data[2]:
            return False
        if crc16.mcrf4xx(data[1:end] + _ATTITUDE_EXTRA) != data[end] | data[end + 1] << 8:
            return False
        decoded = decode_attitude(data[10:end])
        if decoded is None:
            return False
        now = self._loop.time()
        if self._tap is not None:
            self._tap(now, data)
        try:
            sample = self._sample(decoded, now, received_ns)
            if self.on_attitude is not None:
                self.on_attitude(sample)
        except Exception as error:
            self._router.report(error)
        self._count(ATTITUDE_QUATERNION, data[4])
        self._router.route(ATTITUDE_QUATERNION, data[10:end])
        return True

    def _take(self, data: bytes, received_ns: int) -> bool:
        accepted = False
        for frame in self._scanner.feed(data):
            if not self._admit(frame):
                continue
            accepted = True
            if self._candidate is not None:
                self._peer_rule.fix(self._candidate)
                self._candidate = None
            self._accept(frame, received_ns)
        return accepted

    def _accept(self, frame: Frame, received_ns: int) -> None:
        if frame.message_id == HEARTBEAT and self._peer_rule.is_claim(frame):
            self._peer_rule.renew()
        if self.lockstep is not None and frame.message_id == SYSTEM_TIME:
            beacon = decode_beacon(frame.payload)
            if beacon is not None:
                # Beacons are no telemetry: they have running numbers of their own.
                self.lockstep.beacon(beacon)
                return
        self._count(frame.message_id, frame.sequence)
        if self.lockstep is None:
            sample = self._pass_on(frame, received_ns)
            if sample is not None:
                self._control(sample)
        else:
            self._held.append((frame, received_ns))

    def _admit(self, frame: Frame) -> bool:
        stats = self._stats
        source = (frame.system, frame.component)
        if source != self._source:
            stats.ignored_foreign += 1
            stats.foreign_sources.add(source)
            if self.on_foreign is not None:
                self._router.guard(self.on_foreign, frame)
            return False
        if self._signing is None:
            if frame.signed:
                self._notice_once(_WE_DO_NOT_SIGN)
            return True
        verdict = self._signing.judge(frame)
        if self._signing.remarks:
            self.tell_remarks()
        if verdict is Verdict.GOOD:
            return True
        stats.bad_signature += 1
        if verdict in _REFUSED:
            self._notice_once(_REFUSED[verdict])
        return False

    def tell_remarks(self) -> None:
        """Pass on what there is to say of time stamps."""
        while self._signing is not None and self._signing.remarks:
            self._notice_once(self._signing.remarks.pop(0))

    def _notice_once(self, text: str) -> None:
        if text not in self._noticed:
            self._noticed.add(text)
            self._notice(text)

    def _count(self, message_id: int, sequence: int) -> None:
        stats = self._stats
        missing = self._sequence.missing(sequence)
        if missing < 0:
            stats.repeated += 1
        else:
            # A message the dialect does not know has a number too; it came, and is no loss.
            explained = min(missing, stats.unknown - self._explained)
            self._explained += explained
            stats.lost += missing - explained
        stats.frames += 1
        stats.by_message[message_id] = stats.by_message.get(message_id, 0) + 1

    def _pass_on(self, frame: Frame, received_ns: int) -> AttitudeSample | None:
        now = self._loop.time()
        if self._tap is not None:
            self._tap(now, frame.raw)
        self._router.route(frame.message_id, frame.payload)
        if frame.message_id != ATTITUDE_QUATERNION:
            return None
        decoded = decode_attitude(frame.payload)
        if decoded is None:
            self._stats.non_finite += 1
            return None
        return self._sample(decoded, now, received_ns)

    def _sample(
        self, decoded: tuple[int, Quaternion, BodyRates], now: float, received_ns: int
    ) -> AttitudeSample:
        time_boot_ms, q, rates = decoded
        time, age, misfit = self._clock.take(time_boot_ms, now)
        known = self._clock.age_known
        return AttitudeSample(time_boot_ms, time, now, received_ns, q, rates, age, misfit, known)

    def _control(self, sample: AttitudeSample) -> None:
        if self.on_attitude is not None:
            self._router.guard(self.on_attitude, sample)

    def _process(self) -> None:
        held, self._held = self._held, []
        for frame, received_ns in held:
            sample = self._pass_on(frame, received_ns)
            if sample is not None:
                self._samples.append(sample)

    def _deliver(self) -> None:
        samples, self._samples = self._samples, []
        for sample in samples:
            self._control(sample)
