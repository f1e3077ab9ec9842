"""Parameters that matter."""

from companion.mavlink.parameter_rules import ParameterRule

ARDUPILOT_PARAMETERS: tuple[ParameterRule, ...] = ()
