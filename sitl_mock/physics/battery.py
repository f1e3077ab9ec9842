"""A battery: charge, current, voltage sag, and the loss of thrust with the voltage."""

from typing import NamedTuple

from sitl_mock.config.airframe import AirframeConfig, BatteryConfig


class BatteryState(NamedTuple):
    """State of the battery, as a power module measures it."""

    voltage_v: float
    current_a: float
    remaining: float  # remaining charge, 0..1
    used_charge_a_s: float = 0.0  # charge drawn since boot, A s


class Battery:
    """Integrates the current.

    The voltage is the open-circuit voltage, which is linear in the charge, minus the voltage drop
    over the internal resistance.

    Attributes:
        state: measurements after the latest step.
        thrust_factor: factor on the thrust of every rotor; 1 with a full battery in a hover.
    """

    def __init__(self, config: BatteryConfig, airframe: AirframeConfig) -> None:
        self._config = config
        self._capacity_a_s = config.capacity_ah * 3600.0
        self._hover_thrust = airframe.mass_kg * airframe.gravity_m_s2
        self._full_hover_voltage = (
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
            relative_thrust = thrust / self._hover_thrust
            current = config.idle_current_a + config.hover_current_a * relative_thrust**1.5
        charge = current * dt
        remaining = max(0.0, self.state.remaining - charge / self._capacity_a_s)
        cell_voltage = config.empty_cell_v + (config.full_cell_v - config.empty_cell_v) * remaining
        voltage = max(0.0, config.cells * cell_voltage - config.resistance_ohm * current)
        self.state = BatteryState(voltage, current, remaining, self.state.used_charge_a_s + charge)
        self.thrust_factor = (voltage / self._full_hover_voltage) ** config.thrust_exponent
