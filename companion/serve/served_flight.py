"""One flight under a client's control: the takeover, the answers to the client, and the end."""

import asyncio
from math import inf
from typing import NamedTuple

from companion.attitude.representation import heading
from companion.config import Config
from companion.flight.assembly import assemble
from companion.flight.changes import Changes
from companion.flight.environment import Environment
from companion.flight.observer import Observer, decline_landing
from companion.flight.plan import TakeoverPlan
from companion.flight.wiring import connected
from companion.guidance.fence import FenceCentre
from companion.mavlink.framing import Frame
from companion.mavlink.messages import dialect
from companion.recording.measurements.summary import Summary
from companion.serve.component import WARNING, Component
from companion.serve.fence_guard import FenceGuard
from companion.serve.flight_records import FlightRecords
from companion.serve.motion_settings import change_refusal, commanded_motion
from companion.serve.network.addresses import Address
from companion.serve.network.client import Client
from companion.serve.ownership import ControlState, Ownership
from companion.serve.setpoints.request import Request
from companion.serve.source import ServedSource
from companion.vehicle.link import Link

ACCEPTED = dialect.MAV_RESULT_ACCEPTED
IN_PROGRESS = dialect.MAV_RESULT_IN_PROGRESS
REJECTED = dialect.MAV_RESULT_TEMPORARILY_REJECTED

_PROGRESS_PERIOD = 0.4
"""Period of progress messages to a client that requested control, s."""
_CHECK_PERIOD = 0.05
_RELEASE_TIME = 2.0
"""Longest time from the owner's command of another mode to the change of mode, s. A change after
this time is attributed to somebody else."""
_VALUES_PERIOD = 0.5


class ControlRequest(NamedTuple):
    """A client's command that requests control, and is not yet answered."""

    client: Client
    frame: Frame


class ServedVehicle(NamedTuple):
    """The vehicle of a session, and the objects that its flights under clients' control share."""

    config: Config
    link: Link
    component: Component
    observer: Observer
    environment: Environment
    records: FlightRecords
    changes: Changes


class ServedFlight:
    """Takes over, flies the requests of the owner, and hands back.

    Args:
        ownership: decides which client's requests are flown, and for how long.
        fence_centre: centre of the fence of an earlier flight; None: the fence is centred where
            control begins.
        from_ground: whether the vehicle stands armed, and takes off first.
    """

    def __init__(
        self,
        name: str,
        vehicle: ServedVehicle,
        ownership: Ownership,
        fence_centre: FenceCentre | None,
        *,
        from_ground: bool,
    ) -> None:
        config, link, component, observer, environment, records, changes = vehicle
        self._records, self._record = records, records.new_record(changes.begin_flight())
        self._summary: Summary | None = None
        self._component, self._ownership = component, ownership
        self._changes, self._clock = changes, asyncio.get_running_loop().time
        self._autopilot = Address(link.settings.target_system, link.settings.target_component)
        self._owner_name, self._release_commanded_at = name, -inf
        self._source = ServedSource(
            name, commanded_motion(changes.wanted_config), ownership, self._heading
        )
        self._assembled = assemble(
            config,
            link,
            self._record.recorder(observer),
            decline_landing,
            self._record.folder,
            TakeoverPlan(self._source, from_ground=from_ground),
            environment,
            changes,
        )
        context = self._assembled.context
        self._source.resets = context.loop.resets
        self._source.fence_guard = FenceGuard(
            changes.wanted_config,
            context.snapshot_builder.fence_centre_without_resets,
            lambda: link.state.height,
            lambda: context.guidance_loop.estimate.disturbance,
            self._tell_alarm,
        )
        context.fence_centre, context.released_by = fence_centre, self._released_by
        ladder = self._assembled.ladder
        self._note_alarm, ladder.note = ladder.note, self._tell_alarm

    @property
    def in_control(self) -> bool:
        """Whether the autopilot obeys the setpoints of this flight."""
        return self._assembled.context.loop.offboard_active

    @property
    def is_ending(self) -> bool:
        """Whether requests are no longer flown: a monitor holds the vehicle, or the flight ends."""
        has_begun = self._source.start_pose is not None
        flown_source = self._assembled.context.guidance_loop.flown_source
        is_replaced = has_begun and flown_source.source is not self._source
        return is_replaced or self._assembled.flight.failed_phase is not None

    @property
    def fence_centre(self) -> FenceCentre | None:
        """Centre of the fence; None before control has begun."""
        has_begun = self._source.start_pose is not None
        return self._assembled.context.snapshot_builder.fence_centre if has_begun else None

    @property
    def tracking_error(self) -> float | None:
        """Distance of the vehicle from the reference, m; None: unknown."""
        return self._assembled.context.guidance_loop.tracking_error

    def give(self, request: Request) -> None:
        """Fly a request, at once if control has begun.

        Raises:
            UnplannableError: no motion fulfils the request; the previous request stays in force.
        """
        self._source.give(request, self._clock())
        self._assembled.context.guidance_loop.step_at_once()

    def expect_release(self) -> None:
        """Note that the owner has just commanded another mode, with which it releases control."""
        self._release_commanded_at = self._clock()

    def interrupt(self, reason: str) -> None:
        """Hand the vehicle back; `reason` is text for the user."""
        self._assembled.flight.interrupt(reason)

    async def run(self, command: ControlRequest | None) -> bool:
        """Fly; answer `command`, if there is one; return whether control had begun."""
        with self._records.recording(self._record), self._changes.checked_by(change_refusal):
            result = "stopped at once"
            self._record.begin_counting(self._assembled.context.link.stats)
            try:
                background = self._answer_and_tell(command), self._send_values()
                async with connected(self._assembled, *background):
                    result = await self._assembled.flight.run()
            finally:
                self._tell_end(command, result)
                self._summary = self._record.summary(
                    self._assembled, result, self._records.realtime_results
                )
        return self._source.start_pose is not None

    async def save(self) -> None:
        """Complete the record, or remove it if control did not begin."""
        if self._summary is None or self._source.start_pose is None:
            await self._records.discard(self._record)
        else:
            await self._records.keep(self._record, self._summary)

    def _released_by(self) -> str:
        """Name of the owner if it has just commanded another mode, else an empty text."""
        is_recent = self._clock() - self._release_commanded_at <= _RELEASE_TIME
        return self._owner_name if is_recent else ""

    def _tell_alarm(self, text: str) -> None:
        self._note_alarm(text)
        self._component.tell(text, WARNING)

    def _tell_end(self, command: ControlRequest | None, result: str) -> None:
        if self._source.start_pose is None:
            reason = self._assembled.flight.end_reason if result == "ok" else result
            self._component.tell(f"control was not given to {self._owner_name}: {reason}")
            self._answer(command, REJECTED)
            return
        if result == "ok":
            was_released = self._assembled.flight.failed_phase is not None
            result = "released by the client" if was_released else "handed back"
        self._component.tell(f"control by {self._owner_name} has ended: {result}")

    async def _answer_and_tell(self, command: ControlRequest | None) -> None:
        """Answer `command` until control begins; then tell clients of each change of control."""
        while self._source.start_pose is None:
            self._answer(command, IN_PROGRESS)
            await asyncio.sleep(_PROGRESS_PERIOD)
        self._answer(command, ACCEPTED)
        reported_owner, reported_state = "", ControlState.LIVE
        while True:
            state = self._ownership.state(self._clock())
            self._owner_name = str(self._ownership.owner or self._owner_name)
            if self._owner_name != reported_owner:  # also if another client replaced a silent owner
                reported_owner, reported_state = self._owner_name, ControlState.LIVE
                self._component.tell(f"{reported_owner} is in control")
            elif state is not reported_state and state in (ControlState.LIVE, ControlState.HOLDING):
                self._component.tell(f"{self._owner_name}: {state.value}")
                reported_state = state
            await asyncio.sleep(_CHECK_PERIOD)

    async def _send_values(self) -> None:
        """Send the tracking error and the latency of setpoints to clients."""
        while True:
            await asyncio.sleep(_VALUES_PERIOD)
            loop, error = self._assembled.context.loop, self.tracking_error
            if loop.offboard_active and error is not None:
                self._component.send_value("trk_err_m", error)
            if loop.offboard_active:
                self._component.send_value("answer_ms", 1e-6 * loop.record.latency_ns)

    def _answer(self, command: ControlRequest | None, result: int) -> None:
        if command is not None:
            self._component.acknowledge(*command, result, self._autopilot)

    def _heading(self) -> float:
        """The vehicle's heading without the jumps of estimator resets, rad."""
        return heading(self._assembled.context.guidance_loop.attitude())
