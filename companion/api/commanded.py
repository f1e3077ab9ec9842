"""What a program commands, as plain numbers of its own.

A program may pass NumPy arrays and go on writing into them; guidance must not see that.
"""

from collections.abc import Iterable
from math import isfinite

from companion.attitude import BodyRates, Coefficients
from companion.guidance.reference import Reference, Vector


def number(name: str, value: float) -> float:
    """A finite number; `name` is the argument in messages.

    Raises:
        ValueError: it is no number, or not finite.
    """
    try:
        plain = float(value)
    except (TypeError, ValueError, OverflowError):
        plain = float("nan")
    if not isfinite(plain) or isinstance(value, str):
        raise ValueError(f"{name} must be a finite number, not {value!r}")
    return plain


def vector(name: str, value: Iterable[float]) -> Vector:
    """Three finite numbers; `name` is the argument in messages.

    Raises:
        ValueError: there are not three, one is no number, or one is not finite.
    """
    try:
        x, y, z = (number(name, component) for component in value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be three finite numbers, not {value!r}") from None
    return x, y, z


def copied(reference: Reference) -> Reference:
    """The reference with plain numbers of its own.

    Raises:
        TypeError: it is no `Reference`.
        ValueError: a number is missing or not finite.
    """
    if not isinstance(reference, Reference):
        raise TypeError(f"a reference is a companion.Reference, not {reference!r}")
    coefficients, body_rates, thrust = (
        reference.coefficients,
        reference.body_rates,
        reference.thrust,
    )
    return reference._replace(
        position_ned=vector("position_ned", reference.position_ned),
        velocity_ned=vector("velocity_ned", reference.velocity_ned),
        acceleration_ned=vector("acceleration_ned", reference.acceleration_ned),
        heading=number("heading", reference.heading),
        heading_rate=number("heading_rate", reference.heading_rate),
        coefficients=None if coefficients is None else _coefficients(coefficients),
        body_rates=None if body_rates is None else BodyRates(*vector("body_rates", body_rates)),
        thrust=None if thrust is None else number("thrust", thrust),
    )


def _coefficients(coefficients: Coefficients) -> Coefficients:
    north, east = coefficients
    return Coefficients(number("north", north), number("east", east))
