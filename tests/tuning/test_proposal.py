"""What `companion.tuning.propose` proposes: margins, wrong beliefs, and what it refuses."""

from dataclasses import replace
from functools import cache

import pytest
import yaml

from companion.config import Config
from companion.config.files import changed, load, shipped
from companion.files.yaml_file import ConfigError
from companion.tuning import ModelMismatch, propose, stability
from companion.tuning.flights import TrialResult
from companion.tuning.margins import Margins
from companion.tuning.search import largest_gain
from companion.tuning.writing import _mismatch_text, proposal_text, summary_lines


def vehicle(lag, dead_time, slew=None):
    times = {"lag_ms": lag, "dead_time_ms": dead_time, "acceleration_limit_deg_s2": slew}
    return changed(Config(), {"vehicle": times, "guidance": {"drag_per_s": 0.5}}, "test")


VEHICLES = {
    "px4": changed(load(shipped("px4.yaml")), {"guidance": {"drag_per_s": 1.0}}, "test"),
    "ardupilot": load(shipped("ardupilot.yaml")),
    "heavy": vehicle(75.0, 55.0),
    "quick": vehicle(15.0, 10.0),
    "slewing": vehicle(20.0, 15.0, 500.0),
}


@cache
def proposed(name):
    """The proposal for one of these vehicles, searched once."""
    return propose(VEHICLES[name])


@pytest.mark.parametrize("name", ["px4", "ardupilot", "heavy", "quick"])
def test_it_keeps_the_margins_and_expects_a_smaller_error_where_they_were_kept(name):
    proposal = proposed(name)
    assert proposal.after.margins.gain_db >= 6.0
    assert proposal.after.margins.phase_deg >= 30.0
    before = proposal.before.margins
    if before.gain_db >= 6.0 and before.phase_deg >= 30.0:  # not of the heavy one
        assert proposal.after.errors.position < proposal.before.errors.position
    assert proposal.design.gain <= 1.01 * largest_gain(VEHICLES[name])
    for slower in (0.7, 1.3):
        left = stability(proposal.tuned, ModelMismatch(time_factor=slower))
        assert left.stable
        assert left.gain_db >= 2.5
    written = changed(VEHICLES[name], proposal.changes, "test")
    assert written.guidance == proposal.tuned.guidance
    assert written.planner == proposal.tuned.planner


def test_the_margins_are_those_of_a_rate_loop_of_second_order():
    nearer = {"lag_ms": 74.0, "dead_time_ms": 9.0, "damping": 0.73}
    proposal = propose(changed(VEHICLES["px4"], {"vehicle": nearer}, "test"))
    assert proposal.after.margins.gain_db >= 6.0
    assert proposal.after.margins.phase_deg >= 30.0
    assert stability(proposal.tuned, ModelMismatch(time_factor=1.3)).stable
    text = proposal_text(proposal, {"vehicle": nearer}, {}, "a flight")
    assert f"{largest_gain(proposal.tuned):.2f}" in text
    assert yaml.safe_load(text)["vehicle"] == nearer


def test_a_vehicle_that_slews_slowly_gets_a_lower_gain_and_weight():
    quick, slow = propose(vehicle(20.0, 15.0)).design, proposed("slewing").design
    assert slow.gain < 0.9 * quick.gain
    assert slow.position_weight < 0.3 * quick.position_weight
    assert slow.velocity_weight < 0.7 * quick.velocity_weight


def test_an_unknown_vehicle_is_refused():
    with pytest.raises(ConfigError, match="run `companion identify`"):
        propose(Config())


def test_a_planner_of_another_package_is_refused():
    other = VEHICLES["px4"].model_copy(
        update={"planner": VEHICLES["px4"].planner.model_copy(update={"name": "theirs"})}
    )
    with pytest.raises(ConfigError, match=r"planner theirs .* cannot be analysed"):
        propose(other)


def test_margins_of_an_unstable_loop_are_not_told():
    assert Margins(6.0, 30.0, 0.05, True).sentence() == "6.0 dB, 30°, 50 ms of added delay"
    assert Margins(-2.0, -9.0, 0.0, False).sentence() == "unstable"


def test_a_vehicle_without_good_values_is_refused(monkeypatch):
    """The search itself keeps the margins; a vehicle so slow that rounding loses them does not."""
    proposal = proposed("px4")
    monkeypatch.setattr("companion.tuning.proposal.search", lambda *_: proposal.design)
    good = proposal.after
    for margins in (
        good.margins._replace(stable=False),
        good.margins._replace(gain_db=0.94 * 7.0),
        good.margins._replace(phase_deg=0.94 * 31.0),
    ):
        expected = replace(good, margins_at_rate=margins, margins_at_acceleration=margins)
        monkeypatch.setattr("companion.tuning.proposal.expectation", lambda *_, e=expected: e)
        with pytest.raises(ConfigError, match=r"no values keep 7 dB and 31° of margin"):
            propose(VEHICLES["px4"])


def test_flights_stand_in_the_text_with_their_errors_or_their_reasons():
    proposal = proposed("px4")
    before = TrialResult("ok", 0.2, 0.3, 0.1, 0.5, 0.0, 5.0)
    after = TrialResult("ok", 0.1, 0.2, 0.1, 0.5, 0.0, 5.0)
    lines = summary_lines(
        proposal, {"circle": (before, after), "eight": (before, TrialResult("lost"))}
    )
    assert lines[-1] == "eight: ok -> lost"
    assert lines[-2].startswith("circle, flown at up to 5.0 m/s: reported 0.200 -> 0.100, true ")
    assert lines[-3].startswith("Flown on the mock vehicle")


def test_the_reason_of_a_gain_names_what_limits_it():
    def reason(proposal):
        text = proposal_text(proposal, {}, {}, "a flight")
        return next(line for line in text.splitlines() if "was 5; " in line)

    assert "the largest sensible gain, " in reason(propose(vehicle(60.0, 40.0)))
    quick = propose(vehicle(10.0, 5.0))
    capped = replace(quick, design=quick.design._replace(gain=20.0))
    assert "the largest gain that is searched, 20" in reason(capped)
    assert "because the rate loop needs " in reason(proposed("slewing"))


def test_each_error_of_the_model_has_its_words():
    assert _mismatch_text(ModelMismatch(delay=0.02)).startswith("with 20 ms of added delay, as at ")
    assert _mismatch_text(ModelMismatch(time_factor=1.3)) == "with lag and dead time 30 % larger"
    assert _mismatch_text(ModelMismatch(time_factor=0.7)) == "with lag and dead time 30 % smaller"


FLOWN = TrialResult("ok", true=0.134, reported=0.1, speed=5.0)


@pytest.mark.parametrize(
    ("after", "said"),
    [
        (replace(FLOWN, true=0.910), "the circle 0.134 -> 0.910 m"),
        (TrialResult("no attitude"), "the circle no attitude"),
        (replace(FLOWN, true=0.140), None),  # flights differ by that
    ],
)
def test_a_proposal_that_flies_worse_says_so_first(after, said):
    proposal = proposed("px4")
    pair = {"the circle": (FLOWN, after), "the eight": (FLOWN, FLOWN)}
    first = summary_lines(proposal, pair)[0]
    if said is None:
        assert first.startswith("Expected by linear analysis")
    else:
        assert first == f"DO NOT USE THE PROPOSAL: with it the mock vehicle flew worse: {said}"


def test_a_course_that_no_values_fly_to_its_end_is_not_called_worse():
    proposal, lost = proposed("px4"), TrialResult("no attitude")
    opening = "DO NOT USE THE PROPOSAL: with it the mock vehicle "
    first = summary_lines(proposal, {"the circle": (lost, lost), "the eight": (FLOWN, FLOWN)})[0]
    assert first == f"{opening}failed, as it did without the proposal: the circle no attitude"
    first = summary_lines(proposal, {"the circle": (lost, lost), "the eight": (FLOWN, lost)})[0]
    assert first == (
        f"{opening}flew worse: the eight no attitude, and failed, as it did without the proposal: "
        "the circle no attitude"
    )
