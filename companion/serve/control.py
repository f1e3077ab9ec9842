"""Control by clients: which client's setpoints are flown, and requests for control."""

import asyncio
import gc

from companion.config import Config
from companion.flight.changes import Changes
from companion.flight.environment import Environment
from companion.flight.observer import Observer
from companion.mavlink.framing import Frame
from companion.preflight.session import wanted_rates
from companion.serve import refusals
from companion.serve.component import Component
from companion.serve.flight_records import FlightRecords
from companion.serve.kept_fence import KeptFence
from companion.serve.mode_requests import (
    asks_for_control,
    leaves_control,
    reduces_telemetry,
    steers_in_our_mode,
)
from companion.serve.network.addresses import Address, source_of, target_of
from companion.serve.network.client import Client
from companion.serve.ownership import Ownership
from companion.serve.programs import Program, Programs
from companion.serve.served_flight import (
    ACCEPTED,
    IN_PROGRESS,
    REJECTED,
    ControlRequest,
    ServedFlight,
)
from companion.serve.setpoints.approach import UnplannableError
from companion.serve.setpoints.request import RefusedSetpoint, Request
from companion.serve.setpoints.understand import SETPOINTS, decode_setpoint
from companion.serve.situation import SituationKeeper
from companion.vehicle.autopilot import ControlEntry, Role
from companion.vehicle.link import Link

_RETRY_PAUSE = 2.0
"""Time after a failed takeover during which setpoints alone do not begin another takeover, s."""


class ServedControl:
    """Flies the setpoints of one client at a time; no client's setpoints are forwarded.

    Args:
        config: configuration of the vehicle and of `serve`.
        link: open link to the vehicle.
        component: sends answers to clients and texts to pilots.
        keeper: keeps track of the vehicle's position.
        observer: receives phases and events of each flight.
        environment: environment of the flights.
        records: makes the records of the flights.
        changes: changes of configuration values in flight.
    """

    def __init__(
        self,
        config: Config,
        link: Link,
        component: Component,
        keeper: SituationKeeper,
        observer: Observer,
        environment: Environment,
        records: FlightRecords,
        changes: Changes,
    ) -> None:
        self._config, self._link, self._component = config, link, component
        self._keeper, self._observer, self._environment = keeper, observer, environment
        self._clock, self._retry_time = asyncio.get_running_loop().time, 0.0
        self._records, self._changes = records, changes
        self.ownership = Ownership(config.serve.setpoint_timeout, config.serve.hold_s)
        self._programs, self._fence = Programs(), KeptFence(config, link)
        self._flight: ServedFlight | None = None
        self._task: asyncio.Task[None] | None = None
        self._unfinished: set[asyncio.Task[None]] = set()
        ids = link.settings
        self._autopilot = Address(ids.target_system, ids.target_component)
        self._targets = self._autopilot, Address(ids.source_system, ids.source_component)

    @property
    def in_control(self) -> bool:
        """Whether the autopilot obeys setpoints that this program sends for a client."""
        return self._flight is not None and self._flight.in_control

    @property
    def tracking_error(self) -> float | None:
        """Distance of the vehicle from its reference, m; None: unknown."""
        return None if self._flight is None else self._flight.tracking_error

    def intercept(self, client: Client, frame: Frame) -> bool:
        """Handle a client's frame, such as a setpoint; return whether it must not be forwarded."""
        if frame.message_id in SETPOINTS:
            self._take_setpoint(client, frame)
            return True
        autopilot = self._link.state.autopilot
        if autopilot is None:
            return False
        for_autopilot = target_of(frame).component in (0, self._autopilot.component)
        if for_autopilot and asks_for_control(frame, autopilot):
            self._take_control_request(client, frame)
            return True
        flight, owner = self._flight, self.ownership.owner
        if flight is None:
            return False
        if steers_in_our_mode(frame, autopilot):
            self._component.answer(client, f"refused: {owner} is in control; change the mode first")
            self._component.acknowledge(client, frame, REJECTED, self._autopilot)
        elif reduces_telemetry(frame, wanted_rates(self._config, self._link)):
            self._component.acknowledge(client, frame, ACCEPTED, self._autopilot)
        else:
            if isinstance(owner, Program) and owner.client is client and leaves_control(frame):
                flight.expect_release()
            return False
        return True

    async def close(self, reason: str) -> None:
        """Hand the vehicle back if a client has it; wait until that is done and recorded."""
        if self._flight is not None:
            self._flight.interrupt(reason)
        if self._unfinished:
            await asyncio.wait(self._unfinished)

    def leave(self) -> None:
        """Stop sending setpoints at once."""
        if self._task is not None:
            self._task.cancel()

    def _take_setpoint(self, client: Client, frame: Frame) -> None:
        autopilot, situation = self._link.state.autopilot, self._keeper.situation()
        if autopilot is None:
            self._component.answer(client, "setpoint refused: no autopilot was heard yet")
            return
        if situation is None:
            self._component.answer(client, "setpoint refused: position or attitude is unknown")
            return
        now, owner = self._clock(), Program(client, source_of(frame))
        owner_before = self.ownership.owner
        try:
            request = decode_setpoint(
                frame, situation, self._targets, body_yaw_is_relative=autopilot.body_yaw_is_relative
            )
            refusal = self.ownership.note_setpoint(owner, now)
            if refusal is None:
                refusal = self._fly_request(owner, request, now)
        except RefusedSetpoint as error:
            refusal = str(error)
        except UnplannableError as error:
            self.ownership.withdraw(owner, owner_before)
            refusal = str(error)
        if refusal is not None:
            self._component.answer(client, f"setpoint refused: {refusal}")

    def _fly_request(self, owner: Program, request: Request, now: float) -> str | None:
        """Pass a request to the flight, or begin a flight; return why it is refused, or None.

        Raises:
            UnplannableError: no motion leads to the request; the previous one stays in force.
        """
        flight = self._flight
        if flight is not None and not flight.is_ending and self.ownership.owner == owner:
            flight.give(request)
        self._programs.keep(owner, request)
        if flight is not None and flight.is_ending:
            return refusals.ENDING
        if self._flight is None and self._give_control(owner, now):
            self._begin_flight(owner, request, None, from_ground=False)
        return None

    def _give_control(self, program: Program, now: float) -> bool:
        """Give control if setpoints alone begin a flight; return whether `program` has control.

        They begin one only in the air, in ArduPilot's GUIDED. A refused program gets the reason.
        """
        autopilot, state = self._link.autopilot, self._link.state
        if autopilot.control_entry is not ControlEntry.BY_FIRST_SETPOINT or now < self._retry_time:
            return False
        if state.mode is None or Role.READY not in autopilot.roles(state.mode):
            return False
        if not state.flying:
            self._component.answer(program.client, refusals.ON_GROUND)
            return False
        if not self.ownership.has_stream(program, now):
            return False
        refusal = self._fence.refusal() or self.ownership.request_control(program, now)
        if refusal is not None:
            self._component.answer(program.client, f"control refused: {refusal}")
        return refusal is None

    def _take_control_request(self, client: Client, frame: Frame) -> None:
        """Answer a command that requests control: by a takeover or a refusal."""
        now, owner = self._clock(), self._programs.sender_of(client, frame)
        request, on_ground = self._programs.newest(owner), not self._link.state.flying
        refusal = self.ownership.request_control(owner, now)
        if refusal is None and self._flight is not None:
            refusal = refusals.ENDING if self._flight.is_ending else None
        elif refusal is None:
            refusal = self._fence.refusal() if request is not None else refusals.FORGOTTEN
            if refusal is None and request is not None and on_ground:
                refusal = self._keeper.takeoff_refusal(request)
        result = ACCEPTED if self.in_control else IN_PROGRESS
        if refusal is not None:
            if self._flight is None:
                self.ownership.release()
            self._component.answer(client, f"control refused: {refusal}")
            result = REJECTED
        elif self._flight is None and request is not None:
            command = ControlRequest(client, frame)
            self._begin_flight(owner, request, command, from_ground=on_ground)
            return
        self._component.acknowledge(client, frame, result, self._autopilot)

    def _begin_flight(
        self, owner: Program, request: Request, command: ControlRequest | None, *, from_ground: bool
    ) -> None:
        self._flight = flight = ServedFlight(
            str(owner),
            self._config,
            self._link,
            self._component,
            self.ownership,
            self._observer,
            self._environment,
            self._records,
            self._changes,
            self._fence.centre,
            from_ground=from_ground,
        )
        flight.give(request)
        self._task = task = asyncio.create_task(self._fly(flight, command))
        self._unfinished.add(task)
        task.add_done_callback(self._unfinished.discard)

    async def _fly(self, flight: ServedFlight, command: ControlRequest | None) -> None:
        """Fly, then release control; complete the record, while the next flight may begin."""
        begun = False
        try:
            begun = await flight.run(command)
        finally:
            self.ownership.release()
            self._fence.keep(flight.fence_centre)
            self._flight = self._task = None
            if not begun:
                self._retry_time = self._clock() + _RETRY_PAUSE
            await flight.save()
            if self._flight is None and self._config.realtime.freeze_gc:  # between flights
                gc.collect()
