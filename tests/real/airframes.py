"""Simulated airframes other than the autopilots' own."""

from dataclasses import dataclass, field
from pathlib import Path

from tests.real.build import REAL


@dataclass(frozen=True)
class Airframe:
    """A vehicle, as a simulator's or an autopilot's parameters describe it.

    Attributes:
        px4: parameters of PX4 and of its simulator (SIH).
        ardupilot: parameters of ArduCopter.
        mock: keys of the mock's section.
        estimated: whether it is flown by the autopilot's estimator.
    """

    px4: dict[str, float] = field(default_factory=dict)
    ardupilot: dict[str, float] = field(default_factory=dict)
    mock: dict = field(default_factory=dict)
    estimated: bool = True

    def differs(self, vehicle: str) -> bool:
        """Whether this describes another airframe than the stock one for that vehicle."""
        return bool(self.mock if vehicle.startswith("mock-") else getattr(self, vehicle))

    def arguments(self, autopilot: str, folder: Path) -> list[str]:
        """Of the autopilot's `start`; parameters of ArduPilot go by a file in `folder`."""
        if autopilot == "px4":
            told = {"COM_OBL_RC_ACT": 4} | self.px4
            return [f"PX4_PARAM_{name}={value:g}" for name, value in told.items()]
        path = folder / "airframe.parm"
        told = {"LOG_BITMASK": 176127} | self.ardupilot  # bit 0: the true attitude at 25 Hz
        path.write_text("".join(f"{name} {value:g}\n" for name, value in told.items()))
        return [str(REAL / "ardupilot" / "guided.parm"), str(path)]


AIRFRAMES = {
    "stock": Airframe(),
    # The stock one, flown on the simulator's own state: what is left of an error is not the
    # estimator's.
    "true-state": Airframe(ardupilot={"AHRS_EKF_TYPE": 10}, estimated=False),
    "unlike": Airframe(
        px4={"SIH_MASS": 1.2, "SIH_IXX": 0.04, "SIH_IYY": 0.03, "SIH_KDV": 0.5},
    ),
    "heavy": Airframe(
        px4={"SIH_MASS": 1.4, "SIH_IXX": 0.035, "SIH_IYY": 0.05, "SIH_IZZ": 0.06, "SIH_KDV": 1.5},
    ),
    "soft": Airframe(
        px4={"MC_ROLLRATE_P": 0.09, "MC_PITCHRATE_P": 0.12, "SIH_KDV": 0.8},
    ),
    "soft-copter": Airframe(
        ardupilot={
            "ATC_RAT_RLL_P": 0.08, "ATC_RAT_RLL_I": 0.08, "ATC_RAT_RLL_D": 0.002,
            "ATC_RAT_PIT_P": 0.11, "ATC_RAT_PIT_I": 0.11, "ATC_RAT_PIT_D": 0.003,
        },
    ),
}  # fmt: skip
