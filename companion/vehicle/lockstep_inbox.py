"""An inbox in lockstep: the frames of a step wait for the beacon, which the vehicle sends last."""

import asyncio
from typing import Any

from companion.mavlink.codec import SYSTEM_TIME, decode_beacon
from companion.mavlink.errors import LinkError
from companion.mavlink.framing import Frame
from companion.mavlink.lockstep import LockstepEventLoop
from companion.vehicle.inbox import Inbox
from companion.vehicle.records import AttitudeSample


class LockstepInbox(Inbox):
    """Runs one step of this program for each beacon of the vehicle, and answers the beacon.

    A beacon is a SYSTEM_TIME without the time of day. The beacon sets the event loop's clock before
    the frames of the step are passed on. Attitude samples then wait until the event loop has run
    the tasks of the step. The answer, sent by the outbox, closes the step.

    Attributes:
        first_beacon: a future that is done when the first beacon has come.
        open_step_time_ms: vehicle time of the open step, ms; `None` while no step is open.

    Raises:
        LinkError: the event loop is no `LockstepEventLoop`.
    """

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        if not isinstance(self._loop, LockstepEventLoop):
            raise LinkError("lockstep needs the event loop of companion.mavlink.lockstep.run")
        self._lockstep_loop = self._loop
        self._held_frames: list[tuple[Frame, int]] = []
        self._held_samples: list[AttitudeSample] = []
        self._closed = False
        self.open_step_time_ms: int | None = None
        self.first_beacon: asyncio.Future[None] = self._loop.create_future()

    def close(self) -> None:
        """Stop: the open step is not answered, and its samples are not delivered any more."""
        self._closed = True

    def _distribute(self, frame: Frame, received_ns: int) -> None:
        beacon = decode_beacon(frame.payload) if frame.message_id == SYSTEM_TIME else None
        if beacon is None:
            self._held_frames.append((frame, received_ns))
        else:  # not counted as telemetry: beacons have sequence numbers of their own
            self._take_beacon(beacon)

    def _take_beacon(self, time_boot_ms: int) -> None:
        """Take a beacon: start a step, or answer a repeated beacon again."""
        if self.open_step_time_ms is not None:
            return  # a beacon repeated during the step; the answer to the step will follow
        if not self._lockstep_loop.advance(time_boot_ms / 1000.0):
            self._outbox.close_step(time_boot_ms)
            return
        self.open_step_time_ms = time_boot_ms
        if not self.first_beacon.done():
            self.first_beacon.set_result(None)
        held_frames, self._held_frames = self._held_frames, []
        for frame, received_ns in held_frames:
            super()._distribute(frame, received_ns)
        self._lockstep_loop.settle(self._deliver_samples)

    def _call_on_attitude(self, sample: AttitudeSample) -> None:
        self._held_samples.append(sample)

    def _deliver_samples(self) -> None:
        if self._closed:
            return
        samples, self._held_samples = self._held_samples, []
        for sample in samples:
            super()._call_on_attitude(sample)
        # Settle again, so that tasks started by the control loop send before the step closes.
        self._lockstep_loop.settle(self._close_step)

    def _close_step(self) -> None:
        step_time_ms, self.open_step_time_ms = self.open_step_time_ms, None
        if step_time_ms is not None and not self._closed:
            self._outbox.close_step(step_time_ms)
