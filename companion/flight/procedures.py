"""What is done in each phase; how long it may take and how it is left stands in `phases`."""

import asyncio
from collections.abc import Callable

from companion.config import Config
from companion.flight.control_loop import ControlLoop
from companion.flight.ending import FlightEnded
from companion.flight.guide import Guide
from companion.flight.roles import Role, mode_name, require_role, role_of
from companion.flight.safety import SafetyMonitors
from companion.guidance import Sequence
from companion.mavlink.link import Link

_POLL = 0.02
"""How often a condition is looked at, s; telemetry that changes it is slower."""

_SETTLING = 1.0
"""Hold in offboard before the programme begins, s: the take-over is not part of it."""


class Procedures:
    """One coroutine a phase; each returns when the phase has reached its end.

    Attributes:
        detail: what the running phase waits for just now, for the user.
        rate_hz: setpoints a second while the programme was flown.
    """

    def __init__(
        self,
        config: Config,
        link: Link,
        loop: ControlLoop,
        guide: Guide,
        monitors: SafetyMonitors,
        programme: Sequence,
    ) -> None:
        self.detail = ""
        self.rate_hz = 0.0
        self._config = config
        self._link = link
        self._loop = loop
        self._guide = guide
        self._monitors = monitors
        self._programme = programme

    async def connect(self) -> None:
        """Wait for the autopilot's heartbeat."""
        self.detail = f"no heartbeat yet on {self._config.link.endpoint}"
        await self._link.wait_connected(self._config.flight.connect_timeout_s)

    async def checks(self) -> None:
        """Ask for the telemetry we fly on, measure what arrives, and wait for readiness."""
        link, config = self._link, self._config
        if link.state.armed:
            raise FlightEnded("the vehicle is already armed; land and disarm it first")
        self.detail = "asking for telemetry"
        wanted = {
            **link.family.wanted_rates,
            "ATTITUDE_QUATERNION": config.link.attitude_rate_hz,
            "LOCAL_POSITION_NED": config.link.position_rate_hz,
        }
        await link.set_rates(wanted, window_s=0.1)
        await self._until(self._ready)
        # Measured only now: a position is not sent before the estimator has one.
        self.detail = "measuring the telemetry that arrives"
        achieved = await link.measure_rates(wanted, 1.0)
        for message, least, key in (
            ("ATTITUDE_QUATERNION", config.link.min_attitude_rate_hz, "min_attitude_rate_hz"),
            ("LOCAL_POSITION_NED", config.link.min_position_rate_hz, "min_position_rate_hz"),
        ):
            if achieved[message] < least:
                raise FlightEnded(
                    f"{message} arrives at {achieved[message]:.0f} Hz, less than "
                    f"link.{key} = {least:g}; raise the link's speed or lower the limit"
                )

    async def stream(self) -> None:
        """Begin to answer samples, idle, and see that setpoints really flow."""
        self._loop.on = True
        enough = self._loop.setpoints + round(self._config.link.min_attitude_rate_hz)
        await self._until(lambda: self._loop.setpoints >= enough, "setpoints to flow")

    async def arm(self) -> None:
        """Arm if we were told to; else wait for the pilot to do it."""
        if self._config.flight.arm:
            self.detail = "the autopilot to accept arming"
            await self._link.command(*self._link.family.arm())
            await self._until(self._armed, "the vehicle to be armed")
        else:
            await self._until(
                self._armed,
                "the pilot to arm (flight.arm is false, and --arm was not given)",
            )

    async def takeoff(self) -> None:
        """Let the autopilot take off, and wait for the height."""
        state, height = self._link.state, self._config.flight.takeoff_height_m
        self.detail = "the autopilot to accept the take-off"
        await self._link.command(*self._link.family.take_off(self._home_altitude() + height))

        def reached() -> bool:
            now = state.height
            self.detail = f"{height:g} m" + ("" if now is None else f", now {now:.1f} m")
            return (
                now is not None
                and now > height - 0.5
                and state.position is not None
                and abs(state.position.velocity_ned[2]) < 0.3
            )

        await self._until(reached)

    async def offboard(self) -> None:
        """Hand control over to our stream, and settle."""
        self._guide.hold_here()
        self._monitors.begin()
        # The mode we know may be a second old; never take the vehicle from a pilot who took it.
        await self._link.request_message("HEARTBEAT")
        require_role(self._link, {Role.TAKEOFF, Role.HOLD})
        self.detail = "the autopilot to enter offboard"
        await self._enter(Role.OFFBOARD)
        await self._until(lambda: self._in(Role.OFFBOARD))
        self._loop.guarded = True
        self._guide.hold_here()
        await asyncio.sleep(_SETTLING)

    async def programme(self) -> None:
        """Fly the programme to its end."""
        began, sent = asyncio.get_running_loop().time(), self._loop.setpoints
        self._guide.follow(self._programme)

        def over() -> bool:
            elapsed = asyncio.get_running_loop().time() - began
            self.rate_hz = (self._loop.setpoints - sent) / elapsed if elapsed > 0.0 else 0.0
            part, _ = self._programme.part_at(elapsed)
            self.detail = f"{part.name}, {elapsed:.0f} of {self._programme.duration:.0f} s flown"
            return self._guide.finished

        await self._until(over)

    async def hand_back(self) -> None:
        """Stop moving, and stream until the autopilot holds by itself."""
        self._guide.hold_here()
        self.detail = "the autopilot to hold"
        await self._enter(Role.HOLD)
        await self._until(lambda: self._in(Role.HOLD))
        self.release()

    async def land(self) -> None:
        """Let the autopilot land; if we still steer, until it has taken over."""
        self.detail = "the autopilot to accept the landing"
        await self._link.command(*self._link.family.land())
        await self._until(lambda: self._in(Role.LAND) or self._link.state.landed)
        self.release()

        def down() -> bool:
            height = self._link.state.height
            self.detail = "touchdown" + ("" if height is None else f", now {height:.1f} m")
            return self._link.state.landed

        await self._until(down)

    async def disarm(self) -> None:
        """Wait for the autopilot to disarm itself; ask it to after a while."""
        self.detail = "the autopilot to disarm itself"
        try:
            async with asyncio.timeout(8.0):
                await self._until(lambda: not self._armed())
        except TimeoutError:
            self.detail = "the autopilot to accept disarming"
            await self._link.command(*self._link.family.disarm())
            await self._until(lambda: not self._armed())

    def release(self) -> None:
        """Stop answering samples: from here on nothing is sent that steers."""
        self._loop.on = False
        self._loop.guarded = False
        self._guide.stand_by()

    async def _enter(self, role: Role) -> None:
        family = self._link.family
        await self._link.command(*family.set_mode(mode_name(family, role)))

    def _home_altitude(self) -> float:
        home = self._link.state.home
        if home is None:
            raise FlightEnded("the autopilot never sent its home position")
        return home.altitude_m

    def _armed(self) -> bool:
        return self._link.state.armed is True

    def _in(self, role: Role) -> bool:
        return role_of(self._link.family, self._link.state.mode) is role

    def _ready(self) -> bool:
        state = self._link.state
        battery = state.battery.remaining if state.battery else None
        least = self._config.limits.min_battery_percent / 100.0
        if battery is not None and battery < least:
            raise FlightEnded(
                f"battery at {100 * battery:.0f} %, below limits.min_battery_percent; charge it"
            )
        missing = self._link.family.not_ready(state.readiness)
        self.detail = missing or ""
        return missing is None

    async def _until(self, condition: Callable[[], bool], detail: str | None = None) -> None:
        if detail is not None:
            self.detail = detail
        while not condition():  # noqa: ASYNC110 - telemetry sets no events
            await asyncio.sleep(_POLL)
