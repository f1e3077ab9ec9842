"""One flight from the first heartbeat to the last: its phases, and the exit after a failure."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import aclosing
from math import inf
from typing import Any

from companion.flight.cause import with_cause
from companion.flight.context import FlightContext, cancel, wait_for_first
from companion.flight.observer import Observer
from companion.flight.phase import Phase
from companion.flight.phases import EXIT_PHASES, ground_phases
from companion.flight.plan import Plan
from companion.flight.vehicle_identity import VehicleReplaced
from companion.flight.watch import Watch
from companion.mavlink.errors import LinkError
from companion.safety.actions import Exit, FlightEnded, fault_message

AskLanding = Callable[[], Coroutine[Any, Any, bool]]

_WATCH_PERIOD, _PROGRESS_PERIOD = 0.02, 1.0
_MAX_CHECK_RUNS = 5
"""Largest number of times that the checks run, if the vehicle may have been replaced each time."""


class Flight:
    """Runs the phases in order; after the first failure, runs an exit, such as hold or land.

    Attributes:
        began: time when the flight began, s of event-loop time.
        phase, failed_phase: the running phase; the phase that failed, or None.
        end_reason: why the flight ends or ended early, or None.
        events: (time since the flight began, s; text) of each event.

    Args:
        watch: runs the safety monitors beside the phases.
        ask_landing: asks the user, after an interrupt when the vehicle holds, whether to land.
    """

    def __init__(
        self,
        context: FlightContext,
        plan: Plan,
        watch: Watch,
        observer: Observer,
        ask_landing: AskLanding,
    ) -> None:
        self.phase = ground_phases(context.config.flight)[0]
        self.failed_phase: Phase | None = None
        self.end_reason: str | None = None
        self.events: list[tuple[float, str]] = []
        self._context, self._plan, self._watch = context, plan, watch
        self._observer, self._ask_landing, self._is_asking_landing = observer, ask_landing, False
        self._clock = asyncio.get_running_loop().time
        self.began = self._phase_began = self._clock()
        self._interruption: FlightEnded | None = None
        self._end_future = self._new_end_future()

    async def run(self) -> str:
        """Fly; returns "ok" or the reason why the flight ended early."""
        background_tasks = [
            asyncio.create_task(self._run_repeatedly(work))
            for work in (self._context.guidance_loop.run, self._watch_once, self._report_progress)
        ]
        try:
            await self._fly_all()
        except FlightEnded as first_failure:
            self.failed_phase, self.end_reason = self.phase, first_failure.reason
            ended = await with_cause(self._context, first_failure)
            self.end_reason = ended.reason
            self.note(ended.reason)
            await self._leave(ended.exit or self._usual_exit())
            return ended.result
        finally:
            await self._context.stop(background_tasks)
        return "ok"

    def end(self, ended: FlightEnded) -> None:
        """End the running phase from outside; only the first reason counts."""
        if ended.exit is not None and not ended.exit.sends_setpoints:
            self._context.release()
        if not self._end_future.done():
            self._end_future.set_result(ended)

    def fail(self, error: Exception) -> None:
        """End the flight after an exception outside the phases.

        An exit that has already begun continues without setpoints: they may have caused the fault.
        """
        if self.failed_phase is None:
            self.end(FlightEnded(fault_message(error, self._usual_exit())))
            return
        self._context.end_stream()
        reason = fault_message(error)
        if not any(text.startswith(reason) for _, text in self.events):
            self.note(reason)

    def interrupt(self, reason: str) -> None:
        """End the flight for the user: hold if the vehicle flies, else run the phase's usual exit.

        An exit that has already begun continues. While the user is asked whether to land, an
        interrupt answers no.
        """
        usual_exit = self._usual_exit()
        exit_ = Exit.HOLD if usual_exit is Exit.LAND else usual_exit
        self._interruption = FlightEnded(reason, exit_)
        if self.failed_phase is None or self._is_asking_landing:
            self.end(self._interruption)

    def on_heartbeat(self) -> None:
        """On a new HEARTBEAT, check at once whether the phase may go on."""
        self._run_check(self._watch.check)

    def on_current_mode(self) -> None:
        """On a new CURRENT_MODE, check at once whether the phase may go on."""
        self._run_check(self._watch.on_current_mode)

    def note(self, text: str) -> None:
        """Record an event and show it."""
        time = self._clock() - self.began
        self.events.append((time, text))
        self._observer.event(time, text)

    async def _fly_all(self) -> None:
        """Run all phases; start again if another vehicle may have replaced the checked one.

        Raises:
            FlightEnded: the first failure.
        """
        for _ in range(_MAX_CHECK_RUNS):
            try:
                async with aclosing(self._plan.phases(self._context)) as phases:
                    async for phase in phases:
                        await self._fly(phase)
            except VehicleReplaced as replacement:
                self.note(f"{replacement.reason}; the checks are repeated")
                self._context.release()
                self._context.link.state.forget()
                self._context.replacement_detector.begin()
                self._end_future = self._new_end_future()
                if self._interruption is not None:  # after the checks became void
                    raise self._interruption from replacement
            except FlightEnded:
                raise
            except Exception as error:  # a fault of the plan: the exit must still run
                raise FlightEnded(fault_message(error, self._usual_exit())) from error
            else:
                return
        raise FlightEnded(
            f"the vehicle was lost, restarted or replaced {_MAX_CHECK_RUNS} times before arming; "
            "check the link and the vehicle's power"
        )

    async def _fly(self, phase: Phase) -> None:
        """Run one phase; every failure becomes a `FlightEnded`."""
        self.phase, self._phase_began = phase, self._clock()
        self._observer.phase(phase.name, phase.waits_for)
        if not self._end_future.done():
            self._run_check(self._watch.check)  # before the phase commands anything
        if not self._end_future.done():
            await self._run_until_end(phase.work(self._context), phase.timeout)
        if self._end_future.done():
            raise self._end_future.result()

    async def _run_until_end(self, work: Coroutine[Any, Any, Any], seconds: float) -> Any:
        """Run `work` until it is done, the flight is ended, or `seconds`, less stalls, are over."""
        task = asyncio.create_task(work)
        try:
            await wait_for_first({task, self._end_future}, seconds)
            if self._end_future.done():
                return None
            if not task.done():
                raise self._context.timed_out(seconds, self.phase.waits_for)
            return task.result()
        except (FlightEnded, asyncio.CancelledError):
            raise
        except LinkError as error:
            raise FlightEnded(str(error)) from error
        except Exception as error:
            raise FlightEnded(fault_message(error, self._usual_exit())) from error
        finally:
            await cancel(task)

    def _usual_exit(self) -> Exit:
        context = self._context
        taken = context.loop.taking_over or context.loop.offboard_active
        exit_ = self.phase.exit_on_failure(standing=context.ground.standing, taken=taken)
        return Exit.LEAVE if exit_ is Exit.DISARM and not context.must_disarm else exit_

    async def _leave(self, exit_: Exit) -> None:
        """Run the exit, then land if the user wants to; a failure is noted, not raised."""
        try:
            await self._fly_exit(exit_)
            if exit_ is Exit.HOLD and self._interruption and await self._user_wants_landing():
                await self._fly_exit(Exit.LAND)
        except FlightEnded as ended:
            self.note((await with_cause(self._context, ended)).reason)

    async def _fly_exit(self, exit_: Exit) -> None:
        """Run the phases of an exit; if a phase fails, run the exit of the failed phase."""
        self.note(exit_.value)
        self._end_future = self._new_end_future()
        try:
            for phase in EXIT_PHASES[exit_]:
                await self._fly(phase)
        except FlightEnded as ended:
            next_exit = ended.exit or self._usual_exit()
            if next_exit in (exit_, Exit.LEAVE, Exit.RELEASE):
                raise
            self.note(ended.reason)
            await self._fly_exit(next_exit)

    async def _user_wants_landing(self) -> bool:
        """Ask the user whether to land; False if the flight ends before the answer."""
        self._is_asking_landing = True
        try:
            return bool(await self._run_until_end(self._ask_landing(), inf))
        finally:
            self._is_asking_landing = False

    async def _run_repeatedly(self, work: Callable[[], Awaitable[None]]) -> None:
        """Run `work` repeatedly while the phases run; an exception in `work` ends the flight."""
        while True:
            try:
                await work()
            except Exception as error:  # guidance goes on: it holds until the autopilot has control
                self.fail(error)
            await asyncio.sleep(_WATCH_PERIOD)

    async def _watch_once(self) -> None:
        self._run_check(self._watch.check)

    def _run_check(self, check: Callable[[Phase], None]) -> None:
        try:
            check(self.phase)
        except FlightEnded as ended:
            self.end(ended)
        except Exception as error:  # the watch goes on: an exit needs it
            self.fail(error)

    async def _report_progress(self) -> None:
        while True:
            await asyncio.sleep(_PROGRESS_PERIOD)
            phase, elapsed = self.phase, self._clock() - self._phase_began
            self._observer.waiting(phase.name, self._context.waiting_for, elapsed, phase.timeout)

    @staticmethod
    def _new_end_future() -> asyncio.Future[FlightEnded]:
        return asyncio.get_running_loop().create_future()
