"""Control by clients: whose setpoints are flown, and the flight that flies them."""

import asyncio
from typing import NamedTuple

from companion.attitude.representation import heading
from companion.config import Config
from companion.flight.assembly import Assembled, assemble
from companion.flight.context import cancel
from companion.flight.environment import Environment
from companion.flight.observer import EventRecorder, Observer
from companion.flight.plan import TakeoverPlan
from companion.flight.wiring import connected
from companion.mavlink.framing import Frame
from companion.mavlink.messages import dialect
from companion.serve.component import Component
from companion.serve.mode_requests import asks_for_control, starves_control
from companion.serve.network.addresses import Address, source_of
from companion.serve.network.client import Client
from companion.serve.ownership import Control, Ownership
from companion.serve.setpoints.approach import UnplannableError
from companion.serve.setpoints.motion import CommandedMotion, MotionLimits
from companion.serve.setpoints.request import RefusedSetpoint, Request
from companion.serve.setpoints.understand import SETPOINTS, Setpoints
from companion.serve.situation import SituationKeeper
from companion.serve.source import ServedSource
from companion.vehicle.autopilot import ControlEntry, Role
from companion.vehicle.link import Link

_ACCEPTED = dialect.MAV_RESULT_ACCEPTED
_IN_PROGRESS = dialect.MAV_RESULT_IN_PROGRESS
_REJECTED = dialect.MAV_RESULT_TEMPORARILY_REJECTED
_PROGRESS_PERIOD = 0.4
"""A client that asked for control is told so often that the takeover goes on, s."""
_TRY_AGAIN = 2.0
"""After a takeover has failed, setpoints alone do not begin another one for this long, s."""
_VALUES_PERIOD = 0.5


class _Owner(NamedTuple):
    """One program of a client, told apart by its address behind the connection."""

    client: Client
    address: Address

    def __str__(self) -> str:
        return f"{self.client.name} ({self.address.system}/{self.address.component})"


class _Asked(NamedTuple):
    """A command that asks for control, and waits for its answer."""

    client: Client
    frame: Frame


class ServedControl:
    """Flies the setpoints of one client at a time; nothing of them is forwarded.

    Args:
        config: of the vehicle and of `serve`.
        link: to the vehicle, open.
        component: answers clients and tells pilots.
        keeper: knows where the vehicle is.
        observer: is told of phases and events of each flight.
        environment: of the flights.
    """

    def __init__(
        self,
        config: Config,
        link: Link,
        component: Component,
        keeper: SituationKeeper,
        observer: Observer,
        environment: Environment,
    ) -> None:
        self._config, self._link, self._component = config, link, component
        self._keeper, self._observer, self._environment = keeper, observer, environment
        self._clock = asyncio.get_running_loop().time
        serve = config.serve
        self.ownership = Ownership(serve.setpoint_timeout, serve.hold_s)
        self._newest: dict[_Owner, Request] = {}
        self._flight: asyncio.Task[None] | None = None
        self._assembled: Assembled | None = None
        self._source: ServedSource | None = None
        self._not_before = 0.0
        settings = link.settings
        self._autopilot = Address(settings.target_system, settings.target_component)
        self._own = Address(settings.source_system, settings.source_component)

    @property
    def in_control(self) -> bool:
        """Whether the autopilot obeys us for a client."""
        assembled = self._assembled
        return assembled is not None and assembled.context.loop.offboard_active

    def intercept(self, client: Client, frame: Frame) -> bool:
        """Whether a client's frame ends here: its setpoints, and its wish for control."""
        if frame.message_id in SETPOINTS:
            self._take_setpoint(client, frame)
            return True
        autopilot = self._link.state.autopilot
        if autopilot is None:
            return False
        if asks_for_control(frame, autopilot):
            self._take_wish(client, frame)
            return True
        if self.in_control and starves_control(frame, self.needed_rates()):
            self._component.acknowledge(client, frame, _ACCEPTED)
            return True
        return False

    async def close(self, reason: str) -> None:
        """Hand the vehicle back, if a client has it, and wait until that is done."""
        if self._flight is None:
            return
        if self._assembled is not None:
            self._assembled.flight.interrupt(reason)
        await asyncio.wait({self._flight})

    def leave(self) -> None:
        """Stop sending setpoints at once."""
        if self._flight is not None:
            self._flight.cancel()

    async def send_values(self) -> None:
        """Send the tracking error and the latency of answers to clients until cancelled."""
        while True:
            await asyncio.sleep(_VALUES_PERIOD)
            assembled = self._assembled
            if assembled is None or not self.in_control:
                continue
            error = assembled.context.guidance_loop.off_course
            if error is not None:
                self._component.value("trk_err_m", error)
            self._component.value("answer_ms", 1e-6 * assembled.trace.newest_latency_ns)

    def needed_rates(self) -> dict[str, float]:
        """Telemetry that control needs, Hz by message name; the autopilot must be known."""
        link = self._config.link
        return {
            **self._link.autopilot.wanted_rates,
            "ATTITUDE_QUATERNION": link.attitude_rate_hz,
            "LOCAL_POSITION_NED": link.position_rate_hz,
        }

    # --- setpoints

    def _take_setpoint(self, client: Client, frame: Frame) -> None:
        autopilot = self._link.state.autopilot
        if autopilot is None:
            self._component.answer(client, "setpoint refused: no autopilot was heard yet")
            return
        situation = self._keeper.situation()
        if situation is None:
            self._component.answer(client, "setpoint refused: the vehicle's position is unknown")
            return
        now, owner = self._clock(), _Owner(client, source_of(frame))
        try:
            setpoints = Setpoints(
                self._autopilot, self._own, body_yaw_is_relative=autopilot.body_yaw_is_relative
            )
            request = setpoints.understand(frame, situation)
            refusal = self.ownership.setpoint(owner, now)
            if refusal is None:
                self._newest = {who: each for who, each in self._newest.items() if who != owner}
                self._newest[owner] = request
                self._fly_request(owner, request, now)
        except (RefusedSetpoint, UnplannableError) as error:
            refusal = str(error)
        if refusal is not None:
            self._component.answer(client, f"setpoint refused: {refusal}")

    def _fly_request(self, owner: _Owner, request: Request, now: float) -> None:
        """Give a request to the flight, or begin one where setpoints alone ask for control."""
        if self._source is not None and self.ownership.owner == owner:
            self._source.give(request, now)
            if self._assembled is not None:
                self._assembled.context.guidance_loop.step_soon()
        elif self._flight is None and self._may_begin(owner, now):
            self._begin(owner, None)

    def _may_begin(self, owner: _Owner, now: float) -> bool:
        """Whether setpoints alone give control: in ArduPilot's GUIDED, in the air."""
        autopilot, state = self._link.autopilot, self._link.state
        if autopilot.control_entry is not ControlEntry.BY_FIRST_SETPOINT or now < self._not_before:
            return False
        if state.mode is None or Role.READY not in autopilot.roles(state.mode):
            return False
        if not state.flying:
            self._component.answer(owner.client, "setpoints are flown in the air: take off first")
            return False
        return self.ownership.ask(owner, now) is None

    # --- control

    def _take_wish(self, client: Client, frame: Frame) -> None:
        """Answer a command that asks for control: by a takeover, or by a refusal."""
        now, address = self._clock(), source_of(frame)
        owner = next(
            (who for who in self._newest if who == _Owner(client, address)),
            # A program may send commands and setpoints under two component ids.
            next((who for who in self._newest if who.client is client), _Owner(client, address)),
        )
        refusal = self.ownership.ask(owner, now)
        if refusal is None and not self._link.state.flying:
            refusal = "take off first: control is taken over in the air"
        if refusal is not None:
            if self._flight is None:
                self.ownership.release()
            self._component.answer(client, f"control refused: {refusal}")
            self._component.acknowledge(client, frame, _REJECTED)
        elif self._flight is None:
            self._begin(owner, _Asked(client, frame))
        else:
            self._component.acknowledge(
                client, frame, _ACCEPTED if self.in_control else _IN_PROGRESS
            )

    def _begin(self, owner: _Owner, asked: _Asked | None) -> None:
        config = self._config
        motion = CommandedMotion(
            MotionLimits(
                config.serve.max_speed_m_s,
                config.serve.max_acceleration_m_s2,
                config.serve.max_jerk_m_s3,
                config.limits.max_climb_m_s,
                config.limits.max_descent_m_s,
                config.limits.max_yaw_rate,
                config.serve.setpoint_timeout,
            )
        )
        self._source = source = ServedSource(str(owner), motion, self.ownership, self._heading)
        source.give(self._newest[owner], self._clock())
        self._flight = asyncio.create_task(self._fly(source, asked))

    async def _fly(self, source: ServedSource, asked: _Asked | None) -> None:
        """Take over, fly the source until it is finished, and hand back."""
        self._assembled = assembled = assemble(
            self._config,
            self._link,
            EventRecorder(self._observer, self._clock, lambda _: None),
            _decline,
            None,
            TakeoverPlan(source),
            self._environment,
        )
        source.resets = assembled.context.loop.resets
        watcher = asyncio.create_task(self._follow_up(source, asked))
        result = "left at once"
        try:
            with connected(self._link, assembled):
                result = await assembled.flight.run()
        finally:
            await cancel(watcher)
            begun = source.pose is not None
            self.ownership.release()
            self._flight = self._assembled = self._source = None
            assembled.close()
            self._tell_end(source, asked, result, begun=begun)

    def _tell_end(
        self, source: ServedSource, asked: _Asked | None, result: str, *, begun: bool
    ) -> None:
        if begun:
            ended = "handed back" if result == "ok" else result
            self._component.tell(f"control by {source.name} has ended: {ended}")
            return
        self._not_before = self._clock() + _TRY_AGAIN
        self._component.tell(f"control was not given to {source.name}: {result}")
        if asked is not None:
            self._component.acknowledge(*asked, _REJECTED)

    async def _follow_up(self, source: ServedSource, asked: _Asked | None) -> None:
        """Tell the client that the takeover goes on, then its end, then each silence."""
        while source.pose is None:
            if asked is not None:
                self._component.acknowledge(*asked, _IN_PROGRESS)
            await asyncio.sleep(_PROGRESS_PERIOD)
        if asked is not None:
            self._component.acknowledge(*asked, _ACCEPTED)
        self._component.tell(f"{source.name} is in control")
        told = Control.LIVE
        while True:
            now = self.ownership.control(self._clock())
            if now is not told and now in (Control.LIVE, Control.HOLDING):
                self._component.tell(f"{source.name}: {now.value}")
                told = now
            await asyncio.sleep(0.05)

    def _heading(self) -> float:
        """The vehicle's heading without the jumps of estimator resets, rad."""
        assert self._assembled is not None
        return heading(self._assembled.context.guidance_loop.attitude())


async def _decline() -> bool:
    return False
