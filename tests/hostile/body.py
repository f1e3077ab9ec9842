"""Where the hostile vehicle is and how it moves: kinematic, just enough to be flown."""

from math import hypot

GRAVITY = 9.81
HOVER_THRUST = 0.5
_RATE_LAG_S, _VELOCITY_LAG_S, _DRAG_PER_S, _LEVELLING_PER_S = 0.03, 0.2, 0.3, 4.0


class Body:
    """A point with an attitude, in a flat world; NED in m and m/s, body FRD in rad/s.

    Attributes:
        position, velocity: NED.
        q: body → world, (w, x, y, z).
        rates: body rates.
        push: an acceleration from outside, NED, m/s².
        impact: speed of the hardest touchdown, m/s.
    """

    def __init__(self):
        self.position, self.velocity = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        self.q, self.rates, self.push = (1.0, 0.0, 0.0, 0.0), [0.0, 0.0, 0.0], (0.0, 0.0, 0.0)
        self.impact = 0.0

    @property
    def height(self):
        return -self.position[2]

    @property
    def in_air(self):
        return self.height > 0.05

    def fly_rates(self, dt, rates, thrust):
        """Obey body rates and a thrust of 0..1."""
        share = dt / _RATE_LAG_S
        self.rates = [now + (to - now) * share for now, to in zip(self.rates, rates, strict=True)]
        self._turn(dt)
        w, x, y, z = self.q
        up = GRAVITY * thrust / HOVER_THRUST
        down_axis = 2 * (w * y + x * z), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)
        for axis, weight in enumerate((0.0, 0.0, GRAVITY)):
            drag = _DRAG_PER_S * self.velocity[axis]
            force = weight - up * down_axis[axis] + self.push[axis] - drag
            self.velocity[axis] += force * dt
        self._move(dt)

    def fly_velocity(self, dt, velocity):
        """Level, and take that velocity: what the autopilot does by itself."""
        w, x, y, z = self.q
        roll, pitch = 2 * (w * x + y * z), 2 * (w * y - x * z)
        self.rates = [-_LEVELLING_PER_S * roll, -_LEVELLING_PER_S * pitch, 0.0]
        self._turn(dt)
        for axis in range(3):
            change = (velocity[axis] - self.velocity[axis]) * dt / _VELOCITY_LAG_S
            self.velocity[axis] += change + self.push[axis] * dt
        self._move(dt)

    def stand(self):
        """Stay where it is."""
        self.velocity, self.rates = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]

    def _turn(self, dt):
        w, x, y, z = self.q
        a, b, c = (0.5 * dt * rate for rate in self.rates)
        turned = (
            w - x * a - y * b - z * c,
            x + w * a + y * c - z * b,
            y + w * b + z * a - x * c,
            z + w * c + x * b - y * a,
        )
        length = hypot(*turned)
        self.q = tuple(value / length for value in turned)

    def _move(self, dt):
        for axis in range(3):
            self.position[axis] += self.velocity[axis] * dt
        if self.position[2] >= 0.0 and self.velocity[2] > 0.0:
            self.impact = max(self.impact, self.velocity[2])
            self.position[2] = 0.0
            self.stand()
