"""ArduCopter's boot: the texts that it sends, and when each part is ready (recorded times)."""

from collections.abc import Callable
from typing import NamedTuple

from sitl_mock.ardupilot.texts import INFO, ArduPilotAnnouncer
from sitl_mock.autopilot.state import State

RECORDED_READY_S = 41.6
"""Recorded time after boot from which the position estimate allows arming in GUIDED, s. `Boot`
scales all recorded times such that this time becomes ``mock.prearm_delay_s``."""
INITIALISED_S = 2.4
"""Time after boot, s, from which the vehicle can be armed with ``force`` and change its mode."""
ORIGIN_SET_S = 20.0
"""Time after boot, s, from which the estimator has an origin."""
HOME_SET_S = 23.5
"""Time after boot, s, from which home is set, so that modes without position can be armed."""
RUNTIME_SENT_PERIOD_US = 30_000_000
"""Period at which STAT_RUNTIME is sent, us."""

_BOOT_TEXTS = (
    (0.16, "RCInput: decoding UDP (Pulses)"),
    (0.28, "Calibrating barometer"),
    (1.87, "Barometer 1 calibration complete"),
    (1.87, "Barometer 2 calibration complete"),
    (INITIALISED_S, "ArduPilot Ready"),
    (INITIALISED_S, "AHRS: DCM active"),
    (2.7, "RC7: SaveWaypoint LOW"),
    (4.4, "EKF3 IMU0 initialised"),
    (4.4, "EKF3 IMU1 initialised"),
    (4.4, "AHRS: EKF3 active"),
    (5.75, "EKF3 IMU0 tilt alignment complete"),
    (5.75, "EKF3 IMU1 tilt alignment complete"),
    (5.85, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    (5.85, "EKF3 IMU1 MAG0 initial yaw alignment complete"),
    (9.76, "GPS 1: probing for u-blox at 230400 baud"),
    (9.78, "GPS 1: detected u-blox"),
    (ORIGIN_SET_S, "EKF3 IMU0 origin set"),
    (ORIGIN_SET_S, "Field Elevation Set: {elevation:.0f}m"),
    (20.2, "EKF3 IMU1 origin set"),
    (RECORDED_READY_S, "EKF3 IMU0 is using GPS"),
    (RECORDED_READY_S, "EKF3 IMU1 is using GPS"),
)
"""(time after boot, s; text that is sent then)."""
_SAVED_PARAMETERS = (
    (0.16, "COMPASS_DEV_ID"),
    (1.87, "BARO1_GND_PRESS"),
    (INITIALISED_S, "INS_GYR_ID"),
)
"""(time after boot, s; parameter that is saved and sent then)."""


class Notifier(NamedTuple):
    """Sends texts, the home position and changed parameters to the clients."""

    announce: ArduPilotAnnouncer
    send_home: Callable[[], None]
    send_parameter: Callable[[str], None]


class Boot:
    """Tracks the progress of the boot.

    Args:
        state: the autopilot's state, which gives the vehicle time.
        ready_us: vehicle time at which the position estimate is good; the other times of the boot
            are scaled with it.
        elevation: elevation of home above sea level, m.
    """

    def __init__(
        self, state: State, notifier: Notifier, *, ready_us: int, elevation: float
    ) -> None:
        self._state = state
        self._notifier = notifier
        self._time_scale = ready_us / (RECORDED_READY_S * 1e6)
        self._elevation = elevation
        self._unsent_texts = list(_BOOT_TEXTS)
        self._unsent_parameters = list(_SAVED_PARAMETERS)
        self._home_sent = False
        self._runtime_due_us = RUNTIME_SENT_PERIOD_US

    def reached(self, recorded_s: float) -> bool:
        """Whether the time ``recorded_s`` of the recorded boot, scaled to this boot, has passed."""
        return self._state.time_us >= recorded_s * self._time_scale * 1e6

    @property
    def initialised(self) -> bool:
        """Whether the autopilot can be armed (with ``force``) and can change its mode."""
        return self.reached(INITIALISED_S)

    @property
    def origin_set(self) -> bool:
        """Whether the estimator has an origin, so that the position of home is known."""
        return self.reached(ORIGIN_SET_S)

    @property
    def home_set(self) -> bool:
        """Whether the pre-arm checks accept home as set."""
        return self.reached(HOME_SET_S)

    def step(self) -> None:
        """Send the texts and messages that are due."""
        notifier = self._notifier
        while self._unsent_parameters and self.reached(self._unsent_parameters[0][0]):
            notifier.send_parameter(self._unsent_parameters.pop(0)[1])
        while self._unsent_texts and self.reached(self._unsent_texts[0][0]):
            text = self._unsent_texts.pop(0)[1]
            notifier.announce.say(text.format(elevation=self._elevation), INFO)
        if self.origin_set and not self._home_sent:
            self._home_sent = True
            notifier.send_home()
        if self._state.time_us >= self._runtime_due_us:
            self._runtime_due_us += RUNTIME_SENT_PERIOD_US
            notifier.send_parameter("STAT_RUNTIME")
