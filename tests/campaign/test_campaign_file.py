"""A campaign's file: what it may say, which cases follow, and which sentence refuses it."""

from pathlib import Path

import numpy as np
import pytest

from companion.campaign import estimate, folder, loading, outcomes
from companion.campaign.design import few_samples_warning, planned_cases, seed_of
from companion.campaign.estimate import duration_text
from companion.campaign.swept import SweptValues
from companion.cli.main import main
from companion.files import bounded_yaml
from companion.files.yaml_file import ConfigError

CONFIGS = Path(__file__).parents[2] / "configs"
SHIPPED = sorted((CONFIGS / "campaigns").glob("*.yaml"))


def written(tmp_path, **told):
    path = tmp_path / "campaign.yaml"
    told = {"name": "test", "config": str(CONFIGS / "mock-px4.yaml"), **told}
    path.write_text(bounded_yaml.dump(told))
    return path


def load(tmp_path, **told):
    return loading.load(written(tmp_path, **told))


def row_of(case, result="ok"):
    """The row of a case whose flight took no time."""
    row = {"case": case.index, "seed": case.seed, **case.factors}
    outcome = {"ok": result == "ok", "digest": f"d{case.index}"}
    return row | outcomes.error_outcomes(result) | outcome


def refusal(tmp_path, **told):
    with pytest.raises(ConfigError) as error:
        list(load(tmp_path, **told).cases())
    return str(error.value)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_campaign_has_only_valid_cases(path):
    campaign = loading.load(path)
    assert len(list(campaign.cases())) == campaign.number_of_cases > 100


def test_the_grid_is_flown_with_every_sample(tmp_path):
    campaign = load(
        tmp_path,
        samples=8,
        sampling="latin-hypercube",
        sweep={
            "planner.name": ["exact", "so3"],
            "limits.max_tilt_deg": {"range": [20, 30], "count": 3},
            "mock.wind.speed_m_s": {"uniform": [2, 6]},
            "wrong": {"uniform": [0.5, 1.5], "times_base": True, "keys": ["vehicle.lag_ms"]},
        },
    )
    cases = list(campaign.cases())
    assert len(cases) == campaign.number_of_cases == 2 * 3 * 8
    first = cases[:6]
    assert {(case.config.planner.name, case.config.limits.max_tilt_deg) for case in first} == {
        (name, tilt) for name in ("exact", "so3") for tilt in (20.0, 25.0, 30.0)
    }
    assert len({case.factors["mock.wind.speed_m_s"] for case in first}) == 1
    winds = sorted({case.mock["wind"]["speed_m_s"] for case in cases})
    # A Latin hypercube has one sample in each eighth of the range.
    assert [int((wind - 2.0) / 0.5) for wind in winds] == list(range(8))
    for case in cases:
        assert case.config.vehicle.lag_ms == 74.8 * case.factors["wrong"]
        assert case.mock["wind"]["gust_m_s"] == 0.0  # as it was
        assert case.mock["seed"] == case.seed == seed_of(1, case.index)
    assert len({case.seed for case in cases}) == len(cases)
    again = list(
        load(tmp_path, **campaign.file.model_dump(exclude={"name", "config", "tune"})).cases()
    )
    assert again == cases


def test_points_of_the_grid_may_share_the_seeds_of_a_sample(tmp_path):
    told = {"samples": 3, "same_seeds": True, "sweep": {"planner.name": ["exact", "so3"]}}
    cases = list(load(tmp_path, **told).cases())
    assert [case.seed for case in cases] == [seed_of(1, k // 2) for k in range(6)]


@pytest.mark.parametrize("sampling", ["random", "latin-hypercube", "sobol", "grid"])
def test_distributions_have_their_quantiles(tmp_path, sampling):
    campaign = load(
        tmp_path,
        samples=512 if sampling != "grid" else 24,
        sampling=sampling,
        sweep={
            "mock.wind.speed_m_s": {"normal": [5, 1], "within": [4, 8]},
            "circle.radius_m": {"loguniform": [1, 100]},
        },
    )
    values = [sample.values for sample in planned_cases(campaign.file)]
    winds = np.array([value["mock.wind.speed_m_s"] for value in values])
    radii = np.array([value["circle.radius_m"] for value in values])
    assert winds.min() >= 4.0
    assert winds.max() <= 8.0
    # Of a normal distribution cut at −1 and 3 standard deviations, the median.
    assert np.median(winds) == pytest.approx(5.2, abs=0.1)
    assert np.median(radii) == pytest.approx(10.0, rel=0.25)
    assert 1.0 <= radii.min() < 1.3
    assert 77.0 < radii.max() <= 100.0


def test_choices_come_equally_often():
    swept = SweptValues(choice=("a", "b", "c", "d"))
    assert [swept.quantile(share) for share in (0.0, 0.2499, 0.25, 0.6, 0.9999)] == list("aabcd")


def test_a_preset_and_a_key_of_it_go_together(tmp_path):
    told = {"mock.airframe": "unlike-axes", "mock.airframe.mass_kg": 1.5}
    (case,) = load(tmp_path, set=told).cases()
    assert case.mock["airframe"]["mass_kg"] == 1.5
    assert case.mock["airframe"]["inertia_kg_m2"] == (0.04, 0.03, 0.03)


def test_a_trajectory_comes_along(tmp_path):
    rows = [f"{0.5 * k},{0.2 * k},0,0" for k in range(9)]
    (tmp_path / "table.csv").write_text("\n".join(["t,x,y,z", *rows]))
    (tmp_path / "path.yaml").write_text("csv: {file: table.csv, frame: enu}\n")
    eight = str(CONFIGS / "trajectories/figure8.yaml")
    campaign = load(tmp_path, sweep={"flight.trajectory": ["path.yaml", eight]})
    one, two = campaign.cases()
    assert one.config.flight.maneuvers == ("trajectory",)
    assert one.factors == {"flight.trajectory": "path"}
    assert sorted(one.files) == ["trajectories/path/path.yaml", "trajectories/path/table.csv"]
    assert list(two.files) == ["trajectories/figure8/figure8.yaml"]
    place = tmp_path / "run"
    folder.make(place, campaign, folder.describe(campaign, 1, None))
    (tmp_path / "table.csv").unlink()
    assert list(loading.load(place / folder.CAMPAIGN_FILE_NAME).cases()) == [one, two]


FAULTS = {"gone": {"inject": [{"kind": "gps_los"}]}}


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (
            {"sweep": {"limits.max_tilt_dg": [20]}},
            ("campaign.yaml, line 4: sweep: ", "limits.max_tilt_dg", "`max_tilt_deg`?"),
        ),
        ({"sweep": {"limit.max_tilt_deg": [20]}}, ("`limit`", "`limits`?")),
        ({"sweep": {"mock.wind.speed": [2]}}, ("mock.wind.speed", "speed_m_s?")),
        ({"set": {"mock.parameters.COM_OF_LOS_T": 2}}, ("COM_OF_LOS_T", "COM_OF_LOSS_T?")),
        ({"sweep": {"mock.seed": [2]}}, ("mock.seed", "the campaign sets the key")),
        ({"sweep": {"realtime.scheduler": ["fifo"]}}, ("realtime.scheduler", "no effect")),
        ({"sweep": {"max_tilt_deg": [20]}}, ("SECTION.KEY",)),
        ({"sweeps": {}}, ("`sweeps`", "`sweep`?")),
        ({"sweep": {"limits.max_tilt_deg": {"unifrm": [1, 2]}}}, ("unifrm", "`uniform`?")),
        ({"sweep": {"limits.max_tilt_deg": {"uniform": [30, 20]}}}, ("must be below",)),
        ({"sweep": {"limits.max_tilt_deg": [50, 70]}}, ("case 1 (", "70", "at most 60")),
        ({"sweep": {"limits.max_tilt_deg": [30, "x"]}}, ("case 1 (", "must be a number")),
        ({"sweep": {"mock.airframe.mass_kg": [-1]}}, ("mock.airframe.mass_kg", "more than 0")),
        ({"samples": 6, "sampling": "sobol"}, ("4 or 8",)),
        ({"sweep": {"fault": ["lost"]}}, ("'lost'", "known: none")),
        ({"faults": FAULTS}, ("faults.gone", "gps_los")),
        ({"sweep": {"flight.trajectory": ["no.yaml"]}}, ("no.yaml",)),
        ({"name": "../x"}, ("`name`",)),
        (
            {"sweep": {"thrust.lag_ms": [1, 2]}, "set": {"thrust.lag_ms": 1}},
            ("thrust.lag_ms", "set and in sweep"),
        ),
    ],
)
def test_what_is_wrong_is_said_before_work_begins(tmp_path, told, words):
    said = refusal(tmp_path, **told)
    assert all(word in said for word in words), said
    assert str(tmp_path) in said


def test_too_few_samples_are_said(tmp_path):
    wind = {"mock.wind.speed_m_s": {"uniform": [2, 6]}}
    laws = {"planner.name": {"choice": ["first-order", "exact", "so3"]}}

    def said(samples, sweep):
        return few_samples_warning(load(tmp_path, samples=samples, sweep=sweep).file)

    assert said(1, {**wind, **laws}).startswith(
        "with samples: 1 the campaign flies only one value of mock.wind.speed_m_s, planner.name; "
        "raise samples"
    )
    assert said(2, {**wind, **laws}).startswith(
        "with samples: 2 the campaign flies at most 2 values of planner.name; raise samples"
    )
    assert said(3, {**wind, **laws}) is None
    assert said(1, {"limits.max_tilt_deg": [20, 30]}) is None


def test_too_many_flights_are_refused_with_their_number_and_time(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(estimate, "case_time", lambda _, cases: 2.0 * len(cases))
    path = written(tmp_path, samples=30_000, sweep={"limits.max_tilt_deg": [20, 30]})
    assert main(["campaign", str(path), "--workers", "3", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    # Only one of the cases was measured.
    assert "60000 flights, about 11 h with 3 workers, more than limits.max_cases allows" in said
    assert "raise limits.max_cases, or add --yes" in said
    path = written(tmp_path, samples=1000, sweep={"limits.max_tilt_deg": [20, 30]})
    monkeypatch.setattr(estimate, "case_time", lambda *_: 60.0)
    assert main(["campaign", str(path), "--workers", "3", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "2000 flights, about 11 h with 3 workers, more than limits.max_hours allows (4)" in said
    assert not (tmp_path / "out").exists()


def test_a_configuration_that_is_none_is_refused_in_words(tmp_path):
    assert "`config`: must name a file, or hold the keys of a configuration" in refusal(
        tmp_path, config=5
    )


@pytest.mark.parametrize(
    ("seconds", "told"),
    [(3.14, "3.1 s"), (100.0, "1.7 min"), (123_456.0, "34 h"), (8_640_000.0, "100 days")],
)
def test_a_time_is_told_in_the_largest_unit_that_fits(seconds, told):
    assert duration_text(seconds) == told
