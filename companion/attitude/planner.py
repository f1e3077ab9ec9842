"""The registry of planners: `make_planner` makes a planner by its name."""

from collections.abc import Callable
from math import inf
from typing import Any, Protocol

from companion.attitude.body_error import quaternion, so3
from companion.attitude.euler import euler
from companion.attitude.exact import exact
from companion.attitude.first_order import first_order
from companion.attitude.limits import Constants, Limits, make_constants
from companion.attitude.model_following import ModelFollowingPlanner
from companion.attitude.rate_response import AxisResponse, RateResponse
from companion.attitude.representation import limited_target, normalised
from companion.attitude.types import BodyRates, Quaternion, Target

Law = Callable[[Quaternion, Target, float, Constants], tuple[float, float, float]]
"""A control law on scalars: a unit quaternion, an admissible target, the sample period in s and
the constants → body rates (roll, pitch, yaw) in rad/s.

A batch passes quaternion and target as plain sequences, so a law unpacks them."""


class Planner(Protocol):
    """Turns one attitude sample and the newest target into body rates."""

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """Body rates to send at attitude `q`, rad/s.

        Args:
            q: measured attitude.
            target: target of guidance.
            dt: sample period, s.
            body_rates: measured rates, rad/s; None: unknown.

        Raises:
            AttitudeError: the input cannot be used; nothing is sent for this sample.
        """
        ...

    def note_attitude_target(self, q: Quaternion, age: float) -> None:
        """Take an attitude target (ATTITUDE_TARGET), `age` s older than the newest sample.

        Called only for an autopilot that takes body rates along the axes of this target
        (ArduPilot). Others take them along the axes of the body.
        """
        ...

    def reset(self, q: Quaternion, body_rates: BodyRates | None = None) -> None:
        """Begin a new plan at `q`: after a gap, a change of mode, or a jump of the estimate.

        `body_rates`: measured rates, rad/s; None: unknown.
        """
        ...


class LawPlanner:
    """A planner without memory: checks its input, and applies one law.

    Attributes:
        law: the law on scalars, which a batch compiles (`companion.batch`).
        constants: gains and limits of the law.
    """

    __slots__ = ("_last_target", "_limited_target", "constants", "law")

    def __init__(self, law: Law, constants: Constants) -> None:
        self.law = law
        self.constants = constants
        self._last_target: Target | None = None
        self._limited_target = Target(0.0, 0.0, 0.0)

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """Body rates of the law, rad/s; `dt` is the sample period in s.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidTargetError: `target` is not three or four finite numbers of usable size.
        """
        if target is not self._last_target:  # one target serves many samples; a tuple cannot change
            self._limited_target = limited_target(target, self.constants.longest_target)
            self._last_target = target if isinstance(target, tuple) else None
        rates = self.law(normalised(q), self._limited_target, dt, self.constants)
        return _make_body_rates(BodyRates, rates)

    def retune(self, constants: Constants) -> None:
        """Use other gains and limits from the next sample on."""
        self.constants = constants
        self._last_target = None  # was limited by the constants before

    def note_attitude_target(self, q: Quaternion, age: float) -> None:
        """Do nothing: the law sends rates along the axes of the body."""

    def reset(self, q: Quaternion, body_rates: BodyRates | None = None) -> None:
        """Do nothing: a law has no memory."""


_make_body_rates = tuple.__new__
"""Makes BodyRates from a plain tuple at half the cost of the constructor."""


FIRST_ORDER = "first-order"
MODEL_FOLLOWING = "model-following"

_LAWS: dict[str, Law] = {
    FIRST_ORDER: first_order,
    "exact": exact,
    "quaternion": quaternion,
    "so3": so3,
    "euler": euler,
}

LAW_NAMES = tuple(_LAWS)
"""The planners without memory, which a batch can compile."""
PLANNER_NAMES = (*LAW_NAMES, MODEL_FOLLOWING)


PlannerFactory = Callable[[Constants], Planner]
"""Makes a planner, which unlike a law may have a memory; usually its class."""


def make_planner(
    name: str | Law | type[Planner],
    gain: float = 5.0,
    yaw_gain: float = 2.0,
    limits: Limits = Limits(),  # noqa: B008  (frozen)
    **options: Any,
) -> Planner:
    """Make a planner by its name, or from your own law or class.

    Args:
        name: one of `PLANNER_NAMES`, a function of the type `Law`, or a class of planners that is
            made from `Constants`.
        gain: p in 1/s, the inverse of the wanted time constant.
        yaw_gain: gain of the heading error, 1/s; `quaternion`, `so3` and `euler` use `gain` for
            heading too, as the paper does.
        limits: bounds on tilt and rates.
        options: further options of that planner. Every planner takes `recovery_angle`, rad; without
            `limits.max_tilt` it is also the largest tilt of a target. `model-following` also takes
            the response of the rate loop (`RateResponse`): `lag` and `dead_time`, s (default 0),
            `damping` (default None: first order), `acceleration`, rad/s² (default None: no limit),
            each also with the prefix `pitch_` or `yaw_` (default None: as roll), and `frame_lead`,
            s. There is no `yaw_damping`. With `pitch_lag` and no `pitch_damping`, pitch is of first
            order.

    Raises:
        TypeError: the planner does not take an option.
        ValueError: unknown name, or a value out of range.
    """
    if isinstance(name, type):
        made: PlannerFactory = name
        return made(make_constants(gain, yaw_gain, limits, **options))
    if callable(name):
        return LawPlanner(name, make_constants(gain, yaw_gain, limits, **options))
    if name == MODEL_FOLLOWING:
        return _model_following(gain, yaw_gain, limits, **options)
    if name not in _LAWS:
        raise ValueError(f"unknown planner {name!r}; known: {', '.join(PLANNER_NAMES)}")
    return LawPlanner(_LAWS[name], make_constants(gain, yaw_gain, limits, **options))


def _model_following(
    gain: float,
    yaw_gain: float,
    limits: Limits,
    *,
    lag: float = 0.0,
    dead_time: float = 0.0,
    damping: float | None = None,
    acceleration: float | None = None,
    pitch_lag: float | None = None,
    pitch_dead_time: float | None = None,
    pitch_damping: float | None = None,
    pitch_acceleration: float | None = None,
    yaw_lag: float | None = None,
    yaw_dead_time: float | None = None,
    yaw_acceleration: float | None = None,
    frame_lead: float | None = None,
    **options: Any,
) -> Planner:
    roll = AxisResponse(
        lag,
        dead_time,
        inf if acceleration is None else acceleration,
        inf if damping is None else damping,
    )
    if pitch_damping is None:
        pitch_damping = roll.damping if pitch_lag is None else inf
    response = RateResponse(
        roll,
        _like_roll(roll, pitch_lag, pitch_dead_time, pitch_acceleration, pitch_damping),
        _like_roll(roll, yaw_lag, yaw_dead_time, yaw_acceleration, inf),
        frame_lead,
    )
    return ModelFollowingPlanner(make_constants(gain, yaw_gain, limits, **options), response)


def _like_roll(
    roll: AxisResponse,
    lag: float | None,
    dead_time: float | None,
    acceleration: float | None,
    damping: float,
) -> AxisResponse:
    """An axis with these values; a value that is None is taken from `roll`."""
    return AxisResponse(
        roll.lag if lag is None else lag,
        roll.dead_time if dead_time is None else dead_time,
        roll.acceleration if acceleration is None else acceleration,
        damping,
    )
