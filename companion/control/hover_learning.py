"""What the hover thrust is learned from: motion, whose thrust it was, and the voltage."""

from companion.attitude import Quaternion
from companion.guidance import GRAVITY, HoverThrust
from companion.guidance.thrust import largest_tilt
from companion.vehicle.state import VehicleState

_CLEAR = 1.0
"""Height above home from which the ground neither carries the vehicle nor helps its rotors, m."""

_THRUST_STALE = 0.3
"""The autopilot tells its thrust at 10 Hz; what is older was not what it flew by, s."""


_WORTH_TELLING = 0.15
"""A configured hover thrust that is off by a larger share of itself is told."""


class HoverLearning:
    """Feeds the hover thrust with telemetry, before we are in control, too.

    While the autopilot itself climbs and holds, ATTITUDE_TARGET tells the thrust it does this with.
    So what the configuration says is put right before the vehicle hangs on it. After our control
    nothing is learned any more.
    """

    def __init__(self, hover_thrust: HoverThrust, state: VehicleState) -> None:
        self._hover_thrust = hover_thrust
        self._state = state
        self._had_control = False

    @property
    def thrust_limits(self) -> tuple[float, float]:
        """Smallest and largest specific thrust there is, as far as is known, m/s²."""
        return self._hover_thrust.smallest, self._hover_thrust.largest

    @property
    def hover(self) -> float:
        """Normalised thrust at hover, as far as is known."""
        return self._hover_thrust.learned

    def largest_tilt(self, acceleration_down: float = 0.0) -> float:
        """Largest tilt at which the thrust there is still gives a vertical acceleration, rad."""
        return largest_tilt(GRAVITY - acceleration_down, self._hover_thrust.largest_tilted)

    def stand(self) -> None:
        """The vehicle stands on the ground."""
        self._hover_thrust.stand()

    def pause(self) -> None:
        """Nothing can be learned just now."""
        self._hover_thrust.pause()

    def step(self, now: float, q: Quaternion, *, offboard_active: bool, steady: bool) -> None:
        """Learn from the newest telemetry.

        Args:
            now: s on our clock.
            q: newest attitude.
            offboard_active: whether the autopilot obeys our setpoints.
            steady: whether our thrust is steady; the rotors run after one that is not.
        """
        battery, position = self._state.battery, self._state.position
        if battery is not None:
            self._hover_thrust.note_voltage(battery.received, battery.voltage_v)
        self._had_control = self._had_control or offboard_active
        learns = (
            steady if offboard_active else not self._had_control and self._note_autopilots(now, q)
        )
        if learns and position is not None:
            self._hover_thrust.observe(position.vehicle_time, position.velocity_ned[2])
        else:
            self._hover_thrust.pause()

    def mismatch_warning(self) -> str | None:
        """In words, where the vehicle hovered at another thrust than the configuration says."""
        configured, learned = self._hover_thrust.configured, self._hover_thrust.learned
        if not self._had_control or abs(learned - configured) <= _WORTH_TELLING * configured:
            return None
        return (
            f"the vehicle hovers at a thrust of {learned:.2f}, and thrust.hover_thrust says "
            f"{configured:.2f}; set it to {learned:.2f}"
        )

    def _note_autopilots(self, now: float, q: Quaternion) -> bool:
        """Note the thrust that the autopilot flies by; False if it is not known or not flown by."""
        told, height = self._state.attitude_target_thrust, self._state.height
        if told is None or now - told.received > _THRUST_STALE:
            return False
        if not self._state.armed or height is None or height < _CLEAR:
            return False
        self._hover_thrust.sent(told.thrust, q)
        return True
