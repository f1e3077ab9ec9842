"""Handles the clients' frames that concern control: setpoints, and commands of modes or motions."""

import asyncio

from companion.config import Config
from companion.flight.commands import in_role
from companion.mavlink.framing import Frame
from companion.preflight.session import wanted_rates
from companion.serve.component import Component
from companion.serve.flights import ServedFlights
from companion.serve.mode_requests import (
    asks_for_control,
    leaves_control,
    reduces_telemetry,
    steers_in_our_mode,
)
from companion.serve.network.addresses import Address, source_of, target_of
from companion.serve.network.client import Client
from companion.serve.ownership import NewestRequests, Program
from companion.serve.served_flight import ACCEPTED, IN_PROGRESS, REJECTED, ControlRequest
from companion.serve.setpoints.approach import UnplannableError
from companion.serve.setpoints.decoding import SETPOINT_IDS, decode_setpoint
from companion.serve.setpoints.request import RefusedSetpoint, Request
from companion.serve.vehicle_pose import PoseTracker
from companion.vehicle.autopilot import ControlEntry, Role
from companion.vehicle.link import Link

_FLIGHT_ENDING = (
    "control is ending and the vehicle is held; request control again when it has ended"
)


class ServedControl:
    """Flies the setpoints of one client at a time; no client's setpoints are forwarded."""

    def __init__(
        self,
        config: Config,
        link: Link,
        component: Component,
        pose_tracker: PoseTracker,
        flights: ServedFlights,
    ) -> None:
        self._config, self._link, self._component = config, link, component
        self._pose_tracker = pose_tracker
        self._flights, self._ownership = flights, flights.ownership
        self._clock, self._newest_requests = asyncio.get_running_loop().time, NewestRequests()
        ids = link.settings
        self._autopilot = Address(ids.target_system, ids.target_component)
        self._targets = self._autopilot, Address(ids.source_system, ids.source_component)

    def intercept(self, client: Client, frame: Frame) -> bool:
        """Handle a client's frame, such as a setpoint; return whether it must not be forwarded."""
        if frame.message_id in SETPOINT_IDS:
            self._take_setpoint(client, frame)
            return True
        autopilot = self._link.state.autopilot
        if autopilot is None:
            return False
        for_autopilot = target_of(frame).component in (0, self._autopilot.component)
        if for_autopilot and asks_for_control(frame, autopilot):
            self._take_control_request(client, frame)
            return True
        flight, owner = self._flights.current_flight, self._ownership.owner
        if flight is None:
            return False
        if steers_in_our_mode(frame, autopilot):
            self._component.answer(client, f"refused: {owner} is in control; change the mode first")
            self._component.acknowledge(client, frame, REJECTED, self._autopilot)
        elif reduces_telemetry(frame, wanted_rates(self._config, self._link)):
            self._component.acknowledge(client, frame, ACCEPTED, self._autopilot)
        else:
            if owner is not None and owner.client is client and leaves_control(frame, autopilot):
                flight.expect_release()
            return False
        return True

    def _take_setpoint(self, client: Client, frame: Frame) -> None:
        autopilot, pose = self._link.state.autopilot, self._pose_tracker.pose()
        if autopilot is None:
            self._component.answer(client, "setpoint refused: no autopilot was heard yet")
            return
        if pose is None:
            self._component.answer(client, "setpoint refused: position or attitude is unknown")
            return
        now, owner = self._clock(), Program(client, source_of(frame))
        owner_before = self._ownership.owner
        try:
            request = decode_setpoint(
                frame, pose, self._targets, body_yaw_is_relative=autopilot.body_yaw_is_relative
            )
            refusal = self._ownership.note_setpoint(owner, now)
            if refusal is None:
                refusal = self._fly_request(owner, request, now)
        except RefusedSetpoint as error:
            refusal = str(error)
        except UnplannableError as error:
            self._ownership.withdraw(owner, owner_before)
            refusal = str(error)
        if refusal is not None:
            self._component.answer(client, f"setpoint refused: {refusal}")

    def _fly_request(self, owner: Program, request: Request, now: float) -> str | None:
        """Pass a request to the flight, or begin a flight; return the reason of a refusal, or None.

        Raises:
            UnplannableError: no motion fulfils the request; the previous request stays in force.
        """
        flight = self._flights.current_flight
        if flight is not None and not flight.is_ending and self._ownership.owner == owner:
            flight.give(request)
        self._newest_requests.keep(owner, request)
        if flight is not None and flight.is_ending:
            return _FLIGHT_ENDING
        if flight is None and self._give_control(owner, now):
            self._flights.begin(owner, request, None, from_ground=False)
        return None

    def _give_control(self, program: Program, now: float) -> bool:
        """Give control if setpoints alone begin a flight; return whether `program` has control.

        Setpoints alone begin a flight only in the air, in ArduPilot's GUIDED. A refused program
        gets the reason.
        """
        if self._link.autopilot.control_entry is not ControlEntry.BY_FIRST_SETPOINT:
            return False
        if not self._flights.may_retry:
            return False
        if not in_role(self._link, Role.READY):
            return False
        if not self._link.state.flying:
            self._component.answer(
                program.client, "take off first: setpoints are flown only in the air"
            )
            return False
        if not self._ownership.has_stream(program, now):
            return False
        refusal = self._flights.fence.refusal() or self._ownership.request_control(program, now)
        if refusal is not None:
            self._component.answer(program.client, f"control refused: {refusal}")
        return refusal is None

    def _take_control_request(self, client: Client, frame: Frame) -> None:
        """Answer a command that requests control: take over, or refuse."""
        now, owner = self._clock(), self._newest_requests.sender_of(client, frame)
        flight, on_ground = self._flights.current_flight, not self._link.state.flying
        request = self._newest_requests.get(owner)
        refusal = self._ownership.request_control(owner, now)
        if refusal is None and flight is not None:
            refusal = _FLIGHT_ENDING if flight.is_ending else None
        elif refusal is None and request is None:
            refusal = "too many programs send setpoints, so yours were dropped; stop the others"
        elif refusal is None and request is not None:
            refusal = self._flights.fence.refusal()
            if refusal is None and on_ground:
                refusal = self._pose_tracker.takeoff_refusal(request)
        result = ACCEPTED if self._flights.in_control else IN_PROGRESS
        if refusal is not None:
            if flight is None:
                self._ownership.release()
            self._component.answer(client, f"control refused: {refusal}")
            result = REJECTED
        elif flight is None and request is not None:
            command = ControlRequest(client, frame)
            self._flights.begin(owner, request, command, from_ground=on_ground)
            return
        self._component.acknowledge(client, frame, result, self._autopilot)
