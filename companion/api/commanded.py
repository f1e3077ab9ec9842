"""Copies what a program commands, and checks its numbers.

A program may pass NumPy arrays and go on writing into them; guidance must not see that.
"""

from companion.attitude import BodyRates, Coefficients
from companion.guidance.finite import finite_number, finite_vector
from companion.guidance.reference import Reference


def copied(reference: Reference) -> Reference:
    """A copy of the reference, with plain floats and tuples.

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
        position_ned=finite_vector("position_ned", reference.position_ned),
        velocity_ned=finite_vector("velocity_ned", reference.velocity_ned),
        acceleration_ned=finite_vector("acceleration_ned", reference.acceleration_ned),
        heading=finite_number("heading", reference.heading),
        heading_rate=finite_number("heading_rate", reference.heading_rate),
        coefficients=None if coefficients is None else _coefficients(coefficients),
        body_rates=None
        if body_rates is None
        else BodyRates(*finite_vector("body_rates", body_rates)),
        thrust=None if thrust is None else finite_number("thrust", thrust),
    )


def _coefficients(coefficients: Coefficients) -> Coefficients:
    north, east = coefficients
    return Coefficients(finite_number("north", north), finite_number("east", east))
