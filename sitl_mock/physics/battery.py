"""A battery: charge, current, voltage sag, and the loss of thrust with the voltage."""

from typing import NamedTuple

from sitl_mock.config.airframe import AirframeConfig, BatteryConfig


class BatteryState(NamedTuple):
    """Measurements of a power module."""

    voltage_v: float
    current_a: float
    remaining: float  # charge left, 0..1
    used_as: float = 0.0  # charge drawn since the boot, A s


class Battery:
    """Integrates the current. Voltage = open-circuit voltage (linear in the charge) - R I.

    Attributes:
        state: measurements after the latest step.
        thrust_factor: factor on the thrust of every rotor; 1 with a full battery in a hover.
    """

    def __init__(self, config: BatteryConfig, airframe: AirframeConfig) -> None:
        self._config = config
        self._capacity_as = config.capacity_ah * 3600.0
        self._hover_thrust = airframe.mass_kg * airframe.gravity_m_s2
        self._reference_v = (
            config.cells * config.full_cell_v
            - (config.idle_current_a + config.hover_current_a) * config.resistance_ohm
        )
        self.state = BatteryState(0.0, 0.0, config.initial_remaining)
        self.step(0.0, 0.0)

    def set_remaining(self, remaining: float) -> None:
        """Set the charge to a fraction 0..1 of the capacity."""
        self.state = self.state._replace(remaining=min(max(remaining, 0.0), 1.0))
        self.step(0.0, 0.0, current=self.state.current_a)

    def step(self, thrust: float, dt: float, current: float | None = None) -> None:
        """Draw the current of `thrust` (N), or a given current (A), for `dt` seconds."""
        config = self._config
        if current is None:
            load = thrust / self._hover_thrust
            current = config.idle_current_a + config.hover_current_a * load**1.5
        drawn = current * dt
        remaining = max(0.0, self.state.remaining - drawn / self._capacity_as)
        cell = config.empty_cell_v + (config.full_cell_v - config.empty_cell_v) * remaining
        voltage = max(0.0, config.cells * cell - config.resistance_ohm * current)
        self.state = BatteryState(voltage, current, remaining, self.state.used_as + drawn)
        self.thrust_factor = (voltage / self._reference_v) ** config.thrust_exponent
