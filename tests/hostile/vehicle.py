"""The hostile vehicle's autopilot: modes, arming, commands, and how it flies by itself."""

from math import inf

from tests.hostile import personality as kinds
from tests.hostile.body import Body

HOME_ALTITUDE = 100.0
_STREAM_LASTS_S, _CLIMB_M_S, _DESCENT_M_S = 1.0, 2.5, 2.5
_SPOOL_S, _LANDED_AFTER_S, _DISARM_AFTER_S = 0.2, 0.2, 0.4


class Vehicle:
    """One vehicle; what a script may set stands in the attributes.

    Attributes:
        t: vehicle time, s.
        mode: see `personality`.
        armed, critical, healthy: as HEARTBEAT and SYS_STATUS tell them.
        body: where it is.
        setpoint: the newest (rates, thrust) and when it came.
        climbs_to: height of the take-off instead of the one asked for, or None.
        ignores_takeoff: it accepts a take-off and stays on the ground.
        keeps_armed: it does not disarm by itself after a landing.
        descent: speed of a landing, m/s.
    """

    def __init__(self, kind, mode):
        self.kind, self.mode, self.body = kind, mode, Body()
        self.t, self.armed, self.critical, self.healthy = 0.0, False, False, True
        self.setpoint, self.setpoint_at = ((0.0, 0.0, 0.0), 0.0), -inf
        self.climbs_to, self.ignores_takeoff, self.keeps_armed = None, False, False
        self.descent = _DESCENT_M_S
        self._height, self._since, self._down_since = 0.0, 0.0, -inf
        self._land_from, self._lost_stream = mode, False

    # --- what others do

    def enter(self, mode):
        """Change the mode, by whomever."""
        if mode in ("LAND", "RETURN"):
            self._land_from = self.mode
        self.mode, self._since, self._lost_stream = mode, self.t, False

    def arm(self, armed=True):
        self.armed, self._since = armed, self.t

    def take_off(self, height):
        """Begin a take-off."""
        self._height = self.climbs_to or height
        self.enter("TAKEOFF")

    def command(self, message):
        """Do what a COMMAND_LONG asks for; returns the MAV_RESULT."""
        return {
            kinds.ARM: self._on_arm,
            kinds.SET_MODE: self._on_mode,
            kinds.TAKEOFF: self._on_takeoff,
            kinds.LAND: self._on_land,
            kinds.RUN_PREARM_CHECKS: lambda _: kinds.ACCEPTED,
        }.get(message.command, lambda _: kinds.UNSUPPORTED)(message)

    def obey(self, rates, thrust):
        """Take a setpoint, from whomever."""
        self.setpoint, self.setpoint_at = (rates, thrust), self.t
        by_setpoint = self.kind.enters_by_setpoint and self.armed and self.body.in_air
        if self._lost_stream or (by_setpoint and self.mode in ("READY", "TAKEOFF")):
            self.enter("RATES")  # PX4 enters it again while it still is the intended mode

    def _on_arm(self, message):
        if message.param1 < 0.5:
            if self.body.in_air:
                return kinds.TEMPORARILY_REJECTED
            self.arm(False)
            return kinds.ACCEPTED
        if not self.prearm_good:
            return kinds.TEMPORARILY_REJECTED
        self.arm()
        return kinds.ACCEPTED

    def _on_mode(self, message):
        mode = self.kind.mode_asked(message)
        if mode is None or (mode == "RATES" and self.armed and not self._streaming):
            return kinds.TEMPORARILY_REJECTED
        self.enter(mode)
        return kinds.ACCEPTED

    def _on_takeoff(self, message):
        if not self.armed or self.body.in_air:
            return kinds.FAILED
        above = 0.0 if self.kind.enters_by_setpoint else HOME_ALTITUDE
        if not self.ignores_takeoff:
            self.take_off(message.param7 - above)
        return kinds.ACCEPTED

    def _on_land(self, _):
        self.enter("LAND")
        return kinds.ACCEPTED

    # --- what it does by itself

    @property
    def _streaming(self):
        return self.t - self.setpoint_at < _STREAM_LASTS_S

    @property
    def prearm_good(self):
        """SYS_STATUS: whether it can be armed; PX4 disarmed in OFFBOARD can not."""
        left_in_offboard = self.mode == "RATES" and not self.kind.enters_by_setpoint
        return self.healthy and (self.armed or not left_in_offboard)

    @property
    def landed_state(self):
        """MAV_LANDED_STATE."""
        if not self.body.in_air and self.t - self._down_since >= _LANDED_AFTER_S:
            return 1
        return {"TAKEOFF": 3, "LAND": 4}.get(self.mode, 2)

    @property
    def system_status(self):
        """MAV_STATE."""
        return 5 if self.critical else 4 if self.armed else 3

    def step(self, dt):
        """Go on by `dt` s."""
        self.t += dt
        self._fly(dt)
        if self.body.in_air:
            self._down_since = self.t
        landing = self.mode in ("LAND", "RETURN") and self.armed and not self.keeps_armed
        if landing and self.t - self._down_since > _DISARM_AFTER_S:
            self._end_landing()

    def _fly(self, dt):
        if not self.armed:
            if self.body.in_air:
                self.body.fly_rates(dt, (0.0, 0.0, 0.0), 0.0)
        elif self.mode == "RATES":
            self._fly_rates(dt)
        elif self.mode == "TAKEOFF":
            self._climb(dt)
        elif self.mode in ("LAND", "RETURN"):
            self.body.fly_velocity(dt, (0.0, 0.0, self.descent))
        elif self.body.in_air:
            self.body.fly_velocity(dt, (0.0, 0.0, 0.0))

    def _fly_rates(self, dt):
        """Obey the newest setpoint; without a stream do what the parameters above ask for."""
        if self._streaming:
            self.body.fly_rates(dt, *self.setpoint)
            return
        self.body.fly_velocity(dt, (0.0, 0.0, 0.0))
        if not self.kind.enters_by_setpoint and self.armed:
            self.enter("HOLD")
            self.critical = self._lost_stream = True

    def _climb(self, dt):
        if self.t - self._since < _SPOOL_S:
            return
        left = self._height - self.body.height
        self.body.fly_velocity(dt, (0.0, 0.0, -max(-1.0, min(_CLIMB_M_S, 2.0 * left))))
        if abs(left) < 0.1:
            self.enter("READY")

    def _end_landing(self):
        """Disarm; PX4 that landed straight from OFFBOARD is in OFFBOARD again afterwards."""
        self.arm(False)
        self.critical = False
        if not self.kind.enters_by_setpoint:
            self.enter("RATES" if self._land_from == "RATES" else "HOLD")
