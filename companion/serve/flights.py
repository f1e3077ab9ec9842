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
"""Largest number of hold commands to a vehicle that a client has landed."""


class ServedFlights:
    """Begins the flights. A program is in control (the owner) until its flight ends.

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
        self._hold_tries_left, self._hold_is_commanded = 0, False
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
            if has_begun:
                self._hold_tries_left = _MAX_HOLD_TRIES
            else:
                self._retry_time = self._clock() + _RETRY_PAUSE
            await flight.save()
            if self.current_flight is None and self._vehicle.config.realtime.freeze_gc:
                gc.collect()  # between two flights

    def _finish_before_close(self, task: asyncio.Task[None]) -> None:
        self._unfinished_tasks.add(task)
        task.add_done_callback(self._unfinished_tasks.discard)

    def _leave_offboard(self, _: object) -> None:
        """On a heartbeat, command hold if a client has landed the vehicle and it cannot be armed.

        PX4 returns to OFFBOARD after disarming, because this program chose that mode, and cannot
        be armed in it; see `companion.flight.leave_offboard`. Each try follows a heartbeat: a
        pilot may have changed the mode since the last one.
        """
        link = self._vehicle.link
        if link.state.armed is not False or self.current_flight or self._hold_is_commanded:
            return
        if not in_role(link, Role.OFFBOARD):
            self._hold_tries_left = 0
        if self._hold_tries_left > 0:
            self._hold_is_commanded = True
            self._finish_before_close(asyncio.create_task(self._ask_to_hold()))

    async def _ask_to_hold(self) -> None:
        """Command hold once."""
        link, tell = self._vehicle.link, self._vehicle.component.tell
        mode = link.state.mode
        if self._hold_tries_left == _MAX_HOLD_TRIES:
            tell(disarmed_text(mode))
        self._hold_tries_left -= 1
        try:
            await link.command(*link.autopilot.hold(), retries=0)
            self._hold_tries_left = 0
        except LinkError as error:
            if not isinstance(error, CommandTimeout):
                self._hold_tries_left = 0
            if self._hold_tries_left == 0:
                tell(left_disarmed_text(mode, error))
        finally:
            self._hold_is_commanded = False
