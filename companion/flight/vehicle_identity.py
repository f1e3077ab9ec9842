"""The vehicle's identity: whether it is still the checked one, and what earlier flights learned."""

from collections.abc import Callable
from pathlib import Path

from companion.config import Config
from companion.config.known_drag import KnownDrag, drag_of_vehicle, prior_of
from companion.guidance.drag_estimate import DragEstimate
from companion.preflight.evidence import Identity
from companion.recording.learned_file import LearnedFile
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.link import Link

LONGEST_SILENCE = 2.0
"""After a longer silence the vehicle may be another one, s. Frames of the same vehicle come sooner,
even on the worst permitted link."""
_LONGEST_UPDATE_INTERVAL = 0.1
"""A longer interval between two updates is our own stall and does not count as silence, s."""


class VehicleReplaced(FlightEnded):
    """The vehicle was perhaps replaced after the checks, so the checks must be repeated."""


class ReplacementDetector:
    """Detects that another vehicle, or a restarted one, may have replaced the checked one.

    Two vehicles may have the same system and component ids. So the checks are void after a new peer
    on the link, a restarted clock, another hardware id, or a long silence.

    Args:
        clock: returns event-loop time, s.

    Attributes:
        uid: hardware id of the checked vehicle; None: unknown.
    """

    def __init__(self, link: Link, clock: Callable[[], float]) -> None:
        self._link, self._clock = link, clock
        self._has_begun = self._arming_noted = False
        self._peer_count = self._restart_count = self._timesync_restart_count = 0
        self.uid: str | None = None
        self._other_uid: str | None = None
        self._frame_count = 0
        self._updated_at = clock()
        self._silence = self._long_silence = 0.0

    def begin(self) -> None:
        """Begin to watch: from now on, all frames must come from the same vehicle."""
        self._has_begun, self._arming_noted = True, False
        self.uid = self._other_uid = None
        self._peer_count = self._link.stats.peers
        self._restart_count = self._link.clock.restart_count
        self._timesync_restart_count = self._link.timesync.restart_count
        self._frame_count, self._updated_at = self._link.stats.frames, self._clock()
        self._silence = self._long_silence = 0.0

    def note_arming(self) -> None:
        """Note that the vehicle is being armed: from now on a replacement ends the flight.

        From now on, silence is no sign of a replacement; watch and safety monitors check silence.
        """
        self._arming_noted, self._long_silence = True, 0.0

    def update(self) -> None:
        """Measure the silence; the watch calls this 50 times a second."""
        now, frames = self._clock(), self._link.stats.frames
        interval, self._updated_at = now - self._updated_at, now
        if frames == self._frame_count:
            self._silence += min(interval, _LONGEST_UPDATE_INTERVAL)
            return
        if self._silence > LONGEST_SILENCE and not self._arming_noted:
            self._long_silence = self._silence
        self._frame_count, self._silence = frames, 0.0

    def note_identity(self, identity: Identity) -> None:
        """Take the identity from AUTOPILOT_VERSION; an unknown hardware id is ignored."""
        if self.uid is None:
            self.uid = identity.uid
        elif identity.uid not in (None, self.uid):
            self._other_uid = identity.uid

    @property
    def is_same_vehicle(self) -> bool:
        """Whether there is no sign of a replacement; the control loop asks at every sample."""
        return (
            self._peer_count == self._link.stats.peers
            and self._restart_count == self._link.clock.restart_count
            and self._other_uid is None
            and not self._long_silence
            and (self._silence <= LONGEST_SILENCE or self._arming_noted)
        ) or not self._has_begun

    def require(self) -> None:
        """Require the same vehicle.

        Raises:
            VehicleReplaced: it may be another vehicle, and nothing is armed yet.
            FlightEnded: it may be another vehicle; control is released.
        """
        if self.is_same_vehicle or (reason := self._sign_of_replacement()) is None:
            return
        if self._arming_noted:
            raise FlightEnded(reason, Exit.RELEASE)
        raise VehicleReplaced(reason)

    def restart_in_words(self) -> str | None:
        """A restart that the stamps of the attitude or the TIMESYNC answers show; None: neither.

        ArduPilot sends no attitude after a restart until somebody requests it.
        """
        clock, timesync = self._link.clock, self._link.timesync
        if self._restart_count != clock.restart_count:
            return f"the autopilot may have restarted: {clock.last_change}"
        if self._timesync_restart_count != timesync.restart_count:
            return f"the autopilot may have restarted: {timesync.last_restart}"
        return None

    def _sign_of_replacement(self) -> str | None:
        """The sign of a replacement, in words.

        None: there is no sign, or the vehicle is still silent; a silence counts when it ends.
        """
        if self._peer_count != self._link.stats.peers:
            return "the vehicle is heard from another address or connection than before"
        if self._restart_count != self._link.clock.restart_count:
            return self.restart_in_words()
        if self._other_uid is not None:
            return f"another vehicle answers: hardware id {self._other_uid}, not {self.uid}"
        if self._long_silence:
            return f"the vehicle was not heard for {self._long_silence:.1f} s"
        return None


class DragMemory:
    """Starts the drag estimate from the drag that an earlier flight of the vehicle learned.

    A configured drag takes precedence. A vehicle without a hardware id is not remembered.

    Args:
        directory: folder of the flights; None: nothing is remembered.
        note: called with messages for the user.

    Attributes:
        on_estimate_begin: called when the estimate begins with a vehicle's learned drag, or
            without one.
        on_known_drag: called with what is known of the drag, once for each vehicle.
    """

    def __init__(
        self,
        config: Config,
        directory: Path | None,
        estimate: DragEstimate,
        note: Callable[[str], None],
    ) -> None:
        self._config, self._directory = config, directory
        self._estimate, self._note = estimate, note
        self._file: LearnedFile | None = None
        self._uid: str | None = None
        self._known_drag: KnownDrag | None = None
        self.on_estimate_begin: Callable[[KnownDrag], None] = lambda _: None
        self.on_known_drag: Callable[[KnownDrag], None] = lambda _: None

    def load(self, identity: Identity) -> KnownDrag:
        """Return what is known of this vehicle's drag.

        The file is read at the first call, and again whenever the hardware id has changed.
        """
        if self._known_drag is None or identity.uid != self._uid:
            self._uid = identity.uid
            self._known_drag = drag_of_vehicle(self._config, self._directory, identity.uid)
            self._begin_estimate(self._known_drag)
            self.on_known_drag(self._known_drag)
        return self._known_drag

    def _begin_estimate(self, known_drag: KnownDrag) -> None:
        """Restart the estimate if the vehicle has changed; without a hardware id, do nothing."""
        if self._uid is None or self._directory is None:
            return
        file = LearnedFile(self._directory, self._uid)
        if self._file is not None and self._file.path == file.path:
            return
        self._file = file
        if self._config.guidance.drag is not None:
            return
        self._estimate.begin(prior_of(known_drag.drag))
        self.on_estimate_begin(known_drag)
        if known_drag.file_fault is not None:
            self._note(known_drag.file_fault)
        if known_drag.drag is not None:
            self._note(
                "drag from an earlier flight of this vehicle: linear "
                f"{known_drag.drag.linear:.2f} 1/s, quadratic {known_drag.drag.quadratic:.3f} 1/m "
                f"({file.path})"
            )

    def save(self) -> bool:
        """After the flight, save the learned drag if the flight had enough motion to learn it.

        Returns:
            Whether the vehicle's next flight begins with the learned drag: it was saved, and no
            configured drag takes precedence.
        """
        if self._file is None or not self._estimate.certain:
            return False
        try:
            self._file.save(self._estimate.drag, self._estimate.top_speed)
        except OSError as error:
            self._note(f"{self._file.path}: cannot keep the learned drag: {error.strerror}")
            return False
        return self._config.guidance.drag is None
