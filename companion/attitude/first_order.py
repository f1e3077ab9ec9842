"""`first-order`: Algorithm 1 of the paper, made safe over the whole sphere of attitudes."""

from math import atan2, cos, inf, radians, sin, sqrt

from companion.attitude.errors import InvalidTargetError
from companion.attitude.kinematics import (
    cos_tilt,
    shortest_arc_axis,
    split,
    tilt_rates,
    to_body,
)
from companion.attitude.limits import Limits
from companion.attitude.representation import normalised, wrap_angle
from companion.attitude.types import BodyRates, Quaternion, Target

RECOVERY_ANGLE = radians(75.0)
RECOVERY_BLEND = radians(10.0)


class FirstOrderPlanner:
    """Body rates under which the acceleration coefficients follow ċ = p·(c_d − c).

    Up to the recovery angle this is the paper's law: the coefficients run on a straight line to the
    target, at the same speed at every heading. Its inverse grows as 1/cos(tilt), so beyond that
    angle it is faded, over 10°, into a rotation that brings the thrust axis up along the shortest
    arc at p·tilt; both are inside the rate limit, hence so is every mixture of them. Heading is
    left alone while recovering, for it means nothing upside down.

    Args:
        gain: p, 1/s.
        yaw_gain: proportional gain on the heading error, 1/s.
        limits: bounds; see `Limits`.
        recovery_angle: rad; must lie above `limits.max_tilt` and at most 80°.

    Raises:
        ValueError: a gain or the recovery angle is out of range.
    """

    def __init__(
        self,
        gain: float = 5.0,
        yaw_gain: float = 2.0,
        limits: Limits = Limits(),  # noqa: B008  (frozen)
        recovery_angle: float = RECOVERY_ANGLE,
    ) -> None:
        if not 0.0 < gain < inf:
            raise ValueError(f"gain must be positive and finite, not {gain}")
        if not 0.0 <= yaw_gain < inf:
            raise ValueError(f"yaw_gain must be finite and not negative, not {yaw_gain}")
        if not 0.0 < recovery_angle <= radians(80.0):
            raise ValueError(f"recovery_angle must be in (0, 80°], not {recovery_angle} rad")
        if limits.max_tilt is not None and limits.max_tilt > recovery_angle:
            raise ValueError("max_tilt must not exceed the recovery angle")
        self._gain = gain
        self._yaw_gain = yaw_gain
        self._max_rate = limits.tilt_rate
        self._max_yaw_rate = limits.yaw_rate
        self._longest = sin(recovery_angle if limits.max_tilt is None else limits.max_tilt)
        self._max_coefficient_rate = (
            limits.tilt_rate * cos(limits.max_tilt)
            if limits.shape == "paper" and limits.max_tilt is not None
            else inf
        )
        self._cos_recovery = cos(recovery_angle)
        self._cos_recovered = cos(recovery_angle + RECOVERY_BLEND)

    def rates(
        self,
        q: Quaternion,
        target: Target,
        dt: float,
        body_rates: BodyRates | None = None,
    ) -> BodyRates:
        """Body rates in rad/s that answer attitude `q`.

        Raises:
            InvalidQuaternionError: `q` is not a unit quaternion.
            InvalidTargetError: a value of `target` is not finite.
        """
        w0, x0, y0, z0 = normalised(q)
        a, b, x, y, z = split(w0, x0, y0, z0)
        cosine = cos_tilt(x, y)
        law = 1.0 if cosine >= self._cos_recovery else self._share_of_law(cosine)
        roll = pitch = yaw = 0.0
        if law > 0.0:
            r_x, r_y, r_z = self._tilt_rates(a, x, y, max(cosine, self._cos_recovery), target)
            roll, pitch = to_body(b, z, r_x, r_y)
            yaw = r_z + self._yaw_rate(b, z, target)
        if law < 1.0:
            rate = min(
                self._gain * atan2(sqrt(max(0.0, 1.0 - cosine * cosine)), cosine), self._max_rate
            )
            axis_x, axis_y = shortest_arc_axis(w0, x0, y0, z0)
            roll = law * roll + (1.0 - law) * rate * axis_x
            pitch = law * pitch + (1.0 - law) * rate * axis_y
            yaw = law * yaw
        return BodyRates(roll, pitch, min(max(yaw, -self._max_yaw_rate), self._max_yaw_rate))

    def _tilt_rates(
        self, a: float, x: float, y: float, cosine: float, target: Target
    ) -> tuple[float, float, float]:
        """Algorithm 1 with the target's length, the coefficient rate and the tilt rate limited."""
        length = sqrt(target.north * target.north + target.east * target.east)
        if not length < inf:
            raise InvalidTargetError(f"target coefficients are not finite: {target}")
        scale = self._longest / length if length > self._longest else 1.0
        e_x = self._gain * (scale * target.east - 2.0 * a * x)
        e_y = -self._gain * (scale * target.north + 2.0 * a * y)
        speed = sqrt(e_x * e_x + e_y * e_y)
        if speed > self._max_coefficient_rate:
            e_x *= self._max_coefficient_rate / speed
            e_y *= self._max_coefficient_rate / speed
        r_x, r_y, r_z = tilt_rates(a, x, y, e_x, e_y, cosine)
        rate = sqrt(r_x * r_x + r_y * r_y)
        if rate <= self._max_rate:
            return r_x, r_y, r_z
        scale = self._max_rate / rate
        return scale * r_x, scale * r_y, scale * r_z

    def _yaw_rate(self, b: float, z: float, target: Target) -> float:
        """Heading control on the yaw part alone, the short way round."""
        error = wrap_angle(target.heading - 2.0 * atan2(z, b))
        rate = self._yaw_gain * error + target.heading_rate
        if not -inf < rate < inf:
            raise InvalidTargetError(f"target heading is not finite: {target}")
        return rate

    def _share_of_law(self, cosine: float) -> float:
        """1 at the recovery angle, 0 from 10° beyond it on, smooth between: no jump in rates."""
        ratio = (cosine - self._cos_recovered) / (self._cos_recovery - self._cos_recovered)
        if ratio <= 0.0:
            return 0.0
        return ratio * ratio * (3.0 - 2.0 * ratio)
