"""A planner from another package, whose body rates are checked and limited."""

from math import isfinite

from companion.attitude.limits import Limits
from companion.attitude.planner import LawPlanner, Planner
from companion.attitude.rotation import limit_rates
from companion.attitude.types import AttitudeError, BodyRates, Quaternion, Target
from companion.user_code import naming_user_code


class PluginPlanner:
    """Checks the planner of another package and limits its body rates.

    Args:
        limits: limits of the body rates; `max_tilt` is not applied.
    """

    def __init__(self, planner: Planner, limits: Limits) -> None:
        self._planner = planner
        self._user_code = planner.law if isinstance(planner, LawPlanner) else planner
        self._tilt_rate, self._yaw_rate = limits.tilt_rate, limits.yaw_rate

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """The planner's body rates within the limits, rad/s.

        Raises:
            AttitudeError: the planner cannot use this attitude or target, or its rates are not
                finite.
            UserCodeError: the planner raised another error, or did not return three numbers.
        """
        with naming_user_code("planner", self._user_code, AttitudeError):
            roll, pitch, yaw = self._planner.rates(q, target, dt, body_rates)
            finite = isfinite(roll) and isfinite(pitch) and isfinite(yaw)
        if not finite:
            raise AttitudeError(f"the planner returned {(roll, pitch, yaw)}, not finite rates")
        return BodyRates(*limit_rates(roll, pitch, yaw, self._tilt_rate, self._yaw_rate))

    def note_attitude_target(self, q: Quaternion, age: float) -> None:
        """See `Planner.note_attitude_target`; raises UserCodeError if the planner raises."""
        with naming_user_code("planner", self._user_code):
            self._planner.note_attitude_target(q, age)

    def reset(self, q: Quaternion, body_rates: BodyRates | None = None) -> None:
        """See `Planner.reset`; raises UserCodeError if the planner raises."""
        with naming_user_code("planner", self._user_code):
            self._planner.reset(q, body_rates)
