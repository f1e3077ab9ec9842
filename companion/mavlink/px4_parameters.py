"""Parameters that matter."""

from companion.mavlink.parameter_rules import ParameterRule

PX4_PARAMETERS: tuple[ParameterRule, ...] = ()
