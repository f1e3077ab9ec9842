"""Flat ground at the height of home: touching down and standing."""

from math import cos, exp, radians

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.physics.quaternion import Quaternion, normalise


class Ground:
    """The landing gear's rules: it neither sinks nor slides, and it stands the vehicle up."""

    __slots__ = ("_crash_cosine", "_crash_speed", "_levelling")

    def __init__(self, airframe: AirframeConfig, dt: float) -> None:
        self._crash_cosine = cos(radians(airframe.crash_tilt_deg))
        self._crash_speed = airframe.crash_speed_m_s
        self._levelling = exp(-dt * 1e3 / airframe.ground_levelling_ms)

    def survives(self, q: Quaternion, sink_speed: float) -> bool:
        """Whether touching down like this (m/s, down) leaves the vehicle upright and whole."""
        _, x, y, _ = q
        upright = 1.0 - 2.0 * (x * x + y * y) >= self._crash_cosine
        return upright and sink_speed <= self._crash_speed

    def level(self, q: Quaternion) -> Quaternion:
        """One step of the standing vehicle towards level; the heading stays."""
        w, x, y, z = q
        return normalise((w, x * self._levelling, y * self._levelling, z))
