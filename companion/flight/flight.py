"""One flight from the first heartbeat to the last: runs the phases, and sees to every ending."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from typing import Any

from companion.flight.ending import Exit, FlightEnded
from companion.flight.guide import Guide
from companion.flight.observer import Observer
from companion.flight.phases import Phase
from companion.flight.procedures import Procedures
from companion.flight.watch import Watch
from companion.mavlink.errors import LinkError

AskLanding = Callable[[], Awaitable[bool]]

_WATCH_PERIOD = 0.02
_TELL_PERIOD = 1.0


class Flight:
    """Runs the phases in order; the first failure ends the flight and decides how it is left.

    Attributes:
        phase: the phase it is in.
        failed_in: the phase that failed, or None.
        events: what happened, as (time in s since the flight began, text).

    Args:
        phases: in their order; "hand back", "land" and "disarm" also serve an early ending.
        ask_landing: asked after the user interrupted and the vehicle holds: land it?
    """

    def __init__(
        self,
        phases: tuple[Phase, ...],
        procedures: Procedures,
        guide: Guide,
        watch: Watch,
        observer: Observer,
        ask_landing: AskLanding,
    ) -> None:
        self.phase = phases[0]
        self.failed_in: Phase | None = None
        self.events: list[tuple[float, str]] = []
        self._phases = phases
        self._procedures = procedures
        self._guide = guide
        self._watch = watch
        self._observer = observer
        self._ask_landing = ask_landing
        self._clock = asyncio.get_running_loop().time
        self._began = self._clock()
        self._entered = self._began
        self._interrupted = False
        self._end = self._new_end()

    async def run(self) -> str:
        """Fly; returns "ok" or the reason for which the flight ended."""
        helpers = [
            asyncio.create_task(self._guarded(work))
            for work in (self._guide.run(), self._judge(), self._tell())
        ]
        try:
            for phase in self._phases:
                await self._fly(phase)
        except FlightEnded as ended:
            self.failed_in = self.phase
            self.note(ended.reason)
            await self._leave(ended.exit or self.phase.on_failure)
            return ended.reason
        finally:
            self._procedures.release()
            for task in helpers:
                await _cancelled(task)
        return "ok"

    def end(self, ended: FlightEnded) -> None:
        """End the running phase from outside it; only the first reason counts."""
        if ended.exit is Exit.LET_GO:
            self._procedures.release()
        if not self._end.done():
            self._end.set_result(ended)

    def interrupt(self, reason: str) -> None:
        """The user wants out: hold if we fly, else whatever the phase needs."""
        self._interrupted = True
        flying = self.phase.on_failure is Exit.LAND
        self.end(FlightEnded(reason, Exit.HOLD if flying else None))

    def on_heartbeat(self) -> None:
        """Judge at once what the heartbeat that just came says."""
        try:
            self._watch.on_heartbeat(self.phase)
        except FlightEnded as ended:
            self.end(ended)

    def note(self, text: str) -> None:
        """Write down and show that something happened."""
        time = self._clock() - self._began
        self.events.append((time, text))
        self._observer.event(time, text)

    async def _fly(self, phase: Phase) -> None:
        """Run one phase to its end; whatever goes wrong becomes a `FlightEnded`."""
        self.phase, self._entered = phase, self._clock()
        self._observer.phase(phase.name, phase.waits_for)
        procedure: Callable[[], Coroutine[Any, Any, None]] = getattr(
            self._procedures, phase.name.replace(" ", "_")
        )
        task = asyncio.create_task(procedure())
        try:
            either: set[asyncio.Future[Any]] = {task, self._end}
            await asyncio.wait(either, timeout=phase.timeout, return_when=asyncio.FIRST_COMPLETED)
            if self._end.done():
                raise self._end.result()
            if not task.done():
                raise FlightEnded(
                    f"waited {phase.timeout:g} s for {phase.waits_for}: {self._procedures.detail}"
                )
            task.result()
        except LinkError as error:
            raise FlightEnded(str(error)) from error
        finally:
            await _cancelled(task)

    async def _leave(self, exit_: Exit) -> None:
        """Do with the vehicle what the ending asks for; what fails here is told, not raised."""
        self.note(exit_.value)
        self._end = self._new_end()
        try:
            if exit_ is Exit.HOLD:
                await self._fly(self._named("hand back"))
                if not (self._interrupted and await self._ask_landing()):
                    return
            if exit_ in (Exit.HOLD, Exit.LAND):
                await self._fly(self._named("land"))
            if exit_ in (Exit.HOLD, Exit.LAND, Exit.DISARM):
                self._procedures.release()
                await self._fly(self._named("disarm"))
        except FlightEnded as ended:
            self.note(ended.reason)

    async def _guarded(self, work: Coroutine[Any, Any, None]) -> None:
        """Run what runs beside the phases; a fault of ours there must not go unseen."""
        try:
            await work
        except Exception as error:
            self.end(FlightEnded(f"internal error: {error!r}", Exit.LAND))

    async def _judge(self) -> None:
        while True:
            try:
                self._watch.judge(self.phase)
            except FlightEnded as ended:
                self.end(ended)
            await asyncio.sleep(_WATCH_PERIOD)

    async def _tell(self) -> None:
        while True:
            await asyncio.sleep(_TELL_PERIOD)
            elapsed = self._clock() - self._entered
            self._observer.waiting(
                self.phase.name, self._procedures.detail, elapsed, self.phase.timeout
            )

    def _named(self, name: str) -> Phase:
        return next(phase for phase in self._phases if phase.name == name)

    @staticmethod
    def _new_end() -> asyncio.Future[FlightEnded]:
        return asyncio.get_running_loop().create_future()


async def _cancelled(task: asyncio.Task[Any]) -> None:
    """Cancel a task and wait until it is gone; its outcome was read elsewhere."""
    task.cancel()
    with suppress(asyncio.CancelledError, FlightEnded, LinkError):
        await task
