"""Selects the vehicle's frames, by their system and component ids and their signature."""

from collections.abc import Callable

from companion.mavlink.framing import Frame
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stamps import SignatureResult
from companion.mavlink.stats import LinkStats

Notice = Callable[[str], None]
"""Called with a sentence about the link for the user."""

_REFUSED_NOTICES = {
    SignatureResult.UNSIGNED: "the vehicle does not sign its frames, so they are refused; give it "
    "the same key as link.signing_key_file, or leave signing out on both sides",
    SignatureResult.WRONG_KEY: "the vehicle signs its frames with another key, so they are "
    "refused; give both sides the same key (link.signing_key_file)",
}
"""Notices about refused signatures; `Signing.remarks` has the notices about their time stamps."""

_KEY_MISSING_NOTICE = (
    "the vehicle signs its frames and we do not, so it may obey nothing we send; set "
    "link.signing_key_file to a file with its passphrase"
)


class FrameFilter:
    """Passes only the vehicle's frames, and counts those that it refuses.

    Args:
        notice: called once with each notice about signatures and their time stamps.
    """

    def __init__(self, settings: LinkSettings, stats: LinkStats, notice: Notice) -> None:
        self._vehicle_ids = (settings.target_system, settings.target_component)
        self._signing = settings.signing
        self._stats, self._notify = stats, notice
        self._notified_texts: set[str] = set()

    @property
    def needs_timesync_answer(self) -> bool:
        """Whether only a TIMESYNC answer can prove the stamp of the last frame; see `Signing`."""
        return self._signing is not None and self._signing.needs_timesync_answer

    def is_vehicle(self, frame: Frame) -> bool:
        """Whether a frame carries the vehicle's system and component id."""
        return (frame.system, frame.component) == self._vehicle_ids

    def admits_source(self, frame: Frame) -> bool:
        """Whether a frame carries the vehicle's ids; any other frame is counted as foreign."""
        if self.is_vehicle(frame):
            return True
        self._stats.ignored_foreign += 1
        self._stats.foreign_sources.add((frame.system, frame.component))
        return False

    def has_good_signature(self, frame: Frame) -> bool:
        """Whether a frame is signed as required; without a key every frame is good."""
        if self._signing is None:
            if frame.signed:
                self.notify_once(_KEY_MISSING_NOTICE)
            return True
        result = self._signing.check(frame)
        self.report_stamp_remarks()
        if result is SignatureResult.GOOD:
            return True
        self._stats.bad_signature += 1
        if result in _REFUSED_NOTICES:
            self.notify_once(_REFUSED_NOTICES[result])
        return False

    def report_stamp_remarks(self) -> None:
        """Pass the remarks about the time stamps of signatures to the user."""
        while self._signing is not None and self._signing.remarks:
            self.notify_once(self._signing.remarks.pop(0))

    def notify_once(self, text: str) -> None:
        """Pass a notice to the user, unless the same text was passed before."""
        if text not in self._notified_texts:
            self._notified_texts.add(text)
            self._notify(text)
