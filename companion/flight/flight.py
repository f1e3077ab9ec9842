"""One flight from the first heartbeat to the last: runs the phases, and sees to every ending."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from typing import Any

from companion.flight.context import FlightContext
from companion.flight.observer import Observer
from companion.flight.phases import Phase, exit_phases, flight_phases, ground_phases
from companion.flight.same_vehicle import ChecksVoid
from companion.flight.watch import Watch
from companion.mavlink.errors import LinkError
from companion.safety.ending import Exit, FlightEnded, internal

AskLanding = Callable[[], Awaitable[bool]]

_WATCH_PERIOD = 0.02
_TELL_PERIOD = 1.0
_CHECKED_ANEW = 5
"""How often a flight may begin anew because another vehicle may have come, before it gives up."""


class Flight:
    """Runs the phases in order; the first failure ends the flight and decides how it is left.

    Attributes:
        phase: the phase it is in.
        failed_in: the phase that failed, or None.
        events: what happened, as (time in s since the flight began, text).

    Args:
        context: the parts of the flight.
        watch: judges while the phases run.
        observer: is told what happens.
        ask_landing: asked after the user interrupted and the vehicle holds: land it?
    """

    def __init__(
        self, context: FlightContext, watch: Watch, observer: Observer, ask_landing: AskLanding
    ) -> None:
        self._ground = ground_phases(context.config.flight)
        self.phase = self._ground[0]
        self.failed_in: Phase | None = None
        self.events: list[tuple[float, str]] = []
        self._context = context
        self._watch = watch
        self._observer = observer
        self._ask_landing = ask_landing
        self._clock = asyncio.get_running_loop().time
        self._began = self._clock()
        self._entered = self._began
        self._interrupted = False
        self._asking = False
        self._end = self._new_end()

    async def run(self) -> str:
        """Fly; returns "ok" or the reason for which the flight ended."""
        helpers = [
            asyncio.create_task(self._offboard_active(work))
            for work in (self._context.guidance_loop.run, self._judge, self._tell)
        ]
        try:
            await self._fly_all()
        except FlightEnded as ended:
            self.failed_in = self.phase
            self.note(ended.reason)
            await self._leave(ended.exit or self._usual_exit())
            return ended.reason
        finally:
            self._context.release()
            for task in helpers:
                await _cancelled(task)
        return "ok"

    def end(self, ended: FlightEnded) -> None:
        """End the running phase from outside it; only the first reason counts."""
        if ended.exit is Exit.RELEASE:
            self._context.release()
        if not self._end.done():
            self._end.set_result(ended)

    def fail(self, error: Exception) -> None:
        """A fault of ours beside the phases ends the flight; an ending under way goes on.

        It then goes on without our stream, which may be what is at fault.
        """
        reason = internal(error)
        if self.failed_in is None:
            self.end(FlightEnded(reason))
            return
        self._context.release()
        if all(text != reason for _, text in self.events):
            self.note(reason)

    def interrupt(self, reason: str) -> None:
        """The user wants out: hold if we fly, else whatever the phase needs.

        An ending that is under way goes on: it does what the vehicle needs. While the user is asked
        whether to land, it is a no.
        """
        self._interrupted = True
        if self.failed_in is None:
            usual = self._usual_exit()
            self.end(FlightEnded(reason, Exit.HOLD if usual is Exit.LAND else usual))
        elif self._asking:
            self.end(FlightEnded(reason))

    def on_heartbeat(self) -> None:
        """Judge at once what the heartbeat that just came says."""
        self._heed(self._watch.on_heartbeat)

    def on_current_mode(self) -> None:
        """Judge at once what the CURRENT_MODE that just came says."""
        self._heed(self._watch.on_current_mode)

    def note(self, text: str) -> None:
        """Write down and show that something happened."""
        time = self._clock() - self._began
        self.events.append((time, text))
        self._observer.event(time, text)

    def _heed(self, judge: Callable[[Phase], None]) -> None:
        try:
            judge(self.phase)
        except FlightEnded as ended:
            self.end(ended)

    async def _fly_all(self) -> None:
        """Run all phases; from the first again if another vehicle may stand there than was checked.

        Raises:
            FlightEnded: the first failure.
        """
        for _ in range(_CHECKED_ANEW):
            try:
                for phase in self._phases():
                    await self._fly(phase)
            except ChecksVoid as void:
                self.note(f"{void.reason}; the checks are made anew")
                self._context.release()
                self._context.link.state.forget()
                self._context.same_vehicle.begin()
                self._end = self._new_end()
            else:
                return
        raise FlightEnded(f"the vehicle changed {_CHECKED_ANEW} times before it was armed")

    def _phases(self) -> Iterator[Phase]:
        """All phases, in order; what follows the ground's depends on the autopilot met there."""
        yield from self._ground
        context = self._context
        yield from flight_phases(
            context.config.flight, context.maneuvers.duration, context.link.autopilot
        )

    async def _fly(self, phase: Phase) -> None:
        """Run one phase to its end; whatever goes wrong becomes a `FlightEnded`."""
        self.phase, self._entered = phase, self._clock()
        self._observer.phase(phase.name, phase.waits_for)
        if not self._end.done():
            self._judge_once(phase)  # before the phase commands anything
        if not self._end.done():
            await self._race(phase.work(self._context), phase.timeout)
        if self._end.done():
            raise self._end.result()

    async def _race(self, work: Coroutine[Any, Any, Any], seconds: float | None) -> Any:
        """Run `work` until it is done, the flight is ended, or the time is over."""
        task = asyncio.create_task(work)
        either: set[asyncio.Future[Any]] = {task, self._end}
        try:
            await asyncio.wait(either, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
            if self._end.done():
                return None
            if not task.done():
                raise FlightEnded(
                    f"waited {seconds:g} s for {self.phase.waits_for}: {self._context.detail}"
                )
            return task.result()
        except (FlightEnded, asyncio.CancelledError):
            raise
        except LinkError as error:
            raise FlightEnded(str(error)) from error
        except Exception as error:
            raise FlightEnded(internal(error)) from error
        finally:
            await _cancelled(task)

    def _usual_exit(self) -> Exit:
        phase = self.phase
        if phase.on_failure_landed is not None and self._context.ground.standing:
            return phase.on_failure_landed
        return phase.on_failure

    async def _leave(self, exit_: Exit) -> None:
        """Do with the vehicle what the ending asks for; what fails here is told, not raised."""
        try:
            await self._exit(exit_)
            if exit_ is Exit.HOLD and self._interrupted and await self._told_to_land():
                await self._exit(Exit.LAND)
        except FlightEnded as ended:
            self.note(ended.reason)

    async def _exit(self, exit_: Exit) -> None:
        """Fly an ending; where a phase of it fails, the ending which that phase says for that."""
        self.note(exit_.value)
        self._end = self._new_end()
        try:
            for phase in exit_phases(self._context.config.flight, exit_):
                await self._fly(phase)
        except FlightEnded as ended:
            then = ended.exit or self._usual_exit()
            if then in (exit_, Exit.LEAVE, Exit.RELEASE):
                raise
            self.note(ended.reason)
            await self._exit(then)

    async def _told_to_land(self) -> bool:
        """Ask the user; somebody else may take the vehicle while the answer is thought over."""
        self._asking = True
        try:
            return bool(await self._race(_called(self._ask_landing), None))
        finally:
            self._asking = False

    async def _offboard_active(self, work: Callable[[], Awaitable[None]]) -> None:
        """Run what runs beside the phases; a fault of ours there must not go unseen."""
        try:
            await work()
        except Exception as error:
            self.fail(error)

    async def _judge(self) -> None:
        while True:
            self._judge_once(self.phase)
            await asyncio.sleep(_WATCH_PERIOD)

    def _judge_once(self, phase: Phase) -> None:
        try:
            self._watch.judge(phase)
        except FlightEnded as ended:
            self.end(ended)
        except Exception as error:  # the watch goes on: an ending needs it, too
            self.fail(error)

    async def _tell(self) -> None:
        while True:
            await asyncio.sleep(_TELL_PERIOD)
            elapsed = self._clock() - self._entered
            self._observer.waiting(
                self.phase.name, self._context.detail, elapsed, self.phase.timeout
            )

    @staticmethod
    def _new_end() -> asyncio.Future[FlightEnded]:
        return asyncio.get_running_loop().create_future()


async def _called(ask: AskLanding) -> bool:
    return await ask()


async def _cancelled(task: asyncio.Task[Any]) -> None:
    """Cancel a task and wait until it is gone; its outcome was read elsewhere."""
    task.cancel()
    await asyncio.wait({task})
    if not task.cancelled():
        task.exception()
