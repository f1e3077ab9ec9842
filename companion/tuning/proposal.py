"""Proposes planner gain, guidance weights and observer bandwidth for an identified vehicle."""

from dataclasses import dataclass

from companion.config import Config
from companion.files.yaml_file import ConfigError
from companion.tuning.expectation import Disturbances, Expectation, expectation, stability
from companion.tuning.loop import ModelMismatch
from companion.tuning.margins import Margins
from companion.tuning.search import Aims, Design, search, tolerated_mismatches

_ANALYSED_MANEUVERS = ("hover",)
"""Maneuvers of the analysed flight. In a flight with `identify`, guidance has lower weights."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """A proposed configuration and its expected behaviour."""

    untuned: Config
    """The configuration without the proposed values."""
    tuned: Config
    """The configuration with the proposed values."""
    design: Design
    before: Expectation
    """Expected behaviour of `untuned`."""
    after: Expectation
    """Expected behaviour of `tuned`."""
    margins_with_mismatches: tuple[tuple[ModelMismatch, Margins], ...]
    """Errors of lag and dead time, and the margins of `tuned` with each of these errors."""
    disturbances: Disturbances
    aims: Aims
    """Requirements of the search. The margins without model error are at least 95 % of the required
    margins; the other requirements may be missed by a little."""

    @property
    def changes(self) -> dict[str, dict[str, float]]:
        """The proposed keys by section, in the form for `companion.config.files.changed`.

        A known drag is proposed too, because the analysis assumes the feedforward of this drag.
        """
        design, drag = self.design, self.tuned.guidance.drag
        drag_keys = {}
        if drag is not None:
            drag_keys = {"drag_per_s": drag.linear, "quadratic_drag_per_m": drag.quadratic}
        return {
            "planner": {"gain_per_s": design.gain},
            "guidance": {
                "position_weight_per_s4": design.position_weight,
                "velocity_weight_per_s2": design.velocity_weight,
                "disturbance_bandwidth_rad_s": design.bandwidth,
                **drag_keys,
            },
        }


def propose(
    config: Config, disturbances: Disturbances | None = None, aims: Aims | None = None
) -> Proposal:
    """Propose values with the smallest expected position error within the stability margins.

    Args:
        config: the configuration to tune; `vehicle` must be identified.
        disturbances: disturbances of the vehicle; None: the defaults of `Disturbances`.
        aims: requirements such as the margins to keep; None: the defaults of `Aims`.

    Raises:
        ConfigError: lag and dead time are unknown, the analysis does not support planner or
            guidance, or no values keep the margins.
    """
    if not config.vehicle.response_known:
        raise ConfigError(
            "vehicle.lag_ms and vehicle.dead_time_ms are not known; run `companion identify`, and "
            "tune with the file that it writes"
        )
    disturbances, aims = disturbances or Disturbances(), aims or Aims()
    analysed_flight = config.flight.model_copy(update={"maneuvers": _ANALYSED_MANEUVERS})
    untuned = config.model_copy(update={"flight": analysed_flight})
    before = expectation(untuned, disturbances)
    design = search(untuned, disturbances, aims)
    tuned = design.apply_to(untuned)
    after = expectation(tuned, disturbances)
    reached_margins = after.margins
    # The values are rounded after the search, which costs up to a twentieth of a margin.
    if (
        not reached_margins.stable
        or min(reached_margins.gain_db / aims.gain_db, reached_margins.phase_deg / aims.phase_deg)
        < 0.95
    ):
        raise ConfigError(
            f"no values keep {aims.gain_db:g} dB and {aims.phase_deg:g}° of margin with this "
            "vehicle; check vehicle.lag_ms and vehicle.dead_time_ms"
        )
    margins_with_mismatches = tuple(
        (mismatch, stability(tuned, mismatch)) for mismatch in tolerated_mismatches(tuned, aims)
    )
    return Proposal(
        untuned, tuned, design, before, after, margins_with_mismatches, disturbances, aims
    )
