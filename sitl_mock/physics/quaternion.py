"""Quaternion operations: (w, x, y, z), Hamilton product, body to world."""

from math import asin, atan2, cos, pi, sin, sqrt

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def multiply(left: Quaternion, right: Quaternion) -> Quaternion:
    """Hamilton product: the rotation `right`, then `left`, both about world axes."""
    lw, lx, ly, lz = left
    rw, rx, ry, rz = right
    return (
        lw * rw - lx * rx - ly * ry - lz * rz,
        lw * rx + lx * rw + ly * rz - lz * ry,
        lw * ry - lx * rz + ly * rw + lz * rx,
        lw * rz + lx * ry - ly * rx + lz * rw,
    )


def normalise(q: Quaternion) -> Quaternion:
    """The unit quaternion along `q`, which must not be zero."""
    w, x, y, z = q
    scale = 1.0 / sqrt(w * w + x * x + y * y + z * z)
    return (w * scale, x * scale, y * scale, z * scale)


def rotated_slightly(rotation: Vector, q: Quaternion) -> Quaternion:
    """The attitude `q` turned by a small rotation about world axes (rad); not quite of length 1."""
    x, y, z = rotation
    return multiply((1.0, 0.5 * x, 0.5 * y, 0.5 * z), q)


def from_yaw(angle: float) -> Quaternion:
    """A rotation by `angle` (rad) about the down axis."""
    return (cos(0.5 * angle), 0.0, 0.0, sin(0.5 * angle))


def to_body(q: Quaternion, vector_ned: Vector) -> Vector:
    """Return a world vector (NED) in body axes (FRD)."""
    w, x, y, z = q
    n, e, d = vector_ned
    # v' = v + 2 u x (u x v + w v) with the conjugate's u = -(x, y, z)
    tx = 2.0 * (z * e - y * d)
    ty = 2.0 * (x * d - z * n)
    tz = 2.0 * (y * n - x * e)
    return (
        n + w * tx - (y * tz - z * ty),
        e + w * ty - (z * tx - x * tz),
        d + w * tz - (x * ty - y * tx),
    )


def yaw(q: Quaternion) -> float:
    """Euler (Z-Y-X) yaw, rad in (-pi, pi]."""
    w, x, y, z = q
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def heading_to_ned(q: Quaternion, vector: Vector) -> Vector:
    """Convert a vector from the axes of a level body with the yaw of ``q`` to world axes (NED).

    ``vector`` is (forward, right, down).
    A NaN in one horizontal component makes both NaN; a NaN vertical component stays NaN.
    """
    w, _, _, z = from_yaw(yaw(q))
    c, s = w * w - z * z, 2.0 * w * z
    x, y, down = vector
    return (c * x - s * y, s * x + c * y, down)


def euler(q: Quaternion) -> tuple[float, float, float]:
    """Return roll, pitch, yaw (Z-Y-X, rad)."""
    w, x, y, z = q
    roll = atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    sine = 2.0 * (w * y - z * x)
    pitch = asin(sine) if abs(sine) < 1.0 else (pi / 2 if sine > 0 else -pi / 2)
    return roll, pitch, yaw(q)
