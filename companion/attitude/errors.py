"""What the attitude core refuses to compute with."""


class AttitudeError(ValueError):
    """The input of a planner cannot be used; the sample must not be answered."""


class InvalidQuaternionError(AttitudeError):
    """A quaternion that is not finite, or whose norm is off by more than 1e-3."""


class InvalidTargetError(AttitudeError):
    """A target that is not numbers, or with a value that is not finite or far too large."""


class InvalidBodyRatesError(AttitudeError):
    """Body rates that are not three numbers."""
