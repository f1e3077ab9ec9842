"""Setpoints by MAVSDK's offboard plugin."""

from mavsdk.exceptions import MavsdkError
from mavsdk.plugins.offboard import AttitudeRate, Offboard
from mavsdk.system import System

from companion.attitude import BodyRates
from companion.mavsdk_link.deadman import Deadman


class OffboardSetpoints:
    """Body rates and thrust, sent by MAVSDK while they are asked for and not much longer.

    The plugin is not told to start or stop offboard: that would command modes (stop commands
    HOLD), and the flight commands those itself, or leaves them to a pilot who took over. To end
    the repeating the plugin is destroyed, which takes 0.1 ms, as does making it anew.

    Args:
        system: The vehicle as MAVSDK knows it.
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self._plugin: Offboard | None = None
        self._deadman = Deadman(self._destroy_plugin)

    def send(self, rates_deg_s: BodyRates, thrust: float) -> bool:
        """Send now; false if MAVSDK could not.

        Args:
            rates_deg_s: degrees a second about body x, y, z (FRD), finite as float32.
            thrust: Collective thrust, 0..1.
        """
        setpoint = AttitudeRate(*rates_deg_s, thrust)

        def send() -> None:
            if self._plugin is None:
                self._plugin = Offboard(self._system)
            self._plugin.set_attitude_rate(setpoint)

        try:
            self._deadman.sending(send)
        except MavsdkError:
            return False
        return True

    def end(self) -> None:
        """Send nothing more until the next `send`."""
        self._deadman.end()

    def close(self) -> None:
        """Stop for good."""
        self._deadman.close()

    def _destroy_plugin(self) -> None:
        if self._plugin is not None:
            self._plugin.destroy()
            self._plugin = None
