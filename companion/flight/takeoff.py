"""The phase in which the autopilot takes off."""

import asyncio
from math import degrees, radians

from companion.attitude import heading
from companion.attitude.representation import wrap_angle
from companion.flight.commands import command_if_ours, in_role, require_role
from companion.flight.context import FlightContext
from companion.preflight.evidence import Stage
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.autopilot import Role

_MAX_HOLDING_CLIMB_SPEED = 0.3
"""Largest vertical speed of a vehicle that keeps its height, m/s."""

MAX_UNDERSHOOT = 0.5
"""A climb may end this far below the commanded height, m."""

MAX_OVERSHOOT = 3.0
"""A climb has failed this far above the commanded height, m; PX4 overshoots by some tenths."""

_ARRIVAL_TIMEOUT = 2.0
"""Time allowed to reach altitude after the mode changed to hold, s; then the climb has failed."""

_SMALLEST_RISE = 0.3
"""Estimated rise up to which a vehicle counts as still on the ground, m: the estimate drifts."""

_TIPPED_TILT = radians(60.0)
"""A vehicle on the ground that tilts more has tipped over, rad; the same limit as in PX4's failure
detector."""

_SHORTEST_LIFT_OFF_TIMEOUT = 10.0
"""Shortest time to leave the ground, s; PX4 needs 4 s. Blocked motors get full thrust meanwhile."""

_SHORTEST_STALL = 0.5
"""A longer time between two checks of the climb is a stall of this program, s."""

_LIFT_OFF_FRACTION = 0.25
"""Part of flight.takeoff_timeout_s allowed to leave the ground: some motors spool up for 10 s."""

_GROUND_FLAG_TIME = 5.0
"""Longest time for which a vehicle at its height may be reported on the ground, s. Its motors may
need some seconds to spool up, and the height may read 1.5 m on the ground."""


def climb_has_ended(context: FlightContext) -> bool:
    """Whether a fresh position shows that the vehicle has ended its take-off or climb."""
    position = context.fresh_position()
    return (
        position is not None
        and abs(position.velocity_ned[2]) < _MAX_HOLDING_CLIMB_SPEED
        and not context.link.state.taking_off
    )


async def takeoff(context: FlightContext) -> None:
    """Let the autopilot take off, and wait for the height."""
    context.replacement_detector.note_arming()
    north, east, _ = (await context.next_position()).position_ned
    await context.preflight.require(Stage.ARMED)
    await context.fresh_heartbeat()
    _require_ground(context)
    context.waiting_for = "the autopilot to accept the take-off"
    height = context.config.flight.takeoff_height_m
    command = context.link.autopilot.take_off(height, _home_altitude(context))
    context.ground.command_takeoff()
    context.loop.drop_command()  # the idle command must not be sent from here on
    context.guidance_loop.step()

    def require_control() -> None:
        # Before each try: a disarmed PX4 stores the command and takes off once armed.
        _require_ground(context)
        context.must_disarm, context.takeoff_position = True, (north, east)

    climb = _Climb(context, height)
    await command_if_ours(context, command, require_control, climb.has_begun)
    await context.until(climb.is_over)


def require_steady_heading(context: FlightContext, jump_on_ground: float = 0.0) -> None:
    """Raise `FlightEnded` if the heading jumped in our take-off more than it may in our control.

    The autopilot holds with the same heading: the sooner it lands, the less far it is carried.
    `jump_on_ground`: jump while the vehicle still stood, rad.
    """
    jump = max(abs(jump_on_ground), abs(context.loop.resets.frame.offset))
    limit = context.config.safety.max_reset_angle
    if context.takeoff_position is not None and jump > limit:
        raise FlightEnded(
            f"not taken over: the estimated heading jumped by {degrees(jump):.0f}° in the "
            f"take-off, more than safety.max_reset_deg = {degrees(limit):g}; check the compass",
            None if context.ground.standing else Exit.LAND,
        )


class _Climb:
    """Watches the autopilot's own take-off."""

    def __init__(self, context: FlightContext, height: float) -> None:
        self._context, self._height = context, height
        self._began = self._last_check = asyncio.get_running_loop().time()
        timeout = _LIFT_OFF_FRACTION * context.config.flight.takeoff_timeout_s
        self._lift_off_timeout = max(_SHORTEST_LIFT_OFF_TIMEOUT, timeout)
        self._mode_before = context.link.state.mode
        self._has_begun = False
        self._hold_began: float | None = None
        self._ground_flag_at_height_since: float | None = None
        self._start_heading = _heading(context)
        motion = context.guidance_loop.motion
        self._start_down = None if motion is None else motion.position_ned[2]

    def has_begun(self) -> bool:
        """Whether the autopilot is in a take-off mode of its own, or the vehicle has lifted off."""
        state = self._context.link.state
        is_taking_off = (
            in_role(self._context.link, Role.TAKEOFF) and state.mode != self._mode_before
        )
        self._has_begun |= is_taking_off
        return is_taking_off or not state.landed

    def is_over(self) -> bool:
        """Whether the height is reached; raise `FlightEnded` if somebody stopped the climb."""
        context, state = self._context, self._context.link.state
        self._leave_out_stall()
        if not context.armed():
            raise FlightEnded(
                "the pilot, the autopilot or another station disarmed the vehicle during the "
                "take-off",
                Exit.RELEASE,
            )
        require_steady_heading(context, self._jump_on_ground())
        height, position = state.height, context.fresh_position()
        if height is None or position is None:
            return False
        context.waiting_for = f"{self._height:g} m, now {height:.1f} m"
        if height > self._height + MAX_OVERSHOOT:
            raise self._jump_failure(height) or FlightEnded(
                f"the vehicle climbed to {height:.1f} m, but flight.takeoff_height_m is "
                f"{self._height:g}"
            )
        self._require_lift_off()
        is_near_height = height > self._height - MAX_UNDERSHOOT
        if not is_near_height and self._was_stopped():
            raise self._jump_failure(height) or FlightEnded(
                f"the pilot, the autopilot or another station stopped the climb at {height:.1f} m",
                Exit.RELEASE,
            )
        if is_near_height and state.landed:
            self._require_leaving_ground(height)
            return False  # a vehicle that stands must not be taken over: the thrust would lift it
        return is_near_height and climb_has_ended(context)

    def _jump_on_ground(self) -> float:
        """Jump of the heading of a vehicle that still stands, rad; there `resets` forgets it."""
        standing = self._context.ground.standing
        return wrap_angle(_heading(self._context) - self._start_heading) if standing else 0.0

    def _leave_out_stall(self) -> None:
        """Let no time count in which this program was stopped: the vehicle may have climbed."""
        now = asyncio.get_running_loop().time()
        since_check, self._last_check = now - self._last_check, now
        if since_check > _SHORTEST_STALL:
            self._began += since_check

    def _was_stopped(self) -> bool:
        """Whether the mode changed from take-off to hold more than `_ARRIVAL_TIMEOUT` ago."""
        now = asyncio.get_running_loop().time()
        if in_role(self._context.link, Role.TAKEOFF):
            self._has_begun, self._hold_began = True, None
        elif self._has_begun and self._hold_began is None:
            self._hold_began = now
        return self._hold_began is not None and now - self._hold_began > _ARRIVAL_TIMEOUT

    def _require_lift_off(self) -> None:
        """Raise `FlightEnded` if the vehicle tips over, or still stands after the time allowed."""
        elapsed = asyncio.get_running_loop().time() - self._began
        climbed_height = self._climbed_height()
        if climbed_height is None or climbed_height >= _SMALLEST_RISE:
            return
        tilt = self._context.tilt()
        if tilt is not None and tilt > _TIPPED_TILT:
            raise FlightEnded(
                f"the vehicle tilts by {degrees(tilt):.0f}° on the ground: it tipped over in the "
                "take-off"
            )
        if elapsed > self._lift_off_timeout:
            raise FlightEnded(
                f"the vehicle has not left the ground {self._lift_off_timeout:g} s after the "
                "take-off was commanded: check motors, propellers, weight and battery; motors that "
                "spool up slowly need a longer flight.takeoff_timeout_s"
            )

    def _climbed_height(self) -> float | None:
        """Climb since the take-off command, m, without jumps of home or of the estimate."""
        motion = self._context.guidance_loop.motion
        if motion is None or self._start_down is None:
            return None
        return self._start_down - motion.position_ned[2]

    def _require_leaving_ground(self, height: float) -> None:
        """Raise `FlightEnded` if, at this height (m), ground contact is reported for too long."""
        now = asyncio.get_running_loop().time()
        if self._ground_flag_at_height_since is None:
            self._ground_flag_at_height_since = now
        if now - self._ground_flag_at_height_since > _GROUND_FLAG_TIME:
            raise FlightEnded(
                f"the height above home is {height:.1f} m, but the autopilot reports that the "
                "vehicle is on the ground: home or the height estimate has jumped",
                Exit.LAND,
            )

    def _jump_failure(self, height: float) -> FlightEnded | None:
        """The end of the flight if `height` (m) is wrong because home or the estimate jumped."""
        climbed_height = self._climbed_height()
        if climbed_height is None:
            return None
        too_low = height < self._height
        if too_low and climbed_height <= self._height - MAX_UNDERSHOOT:
            return None
        if not too_low and climbed_height > self._height + MAX_OVERSHOOT:
            return None
        return FlightEnded(
            f"after a climb of {climbed_height:.1f} m the height above home is {height:.1f} m: "
            "home or the height estimate has jumped",
            Exit.LAND,
        )


def _heading(context: FlightContext) -> float:
    """The estimated heading, rad; 0 before the first attitude."""
    sample = context.loop.resets.newest_attitude
    return 0.0 if sample is None else heading(sample.q)


def _require_ground(context: FlightContext) -> None:
    """Raise `FlightEnded` unless the vehicle stands armed on the ground in a ready mode."""
    state = context.link.state
    require_role(context.link, {Role.READY})
    if not context.armed() or state.flying:
        raise FlightEnded("the vehicle is no longer armed on the ground", Exit.RELEASE)
    if not state.landed:
        raise FlightEnded("the autopilot no longer reports that it is on the ground")


def _home_altitude(context: FlightContext) -> float:
    home = context.link.state.home
    if home is None:
        raise FlightEnded("the autopilot never sent its home position")
    return home.altitude_m
