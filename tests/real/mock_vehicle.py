"""The mock vehicle in the place of a real autopilot: the same flights, the same measures.

It flies in memory (`companion.testing`), so its figures do not depend on this computer's load, and
a flight takes a few seconds.
"""

import os
from pathlib import Path

import numpy as np
import yaml

from companion.files.yaml_file import ConfigError
from companion.testing import MockVehicle, UnhandledError, fly
from tests.real.build import ROOT
from tests.real.truth import NoTruthError, Truth, truth_from
from tests.real.vehicle import merged

_WIND = {
    "px4": {"speed_m_s": 3.0, "from_deg": 180.0},
    # SIM_WIND_TURB 1: ArduPilot draws the direction of its horizontal gusts anew in each step of
    # 1/1200 s, so only the vertical ones last, 50 steps.
    "ardupilot": {
        "speed_m_s": 3.0,
        "from_deg": 180.0,
        "vertical_gust_m_s": 1.0,
        "gust_time_s": 0.04,
    },
}
"""The wind that `WIND` of tests/real/vehicle.py makes."""


class FlownInMemory:
    """A flight that is over; it has the interface of `Flight`.

    Args:
        result: what `companion fly --json` would print; empty if the flight could not begin.
        why: why it could not begin.
    """

    def __init__(self, result: dict, why: str = "") -> None:
        self.result = result
        self._why = why

    def finish(self, seconds: float = 0.0) -> dict:
        """Return the summary."""
        return self.result

    def error(self) -> str:
        """Return the reason why it could not begin."""
        return self._why


class MockInMemory:
    """A mock vehicle for each flight.

    Attributes:
        autopilot: px4 or ardupilot, whose rules it has.
        flown: the flights.

    Args:
        autopilot: px4 or ardupilot.
        settings: keys of the mock's section that differ from configs/mock-*.yaml.
    """

    def __init__(self, autopilot: str, settings: dict) -> None:
        self.autopilot = autopilot
        self.flown: list[FlownInMemory] = []
        self._settings = settings
        self._wind: dict = {}
        self._rows: list[tuple[float, ...]] = []

    def face_north(self, flight: FlownInMemory) -> None:
        """Do nothing: it faces north."""

    def blow(self, on: bool) -> None:
        """Wind in the next flight, or none."""
        self._wind = {"wind": _WIND[self.autopilot]} if on else {}

    def launch(self, config: dict, *, command: str = "fly", folder: Path) -> FlownInMemory:
        """Fly to the end; record in `folder`."""
        if command != "fly":
            return self._flew(FlownInMemory({}, f"`{command}` is not flown on the mock vehicle"))
        folder.mkdir(parents=True)
        path = folder / "fly.yaml"
        path.write_text(yaml.safe_dump(config, sort_keys=False))
        try:
            summary = fly(path, self._vehicle(), folder)
        except (ConfigError, UnhandledError) as error:
            return self._flew(FlownInMemory({}, str(error)))
        return self._flew(FlownInMemory({**summary.as_dict(), "log": str(folder)}))

    def truth(self, arrival: float, vehicle_time: float) -> Truth:
        """Return the true motion of the latest flight.

        Raises:
            NoTruthError: there was none.
        """
        rows = np.array(self._rows).reshape(-1, 8)
        if len(rows) < 2:
            raise NoTruthError("the mock vehicle did not fly")
        return truth_from(rows[:, :4], rows[:, [0, 4, 5, 6, 7]])

    def bring_down(self) -> None:
        """Do nothing: the next flight has a vehicle of its own."""

    def load(self) -> str:
        """Return the load of this computer over 1, 5 and 15 minutes."""
        return " ".join(f"{each:.1f}" for each in os.getloadavg())

    def _flew(self, flight: FlownInMemory) -> FlownInMemory:
        self.flown.append(flight)
        return flight

    def _vehicle(self) -> MockVehicle:
        """A vehicle whose telemetry is as irregular as a real one's; each has its own seed."""
        own = {"exact_rates": False, "lockstep": {"enabled": False}, "seed": 1 + len(self.flown)}
        vehicle = MockVehicle(
            config=ROOT / "configs" / f"mock-{self.autopilot}.yaml",
            **merged(self._settings, self._wind | own),
        )
        rows = self._rows = []

        def note() -> None:
            state = vehicle.state()
            rows.append((state["time"], *state["position"], *state["q"]))

        vehicle.after_step.append(note)
        return vehicle
