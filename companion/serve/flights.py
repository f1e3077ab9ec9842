"""The flights under a client's control, one at a time: begins them, and completes their records."""

import asyncio
import gc

from companion.flight.commands import in_role
from companion.flight.leave_offboard import disarmed_text, left_disarmed_text
from companion.mavlink.errors import CommandTimeout, LinkError
from companion.serve.fence_across_flights import FenceAcrossFlights
from companion.serve.ownership import Ownership, Program
from companion.serve.served_flight import ControlRequest, ServedFlight, ServedVehicle
from companion.serve.setpoints.request import Request
from companion.vehicle.autopilot import Role

_RETRY_PAUSE = 2.0
"""Time after a failed takeover during which setpoints alone do not begin another takeover, s."""
_MAX_HOLD_TRIES = 4


class ServedFlights:
    """Begins the flights; the owner's control ends with its flight.

    Attributes:
        ownership: decides which client's requests are flown.
        fence: the fence of all flights until the vehicle is disarmed.
        current_flight: the flight that runs, or None.
    """

    def __init__(self, vehicle: ServedVehicle) -> None:
        config = vehicle.config
        self.ownership = Ownership(config.serve.setpoint_timeout, config.serve.hold_s)
        self.current_flight: ServedFlight | None = None
        self._vehicle, self.fence = vehicle, FenceAcrossFlights(config, vehicle.link)
        self._clock, self._retry_time = asyncio.get_running_loop().time, 0.0
        self._task: asyncio.Task[None] | None = None
        self._unfinished_tasks: set[asyncio.Task[None]] = set()
        self._controlled_since_arming = False
        vehicle.link.subscribe("HEARTBEAT", self._leave_offboard)

    @property
    def in_control(self) -> bool:
        """Whether the autopilot obeys setpoints that this program sends for a client."""
        return self.current_flight is not None and self.current_flight.in_control

    @property
    def may_retry(self) -> bool:
        """Whether setpoints alone may begin a takeover: none has failed within `_RETRY_PAUSE`."""
        return self._clock() >= self._retry_time

    def begin(
        self, owner: Program, request: Request, command: ControlRequest | None, *, from_ground: bool
    ) -> None:
        """Begin a flight.

        `command`: the command that requested control, to be answered; None: setpoints alone
        requested it. `from_ground`: whether the vehicle stands armed, and takes off first.

        Raises:
            UnplannableError: no motion fulfils the request.
        """
        self.current_flight = flight = ServedFlight(
            str(owner), self._vehicle, self.ownership, self.fence.centre, from_ground=from_ground
        )
        flight.give(request)
        self._task = task = asyncio.create_task(self._fly(flight, command))
        self._finish_before_close(task)

    async def close(self, reason: str) -> None:
        """End the flight, if there is one: hand the vehicle back, and complete all records."""
        if self.current_flight is not None:
            self.current_flight.interrupt(reason)
        if self._unfinished_tasks:
            await asyncio.wait(self._unfinished_tasks)

    def leave(self) -> None:
        """Stop sending setpoints at once."""
        if self._task is not None:
            self._task.cancel()

    async def _fly(self, flight: ServedFlight, command: ControlRequest | None) -> None:
        """Fly, then release control; complete the record, while the next flight may begin."""
        has_begun = False
        try:
            has_begun = await flight.run(command)
        finally:
            self.ownership.release()
            self.fence.set_first_centre(flight.fence_centre)
            self.current_flight = self._task = None
            self._controlled_since_arming |= has_begun
            if not has_begun:
                self._retry_time = self._clock() + _RETRY_PAUSE
            await flight.save()
            if self.current_flight is None and self._vehicle.config.realtime.freeze_gc:
                gc.collect()  # between two flights

    def _finish_before_close(self, task: asyncio.Task[None]) -> None:
        self._unfinished_tasks.add(task)
        task.add_done_callback(self._unfinished_tasks.discard)

    def _leave_offboard(self, _: object) -> None:
        """Ask a vehicle that a client has landed to hold, if it could not be armed again.

        PX4 returns to OFFBOARD, because this program chose that mode; see
        `companion.flight.leave_offboard`.
        """
        if self._vehicle.link.state.armed is not False or self.current_flight is not None:
            return
        was_controlled, self._controlled_since_arming = self._controlled_since_arming, False
        if was_controlled and self._is_disarmed_in_offboard():
            self._finish_before_close(asyncio.create_task(self._ask_to_hold()))

    def _is_disarmed_in_offboard(self) -> bool:
        link = self._vehicle.link
        return link.state.armed is False and in_role(link, Role.OFFBOARD)

    async def _ask_to_hold(self) -> None:
        """Command hold until the autopilot answers; not after another station changed the mode."""
        link, tell = self._vehicle.link, self._vehicle.component.tell
        mode = link.state.mode
        tell(disarmed_text(mode))
        for tries_left in reversed(range(_MAX_HOLD_TRIES)):
            try:
                await link.command(*link.autopilot.hold(), retries=0)
                return
            except LinkError as error:
                if not self._is_disarmed_in_offboard():
                    return
                if tries_left == 0 or not isinstance(error, CommandTimeout):
                    tell(left_disarmed_text(mode, error))
                    return
