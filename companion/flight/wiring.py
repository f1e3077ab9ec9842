"""Connects a flight to the link and to changed values; notes changes of mode and arming state."""

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import asynccontextmanager, contextmanager
from itertools import takewhile
from typing import Any

from companion.control.retuning import Retuning
from companion.flight.assembly import AssembledFlight
from companion.flight.context import cancel
from companion.mavlink.messages import Message
from companion.mavlink.texts import StatusText
from companion.safety.actions import fault_message
from companion.vehicle.records import AttitudeSample
from companion.vehicle.state import VehicleState


@asynccontextmanager
async def connected(
    assembled: AssembledFlight, *background_work: Coroutine[Any, Any, None]
) -> AsyncIterator[None]:
    """Connect the flight to its link and report its state while the block runs the flight.

    Only one flight at a time may be connected to a link.

    `background_work`: coroutines to run beside the flight. An exception in a coroutine, or in the
    reporter, is noted as an event and does not end the flight.
    """

    async def run_guarded(work: Coroutine[Any, Any, None]) -> None:
        try:
            await work
        except Exception as error:
            assembled.flight.note(fault_message(error))

    try:
        with _callbacks(assembled):
            all_work = assembled.reporter.run(), *background_work
            tasks = [asyncio.create_task(run_guarded(work)) for work in all_work]
            try:
                yield
            finally:
                for task in tasks:
                    await cancel(task)
    finally:
        assembled.close()


@contextmanager
def _callbacks(assembled: AssembledFlight) -> Iterator[None]:
    """Connect the flight to the link's callbacks and to changed values while the block runs."""
    flight, context, link = assembled.flight, assembled.context, assembled.context.link
    loop, guidance_loop = context.loop, context.guidance_loop
    clock = asyncio.get_running_loop().time
    dead_time_watch = assembled.dead_time_watch

    def on_attitude(sample: AttitudeSample) -> None:
        loop.on_sample(sample)
        guidance_loop.note_attitude(sample)
        if loop.offboard_active:
            dead_time_watch.after_setpoint(sample.received)

    state_logger = StateLogger(link.state, flight.note)

    def on_heartbeat(_: object) -> None:
        state_logger.log_changes()
        flight.on_heartbeat()

    def on_current_mode(_: object) -> None:
        state_logger.log_changes()
        flight.on_current_mode()

    def on_attitude_target(message: Message) -> None:
        if loop.offboard_active:
            context.snapshot_builder.echo.add_report(message, clock())

    link.on_attitude = on_attitude
    link.on_error = flight.fail
    on_event, link.clock.on_event = link.clock.on_event, flight.note
    unsubscribers = (
        link.subscribe("HEARTBEAT", on_heartbeat),
        link.subscribe("CURRENT_MODE", on_current_mode),
        link.subscribe("ATTITUDE_TARGET", on_attitude_target),
        link.subscribe_parameters(context.preflight.on_parameter),
    )
    try:
        retuning, recorder = Retuning(loop, guidance_loop), assembled.trace.recorder
        with assembled.changes.applying(retuning, flight.note, recorder):
            yield
    finally:
        link.on_attitude = link.on_error = None
        link.clock.on_event = on_event
        for unsubscribe in unsubscribers:
            unsubscribe()
        state_logger.log_changes()


class StateLogger:
    """Notes each change of mode and arming state, and each text of the autopilot, as an event.

    The first call notes the present mode and arming state, but no text that arrived earlier.

    Args:
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
        last_text, texts = self._last_text, self._state.texts
        new_texts = [*takewhile(lambda text: text is not last_text, reversed(texts))][::-1]
        if new_texts:
            self._last_text = new_texts[-1]
        return new_texts
