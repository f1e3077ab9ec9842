"""Observers of a flight."""

from collections.abc import Callable
from typing import Protocol

from companion.flight.status import FlightStatus
from companion.recording.recorder import FlightRecorder

_LONGEST_CALL_S = 0.2
"""An observer's call that takes longer is reported, s: each call blocks the control loop."""


class Observer(Protocol):
    """Receives the events of a flight in order; every method must return at once."""

    def phase(self, name: str, waits_for: str) -> None:
        """A phase began; `waits_for` names the condition that ends it, as shown to the user."""

    def waiting(self, name: str, waiting_for: str, elapsed: float, timeout: float) -> None:
        """Once a second: name of the phase, what it waits for, elapsed time and timeout (s)."""

    def status(self, status: FlightStatus) -> None:
        """Ten times a second: the state of the flight."""

    def event(self, time: float, text: str) -> None:
        """An event, `time` s after the flight began."""


class SilentObserver:
    """An observer that ignores everything."""

    def phase(self, name: str, waits_for: str) -> None:
        """Ignore the phase."""

    def waiting(self, name: str, waiting_for: str, elapsed: float, timeout: float) -> None:
        """Ignore the progress."""

    def status(self, status: FlightStatus) -> None:
        """Ignore the state."""

    def event(self, time: float, text: str) -> None:
        """Ignore the event."""


class SeveralObservers:
    """Passes everything to several observers, in order."""

    def __init__(self, *observers: Observer) -> None:
        self._observers = observers

    def phase(self, name: str, waits_for: str) -> None:
        """Pass the phase on to each observer."""
        for observer in self._observers:
            observer.phase(name, waits_for)

    def waiting(self, name: str, waiting_for: str, elapsed: float, timeout: float) -> None:
        """Pass the progress on to each observer."""
        for observer in self._observers:
            observer.waiting(name, waiting_for, elapsed, timeout)

    def status(self, status: FlightStatus) -> None:
        """Pass the state on to each observer."""
        for observer in self._observers:
            observer.status(status)

    def event(self, time: float, text: str) -> None:
        """Pass the event on to each observer."""
        for observer in self._observers:
            observer.event(time, text)


async def decline_landing() -> bool:
    """Answer that the vehicle shall not land but hold, because nobody can be asked."""
    return False


class EventRecorder:
    """An observer that records phases and events, and passes everything to another observer.

    A fault in the other observer must not cost control of the vehicle. After an exception in its
    method `status`, the other observer receives no more states, but still phases and events. After
    any other exception it receives nothing more. A slow observer is reported once.

    Attributes:
        phases: (begin in s of event-loop time, name) of each phase.
        write, file: as the arguments.
        note: called once if the other observer fails; must record the failure as an event.

    Args:
        clock: returns event-loop time, s.
        write: records a text with the present time.
        file: `flight.mcap`; None: the flight is not recorded.
    """

    def __init__(
        self,
        observer: Observer,
        clock: Callable[[], float],
        write: Callable[[str], None],
        file: FlightRecorder | None = None,
    ) -> None:
        self.phases: list[tuple[float, str]] = []
        self.write = self.note = write
        self.file = file
        self._observer = observer
        self._clock = clock
        self._slow_call_reported = False

    def phase(self, name: str, waits_for: str) -> None:
        """Keep, record and pass on the phase."""
        self.phases.append((self._clock(), name))
        self.write(f"phase: {name}")
        if self.file is not None:
            self.file.phase(name, waits_for)
        self._tell_observer(lambda observer: observer.phase(name, waits_for))

    def waiting(self, name: str, waiting_for: str, elapsed: float, timeout: float) -> None:
        """Pass the progress on to the observer."""
        self._tell_observer(lambda observer: observer.waiting(name, waiting_for, elapsed, timeout))

    @property
    def wants_status(self) -> bool:
        """Whether the observer uses the status, which takes time to compute."""
        return type(self._observer).status is not SilentObserver.status

    def status(self, status: FlightStatus) -> None:
        """Pass the state on; if the observer raises, the caller must pass on no more states."""
        self._call_observer(lambda observer: observer.status(status))

    def event(self, time: float, text: str) -> None:
        """Record the event and pass it on."""
        self.write(text)
        self._tell_observer(lambda observer: observer.event(time, text))

    def _tell_observer(self, call: Callable[[Observer], None]) -> None:
        try:
            self._call_observer(call)
        except Exception as error:
            self._observer = SilentObserver()
            self.note(f"the observer of this flight failed and gets no more messages: {error!r}")

    def _call_observer(self, call: Callable[[Observer], None]) -> None:
        began = self._clock()
        try:
            call(self._observer)
        except SystemExit as error:  # would end the event loop of the flight
            raise RuntimeError(repr(error)) from error
        elapsed = self._clock() - began
        if elapsed > _LONGEST_CALL_S and not self._slow_call_reported:
            self._slow_call_reported = True
            self.note(
                f"the observer of this flight took {elapsed:.1f} s for one message: meanwhile no "
                "setpoint is sent and nothing is supervised; let it return at once"
            )
