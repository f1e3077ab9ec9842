"""Copies the references that a program commands, and checks their numbers.

A program may pass NumPy arrays and go on writing into them, which must not change a command.
"""

from companion.attitude import BodyRates, Coefficients
from companion.guidance.finite import finite_number, finite_vector
from companion.guidance.reference import (
    HorizontalCommand,
    HorizontalMode,
    Reference,
    ThrustCommand,
    TiltCommand,
    VerticalCommand,
    VerticalMode,
)


def checked_copy(reference: Reference) -> Reference:
    """Copy a program's reference into plain floats and tuples, after checking its numbers.

    Raises:
        TypeError: `reference`, its `horizontal` or its `vertical` has a wrong type.
        ValueError: a number is missing or not finite.
    """
    if not isinstance(reference, Reference):
        raise TypeError(f"a reference must be a companion.Reference, not {reference!r}")
    return reference._replace(
        position_ned=finite_vector("position_ned", reference.position_ned),
        velocity_ned=finite_vector("velocity_ned", reference.velocity_ned),
        acceleration_ned=finite_vector("acceleration_ned", reference.acceleration_ned),
        heading=finite_number("heading", reference.heading),
        heading_rate=finite_number("heading_rate", reference.heading_rate),
        horizontal=_copied_horizontal(reference.horizontal),
        vertical=_copied_vertical(reference.vertical),
    )


def _copied_horizontal(command: HorizontalCommand) -> HorizontalCommand:
    if isinstance(command, TiltCommand):
        north, east = command.coefficients
        coefficients = Coefficients(finite_number("north", north), finite_number("east", east))
        return TiltCommand(coefficients, command.trimmed)
    if isinstance(command, BodyRates):
        return BodyRates(*finite_vector("body_rates", command))
    if isinstance(command, HorizontalMode):
        return command
    raise TypeError(
        f"horizontal must be a HorizontalMode, TiltCommand or BodyRates, not {command!r}"
    )


def _copied_vertical(command: VerticalCommand) -> VerticalCommand:
    if isinstance(command, ThrustCommand):
        return ThrustCommand(finite_number("thrust", command.thrust))
    if isinstance(command, VerticalMode):
        return command
    raise TypeError(f"vertical must be a VerticalMode or ThrustCommand, not {command!r}")
