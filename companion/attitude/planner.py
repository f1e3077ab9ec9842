"""The registry of planners: `make_planner` makes a planner by its name."""

from collections.abc import Callable
from math import inf
from typing import Any, Protocol

from companion.attitude.comparison_laws import euler, quaternion, so3
from companion.attitude.exact import exact
from companion.attitude.first_order import first_order
from companion.attitude.limits import Constants, Limits
from companion.attitude.planner_options import constants_of, make_model_following
from companion.attitude.representation import limited_target, normalised, require_period
from companion.attitude.types import BodyRates, Quaternion, Target

Law = Callable[[Quaternion, Target, float, Constants], tuple[float, float, float]]
"""A control law on scalars: a unit quaternion, a target within the limits (`limited_target`), the
sample period in s and the constants → body rates (roll, pitch, yaw) in rad/s.

A batch passes quaternion and target as plain sequences, so a law must unpack them and not use names
such as `target.north`."""


class Planner(Protocol):
    """Turns one attitude sample and the newest target into body rates."""

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """Body rates to send at attitude `q`, rad/s.

        Args:
            q: measured attitude.
            target: target of guidance.
            dt: sample period, s; positive and finite.
            body_rates: measured rates, rad/s; None: unknown.

        Raises:
            AttitudeError: the input cannot be used; nothing is sent for this sample.
        """

    def note_attitude_target(self, q: Quaternion, age: float) -> None:
        """Note an attitude target (ATTITUDE_TARGET), `age` s older than the newest sample.

        Called only for an autopilot that applies body rates along the axes of its attitude target
        (ArduPilot). Other autopilots apply body rates along the axes of the body.
        """

    def reset(self, q: Quaternion, body_rates: BodyRates | None = None) -> None:
        """Begin a new plan at `q`: after a gap, a change of mode, or a jump of the estimate.

        `body_rates`: measured rates, rad/s; None: unknown.
        """


_NO_TARGET = object()
"""Marks that there is no last target. None cannot mark this, because a caller may pass None."""


class LawPlanner:
    """A planner without memory: checks its input, and applies one law.

    Attributes:
        law: the law on scalars, which a batch compiles (`companion.batch`).
        constants: gains and limits of the law.
    """

    def __init__(self, law: Law, constants: Constants) -> None:
        self.law = law
        self.constants = constants
        self._last_target: object = _NO_TARGET
        self._limited_target = Target(0.0, 0.0, 0.0)

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """Body rates of the law, rad/s; `dt` is the sample period, s.

        Raises:
            InvalidPeriodError: `dt` is not positive and finite.
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidTargetError: `target` is not three or four finite numbers of usable size.
        """
        if not 0.0 < dt < inf:  # the check of `require_period`, without the cost of a call
            require_period(dt)
        if target is not self._last_target:  # one target serves many samples; a tuple cannot change
            self._limited_target = limited_target(target, self.constants.max_target_norm)
            self._last_target = target if isinstance(target, tuple) else _NO_TARGET
        rates = self.law(normalised(q), self._limited_target, dt, self.constants)
        return _make_body_rates(BodyRates, rates)

    def retune(self, constants: Constants) -> None:
        """Use other gains and limits from the next sample on."""
        self.constants = constants
        self._last_target = _NO_TARGET  # the old constants limited this target

    def note_attitude_target(self, q: Quaternion, age: float) -> None:
        """Do nothing: only `model-following` uses the attitude target."""

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
            `limits.max_tilt` it is also the largest tilt of a target. `model-following` also needs
            the response of the rate loop (`AxisResponse`): `lag` and `dead_time`, s (0.0 for an
            immediate one). Optional are `damping` (default None: first order), `acceleration`,
            rad/s² (default None: no limit), and `RateLoopResponse.frame_lead`, s. With the prefix
            `pitch_` or `yaw_`, `lag`, `dead_time`, `damping` and `acceleration` can be given for
            that axis (default None: the value of roll); there is no `yaw_damping`. If `pitch_lag`
            is given without `pitch_damping`, pitch is of first order.

    Raises:
        TypeError: the planner does not take an option, the law does not return three numbers, or
            the class lacks a method of `Planner`.
        ValueError: unknown name, a value out of range, or `model-following` without `lag` or
            `dead_time`.
    """
    if isinstance(name, type):
        return _make_from_class(name, constants_of(name.__name__, gain, yaw_gain, limits, options))
    if callable(name):
        law_name = getattr(name, "__name__", repr(name))
        planner = LawPlanner(name, constants_of(law_name, gain, yaw_gain, limits, options))
        _require_three_rates(law_name, planner)
        return planner
    if name == MODEL_FOLLOWING:
        return make_model_following(gain, yaw_gain, limits, **options)
    if name not in _LAWS:
        raise ValueError(f"unknown planner {name!r}; known: {', '.join(PLANNER_NAMES)}")
    return LawPlanner(_LAWS[name], constants_of(name, gain, yaw_gain, limits, options))


def _make_from_class(factory: Callable[[Constants], Planner], constants: Constants) -> Planner:
    """Make a planner of a user's class.

    Raises:
        TypeError: the planner lacks a method of `Planner`.
    """
    planner = factory(constants)
    for method in ("rates", "reset", "note_attitude_target"):
        if not callable(getattr(planner, method, None)):
            raise TypeError(f"{type(planner).__name__} is no planner: it has no method {method}()")
    return planner


def _require_three_rates(name: str, planner: LawPlanner) -> None:
    """Call a user's law once, at level, and check what it returns.

    An error that the law raises here is ignored: it will be raised where the law is used.

    Raises:
        TypeError: the law does not return three numbers.
    """
    level, target = (1.0, 0.0, 0.0, 0.0), Target(0.0, 0.0, 0.0)
    try:
        rates: Any = planner.law(level, target, 0.01, planner.constants)
    except (Exception, SystemExit):
        return
    try:
        roll, pitch, yaw = rates
        float(roll), float(pitch), float(yaw)
    except (TypeError, ValueError):
        raise TypeError(
            f"the law {name!r} returned {rates!r}, not three numbers: roll, pitch and yaw, rad/s"
        ) from None
