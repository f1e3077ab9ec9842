"""Connects the link's callbacks and changes in flight to a flight."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

from companion.control.retuning import Retuning
from companion.flight.assembly import AssembledFlight
from companion.flight.state_logger import StateLogger
from companion.mavlink.messages import Message
from companion.vehicle.link import Link
from companion.vehicle.records import AttitudeSample


@contextmanager
def connected(link: Link, assembled: AssembledFlight) -> Iterator[None]:
    """Connect the link's callbacks, and changes of values, to the flight while the block runs.

    Only one flight at a time may be connected to a link.
    """
    flight, context = assembled.flight, assembled.context
    loop, guidance_loop = context.loop, context.guidance_loop
    time = asyncio.get_running_loop().time
    dead_time_watch = assembled.dead_time_watch

    def on_attitude(sample: AttitudeSample) -> None:
        loop.on_sample(sample)
        guidance_loop.note_attitude(sample)
        if loop.offboard_active:
            dead_time_watch.after_answer(sample.received)

    state_logger = StateLogger(link.state, flight.note)

    def on_heartbeat(_: object) -> None:
        state_logger.log_changes()
        flight.on_heartbeat()

    def on_current_mode(_: object) -> None:
        state_logger.log_changes()
        flight.on_current_mode()

    def on_attitude_target(message: Message) -> None:
        if loop.offboard_active:
            context.snapshot_builder.echo.take(message, time())

    link.on_attitude = on_attitude
    link.on_error = flight.fail
    on_event, link.clock.on_event = link.clock.on_event, flight.note
    unsubscribers = (
        link.subscribe("HEARTBEAT", on_heartbeat),
        link.subscribe("CURRENT_MODE", on_current_mode),
        link.subscribe("ATTITUDE_TARGET", on_attitude_target),
    )
    try:
        retuning, record = Retuning(loop, guidance_loop), assembled.trace.recorder
        with assembled.changes.applied_by(retuning, flight.note, record):
            yield
    finally:
        link.on_attitude = link.on_error = None
        link.clock.on_event = on_event
        for unsubscribe in unsubscribers:
            unsubscribe()
        state_logger.log_changes()
