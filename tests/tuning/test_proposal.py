"""What `companion.tuning.propose` proposes: margins, wrong beliefs, and what it refuses."""

from pathlib import Path

import pytest
import yaml

from companion.config import Config
from companion.config.files import changed, load, shipped
from companion.files.yaml_file import ConfigError
from companion.tuning import ModelError, propose, stability
from companion.tuning.search import largest_gain
from companion.tuning.writing import proposal_text


def vehicle(lag, dead_time, slew=None):
    times = {"lag_ms": lag, "dead_time_ms": dead_time, "acceleration_limit_deg_s2": slew}
    return changed(Config(), {"vehicle": times, "guidance": {"drag_per_s": 0.5}}, "test")


VEHICLES = {
    "px4": changed(load(shipped("px4.yaml")), {"guidance": {"drag_per_s": 1.0}}, "test"),
    "ardupilot": load(shipped("ardupilot.yaml")),
    "heavy": vehicle(75.0, 55.0),
    "quick": vehicle(15.0, 10.0),
}


@pytest.mark.parametrize("name", VEHICLES)
def test_it_keeps_the_margins_and_expects_a_smaller_error_where_they_were_kept(name):
    proposal = propose(VEHICLES[name])
    assert proposal.after.margins.gain_db >= 6.0
    assert proposal.after.margins.phase_deg >= 30.0
    before = proposal.before.margins
    if before.gain_db >= 6.0 and before.phase_deg >= 30.0:  # not of the heavy one
        assert proposal.after.errors.position < proposal.before.errors.position
    assert proposal.design.gain <= 1.01 * largest_gain(VEHICLES[name])
    for slower in (0.7, 1.3):
        left = stability(proposal.tuned, ModelError(time_factor=slower))
        assert left.stable
        assert left.gain_db >= 2.5
    written = changed(VEHICLES[name], proposal.changes, "test")
    assert written.guidance == proposal.tuned.guidance
    assert written.planner == proposal.tuned.planner


def test_a_rate_loop_of_second_order_is_proposed_too_and_keeps_the_margins():
    nearer = {"lag_ms": 74.0, "dead_time_ms": 9.0, "damping": 0.73}
    proposal = propose(VEHICLES["px4"], vehicle=nearer)
    assert proposal.after.margins.gain_db >= 6.0
    assert proposal.after.margins.phase_deg >= 30.0
    assert proposal.untuned.vehicle.damping is None
    assert proposal.tuned.vehicle.damping == 0.73
    written = changed(VEHICLES["px4"], proposal.changes, "test")
    assert written.vehicle == proposal.tuned.vehicle
    assert stability(proposal.tuned, ModelError(time_factor=1.3)).stable
    text = proposal_text(proposal, Path("vehicle.yaml"), {}, "a flight")
    assert "second order" in text
    assert f"{largest_gain(proposal.tuned):.2f}" in text  # not that of the configured times
    assert yaml.safe_load(text)["vehicle"] == nearer
    whole = proposal_text(proposal, {"vehicle": {"lag_ms": 74.0}}, {}, "a flight")
    assert yaml.safe_load(whole)["vehicle"] == {"lag_ms": 74.0}


def test_a_vehicle_that_slews_slowly_gets_a_lower_gain_and_weight():
    quick, slow = (propose(vehicle(20.0, 15.0, slew)).design for slew in (None, 500.0))
    assert slow.gain < 0.9 * quick.gain
    assert slow.position < 0.3 * quick.position
    assert slow.position < quick.position


def test_an_unknown_vehicle_is_refused():
    with pytest.raises(ConfigError, match="run `companion identify`"):
        propose(Config())


def test_a_planner_of_another_package_is_refused():
    other = VEHICLES["px4"].model_copy(
        update={"planner": VEHICLES["px4"].planner.model_copy(update={"name": "theirs"})}
    )
    with pytest.raises(ConfigError, match=r"planner theirs .* cannot be analysed"):
        propose(other)
