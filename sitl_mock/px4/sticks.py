"""A pilot's sticks from MANUAL_CONTROL: present or lost, at rest or moving."""

from math import exp, isfinite

from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.link.framing import Message

_MAVLINK_SOURCES = frozenset({1, 2, 3, 5, 6, 7, 8})
"""Values of COM_RC_IN_MODE that accept sticks from MAVLink."""
_FILTER_TIME_S = 0.1
"""Time constant of the low pass on the speed of the sticks, s."""
_FULL_TRAVEL = 1000.0
"""Value of a MANUAL_CONTROL axis at the end of its travel."""


class Sticks:
    """Tracks presence and speed of the sticks.

    Args:
        parameters: COM_RC_IN_MODE, COM_RC_LOSS_T, MAN_OVERRIDE_SPD.
    """

    def __init__(self, parameters: ParameterTable) -> None:
        self._parameters = parameters
        self._last_us: int | None = None
        self._axes: tuple[float, ...] = ()
        self._axis_speeds: tuple[float, ...] = ()

    def receive(self, message: Message, now_us: int) -> None:
        """Handle a MANUAL_CONTROL."""
        if int(self._parameters["COM_RC_IN_MODE"]) not in _MAVLINK_SOURCES:
            return
        axes = tuple(float(axis) / _FULL_TRAVEL for axis in (message.x, message.y, message.r))
        if self.present(now_us) and self._last_us is not None and now_us > self._last_us:
            dt = (now_us - self._last_us) / 1e6
            filter_gain = 1.0 - exp(-dt / _FILTER_TIME_S)
            self._axis_speeds = tuple(
                speed + filter_gain * ((deflection - last_deflection) / dt - speed)
                for speed, deflection, last_deflection in zip(
                    self._axis_speeds, axes, self._axes, strict=True
                )
            )
        else:
            self._axis_speeds = (0.0,) * len(axes)
        self._axes, self._last_us = axes, now_us

    def present(self, now_us: int) -> bool:
        """Whether sticks were received within COM_RC_LOSS_T."""
        timeout_us = self._parameters["COM_RC_LOSS_T"] * 1e6
        return self._last_us is not None and now_us - self._last_us <= timeout_us

    def are_overriding(self, now_us: int) -> bool:
        """Whether a stick moves faster than MAN_OVERRIDE_SPD (half travels/s; negative: never).

        As in PX4, a low pass of 0.1 s filters the speed.
        """
        max_speed = self._parameters["MAN_OVERRIDE_SPD"]
        if max_speed < 0.0 or not isfinite(max_speed) or not self.present(now_us):
            return False
        return any(abs(speed) > max_speed for speed in self._axis_speeds)
