"""Notes the changes of the vehicle's mode and arming state, and the autopilot's texts."""

from collections.abc import Callable

from companion.mavlink.texts import StatusText
from companion.vehicle.state import VehicleState


class StateLogger:
    """Notes each change of mode and arming state, and each text of the autopilot, as an event.

    The first call notes the present mode and arming state, but no text from before.

    Args:
        state: telemetry of the vehicle.
        note: called with each change as a sentence.
    """

    def __init__(self, state: VehicleState, note: Callable[[str], None]) -> None:
        self._state = state
        self._note = note
        self._mode: str | None = None
        self._armed: bool | None = None
        self._last_text: StatusText | None = state.texts[-1] if state.texts else None

    def log_changes(self) -> None:
        """Note every change since the last call."""
        state = self._state
        for text in self._new_texts():
            self._note(f"autopilot: {text.text}")
        if state.mode != self._mode:
            self._mode = state.mode
            self._note(f"mode {state.mode}")
        if state.armed != self._armed:
            self._armed = state.armed
            self._note("armed" if state.armed else "disarmed")

    def _new_texts(self) -> list[StatusText]:
        new: list[StatusText] = []
        for text in reversed(self._state.texts):
            if text is self._last_text:
                break
            new.insert(0, text)
        if new:
            self._last_text = new[-1]
        return new
