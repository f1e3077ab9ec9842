"""ArduCopter's words. It has no events, and keeps what is missing here to itself."""

from collections.abc import Iterable

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.occasions import Event, Occasion
from sitl_mock.link.link import Link

INFO = dialect.MAV_SEVERITY_INFO
WARNING = dialect.MAV_SEVERITY_WARNING
CRITICAL = dialect.MAV_SEVERITY_CRITICAL

ARDUPILOT_EVENTS: dict[Occasion, Event] = {
    Occasion.ARMED: Event("Arming motors", INFO),
    Occasion.ARMING_DENIED: Event("Arm: {}", CRITICAL),
    Occasion.PREFLIGHT_FAIL: Event("PreArm: {}", CRITICAL),
    Occasion.DISARMED_BY_COMMAND: Event("Disarming motors", INFO),
    Occasion.DISARMED_BY_LANDING: Event("Disarming motors", INFO),
    Occasion.DISARMED_ON_GROUND: Event("Disarming motors", INFO),
    Occasion.DISARMED_AFTER_CRASH: Event("Crash: Disarming", CRITICAL),
    Occasion.MODE_DENIED: Event("Mode change to {} failed: requires position", WARNING),
    Occasion.GCS_LOST: Event("GCS Failsafe", WARNING),
    Occasion.GCS_REGAINED: Event("GCS Failsafe Cleared", WARNING),
    Occasion.POSITION_LOST: Event("EKF Failsafe: changed to LAND Mode", CRITICAL),
    Occasion.BATTERY_LOW: Event("Battery 1 is low {}", WARNING),
    Occasion.BATTERY_CRITICAL: Event("Battery 1 is critical {}", CRITICAL),
}

_CHUNK = 50


class ArduPilotAnnouncer:
    """Announces occasions, and says texts of no occasion.

    Args:
        links: where to.
    """

    def __init__(self, links: Iterable[Link]) -> None:
        self._links = list(links)
        self._long_texts = 0

    def __call__(self, occasion: Occasion, detail: str) -> None:
        """Tell of an occasion, unless ArduPilot keeps it to itself."""
        event = ARDUPILOT_EVENTS.get(occasion)
        if event is not None:
            self.say(event.text.format(detail), event.severity)

    def say(self, text: str, severity: int) -> None:
        """Send a text; only one that needs several chunks has an id (recorded)."""
        data = text.encode()
        chunks = [data[start : start + _CHUNK] for start in range(0, len(data), _CHUNK)]
        if len(chunks) > 1:
            self._long_texts += 1
        text_id = self._long_texts if len(chunks) > 1 else 0
        for link in self._links:
            if not link.heard:
                continue
            for number, chunk in enumerate(chunks):
                link.send(dialect.MAVLink_statustext_message(severity, chunk, text_id, number))
