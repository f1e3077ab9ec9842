"""Checks arriving bytes, and passes their frames to the control loop and to the dispatcher.

Every frame of every transport passes the same steps: scan, filter, control loop, counter,
subscribers. `lockstep_inbox.py` says how frames wait in lockstep.
"""

import asyncio
from collections.abc import Callable

from companion.mavlink.codec import ATTITUDE_QUATERNION, decode_attitude
from companion.mavlink.dispatcher import MessageDispatcher
from companion.mavlink.frame_filter import FrameFilter, Notice
from companion.mavlink.framing import Frame, FrameScanner
from companion.mavlink.messages import CRC_EXTRA
from companion.mavlink.outbox import Outbox
from companion.mavlink.peer import HEARTBEAT, PeerRule
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import FrameCounter, LinkStats
from companion.mavlink.transport.base import Tap
from companion.vehicle.clock import VehicleClock
from companion.vehicle.records import AttitudeSample


class LinkCallbacks:
    """What a link calls, synchronously, as frames arrive; None: nothing.

    An exception that a callback raises goes to `Link.on_error`.
    """

    on_attitude: Callable[[AttitudeSample], None] | None = None
    """Called with each attitude sample; in lockstep after the tasks of the step have run."""
    on_foreign_frame: Callable[[Frame], None] | None = None
    """Called with each frame of another system or component than the vehicle's."""
    on_frame: Callable[[Frame], None] | None = None
    """Called with each frame of the peer, from any system and of any message, after the control
    loop and all subscribers. Beacons, and frames of the vehicle with a refused signature, are left
    out. The checksum of a message that the dialect does not know is not checked."""


class Inbox:
    """Passes attitude samples to the control loop, and all accepted frames to the dispatcher.

    Args:
        tap: called with every accepted frame, for recordings.
        notice: called once with each notice about signatures, their time stamps and the peer.
        clock: the vehicle's clock; takes the time stamp of every sample.
        outbox: gives the time of the last setpoint; in lockstep it also sends the answers.
    """

    def __init__(
        self,
        settings: LinkSettings,
        stats: LinkStats,
        dispatcher: MessageDispatcher,
        callbacks: LinkCallbacks,
        tap: Tap | None,
        notice: Notice,
        clock: VehicleClock,
        outbox: Outbox,
    ) -> None:
        self._stats, self._dispatcher, self._tap, self._clock = stats, dispatcher, tap, clock
        self._callbacks, self._outbox = callbacks, outbox
        self._loop = asyncio.get_running_loop()
        self._filter = FrameFilter(settings, stats, notice)
        self._counter = FrameCounter(stats)
        # The sender that becomes the peer with the next accepted frame; see `needs_timesync_with`.
        self._peer_candidate: str | None = None
        self._peer_rule = PeerRule(
            stats,
            self._filter.notify_once,
            self._loop.time,
            lambda: outbox.last_setpoint_at,
            every_frame_claims=settings.signing is not None or settings.lockstep,
        )
        self.start_connection(streaming=False)

    def start_connection(self, *, streaming: bool) -> None:
        """Prepare for a new connection; see `Receiver`."""
        self._scanner = FrameScanner(streaming=streaming, stats=self._stats, keep_unknown=True)
        self._counter.reset()

    def receive(self, data: bytes, received_ns: int) -> bool:
        """Take bytes of the peer; return whether a frame in them was accepted.

        Never raises: an internal error is reported, and False is returned.
        """
        accepted = False
        try:
            for frame in self._scanner.feed(data):
                if frame.message_id not in CRC_EXTRA:
                    self._call_on_frame(frame)
                elif self._is_admitted(frame):
                    accepted = True
                    if self._peer_candidate is not None:
                        self._peer_rule.set_peer(self._peer_candidate)
                        self._peer_candidate = None
                    self._accept(frame, received_ns)
                elif not self._filter.is_vehicle(frame):
                    self._call_on_frame(frame)
        except Exception as error:  # from the tap; subscribers are guarded one by one
            self._dispatcher.report(error)
            return False
        return accepted

    def claim(self, data: bytes, received_ns: int, sender: str) -> bool:
        """Take bytes of `sender`, who is not the peer; return whether `sender` becomes the peer.

        If none of the frames entitles `sender` to become the peer (see `PeerRule`), no frame is
        accepted. Never raises.
        """
        known_frames = (
            frame for frame in self._scanner.feed(data) if frame.message_id in CRC_EXTRA
        )
        admitted_frames = [frame for frame in known_frames if self._is_admitted(frame)]
        if not any(map(self._peer_rule.makes_sender_peer, admitted_frames)):
            self._stats.unclaimed += len(admitted_frames)
            return False
        self._peer_candidate = None
        self._peer_rule.set_peer(sender)
        try:
            for frame in admitted_frames:
                self._accept(frame, received_ns)
        except Exception as error:  # from the tap
            self._dispatcher.report(error)
        return True

    def needs_timesync_with(self, sender: str) -> bool:
        """Whether `sender` must answer a TIMESYNC before its signing time stamps are trusted.

        If so, frames are sent to it; see `Receiver`.
        """
        if not self._filter.needs_timesync_answer:
            return False
        self._peer_candidate = sender
        return True

    def may_replace_peer(self) -> bool:
        """Whether another sender may become the peer although the present one still sends."""
        return self._peer_rule.may_replace_peer()

    def report_ignored(self, sender: str) -> None:
        """Tell the user that `sender` was ignored, because the endpoint names only other peers."""
        self._peer_rule.report_ignored(sender)

    def report_stamp_remarks(self) -> None:
        """Pass the remarks about the time stamps of signatures to the user."""
        self._filter.report_stamp_remarks()

    def _is_admitted(self, frame: Frame) -> bool:
        if self._filter.admits_source(frame):
            return self._filter.has_good_signature(frame)
        if self._callbacks.on_foreign_frame is not None:
            self._dispatcher.guard(self._callbacks.on_foreign_frame, frame)
        return False

    def _accept(self, frame: Frame, received_ns: int) -> None:
        if frame.message_id == HEARTBEAT and self._peer_rule.makes_sender_peer(frame):
            self._peer_rule.renew_claim()
        self._distribute(frame, received_ns)

    def _distribute(self, frame: Frame, received_ns: int) -> None:
        """Pass a frame to the tap, the control loop, the counter and the dispatcher.

        The control loop comes early because all work before it adds latency.
        """
        now = self._loop.time()
        if self._tap is not None:
            self._tap(now, frame.raw)
        if frame.message_id == ATTITUDE_QUATERNION:
            try:
                self._take_sample(frame.payload, now, received_ns)
            except Exception as error:  # the frame is still counted and passed to subscribers
                self._dispatcher.report(error)
        self._counter.count(frame.message_id, frame.sequence)
        self._dispatcher.dispatch(frame.message_id, frame.payload)
        self._call_on_frame(frame)

    def _call_on_frame(self, frame: Frame) -> None:
        if self._callbacks.on_frame is not None:
            self._dispatcher.guard(self._callbacks.on_frame, frame)

    def _take_sample(self, payload: bytes, now: float, received_ns: int) -> None:
        decoded = decode_attitude(payload)
        if decoded is None:
            self._stats.refuse_non_finite("ATTITUDE_QUATERNION", now)
            return
        time_boot_ms, q, rates = decoded
        vehicle_time, age, misfit = self._clock.take(time_boot_ms, now)
        age_known = self._clock.age_known
        self._call_on_attitude(
            AttitudeSample(
                time_boot_ms, vehicle_time, now, received_ns, q, rates, age, misfit, age_known
            )
        )

    def _call_on_attitude(self, sample: AttitudeSample) -> None:
        if self._callbacks.on_attitude is not None:
            self._dispatcher.guard(self._callbacks.on_attitude, sample)
