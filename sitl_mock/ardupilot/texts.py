"""ArduCopter's texts. The autopilot sends no EVENT, and announces only the events listed here."""

from collections.abc import Iterable

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.events import Event, EventKind
from sitl_mock.link.link import TEXT_BYTES, Link

INFO = dialect.MAV_SEVERITY_INFO
WARNING = dialect.MAV_SEVERITY_WARNING
CRITICAL = dialect.MAV_SEVERITY_CRITICAL

ARDUPILOT_EVENTS: dict[EventKind, Event] = {
    EventKind.ARMED: Event("Arming motors", INFO),
    EventKind.ARMING_DENIED: Event("Arm: {}", CRITICAL),
    EventKind.PREFLIGHT_FAIL: Event("PreArm: {}", CRITICAL),
    EventKind.DISARMED_BY_COMMAND: Event("Disarming motors", INFO),
    EventKind.DISARMED_BY_LANDING: Event("Disarming motors", INFO),
    EventKind.DISARMED_ON_GROUND: Event("Disarming motors", INFO),
    EventKind.DISARMED_AFTER_CRASH: Event("Crash: Disarming", CRITICAL),
    EventKind.MODE_DENIED: Event("Mode change to {} failed: requires position", WARNING),
    EventKind.GCS_LOST: Event("GCS Failsafe", WARNING),
    EventKind.GCS_REGAINED: Event("GCS Failsafe Cleared", WARNING),
    EventKind.POSITION_LOST: Event("EKF Failsafe: changed to LAND Mode", CRITICAL),
    EventKind.BATTERY_LOW: Event("Battery 1 is low {}", WARNING),
    EventKind.BATTERY_CRITICAL: Event("Battery 1 is critical {}", CRITICAL),
}


class ArduPilotAnnouncer:
    """Sends the texts of events, and other texts, on every link with a client."""

    def __init__(self, links: Iterable[Link]) -> None:
        self._links = list(links)
        self._long_texts = 0

    def __call__(self, kind: EventKind, detail: str) -> None:
        """Announce an event, with a detail in its text, if ArduCopter has a text for it."""
        event = ARDUPILOT_EVENTS.get(kind)
        if event is not None:
            self.say(event.text.format(detail), event.severity)

    def say(self, text: str, severity: int) -> None:
        """Send a text; STATUSTEXT.id is 0 unless the text needs several messages (recorded)."""
        text_id = 0
        if len(text.encode()) > TEXT_BYTES:
            self._long_texts += 1
            text_id = self._long_texts
        for link in self._links:
            if link.client_has_sent:
                link.send_text(text, severity, text_id)
