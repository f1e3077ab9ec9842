"""A case flown to its row, a campaign run, stopped, gone on with, and a case of it flown again."""

import json
from dataclasses import replace

import pytest

from companion.campaign import flight, folder, running, store, unit
from companion.campaign.case import Fault
from companion.campaign.cluster import ClusterError
from companion.campaign.unit import cases_per_unit, unit_ranges
from companion.campaign.versions import VersionError, difference, require_equal, versions
from companion.cli import flying
from companion.cli.main import main
from companion.config.files import load as load_config
from companion.files import bounded_yaml
from companion.files.yaml_file import ConfigError
from tests.campaign.test_campaign_file import CONFIGS, load, row_of
from tests.flight.fly import LOOP_HZ, QUICK_PARAMETERS

QUICK = {
    "flight.takeoff_height_m": 2.0,
    "flight.maneuvers": ["hover"],
    "hover.duration_s": 1.0,
    "link.attitude_rate_hz": LOOP_HZ,
    "mock.inner_loop_hz": LOOP_HZ,
    "mock.prearm_delay_s": 0.2,
    **{f"mock.parameters.{name}": value for name, value in QUICK_PARAMETERS["px4"].items()},
}


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Two flights of half a circle, in a calm and in wind, and a batch of steps."""
    circle = {**QUICK, "flight.maneuvers": ["circle"], "circle.speed_m_s": 3.0, "circle.laps": 0.5}
    told = {"set": circle, "sweep": {"mock.wind.speed_m_s": [0.0, 5.0]}}
    return load(tmp_path_factory.mktemp("file"), **told)


def test_equal_cases_are_equal_flights_to_the_bit(campaign, tmp_path):
    calm, windy = campaign.cases()
    row, again = flight.fly_case(calm), flight.fly_case(calm, tmp_path / "recorded")
    assert row == again
    assert (tmp_path / "recorded" / "flight.mcap").exists()
    # Its record says which vehicle flew.
    recorded = load_config(tmp_path / "recorded" / "config.yaml")
    assert recorded.mock["seed"] == calm.seed == row["seed"]
    assert windy.config.mock["wind"]["speed_m_s"] == 5.0
    assert row["result"] == "ok"
    assert row["ok"]
    assert row["failed_checks"] == ""
    summary = json.loads((tmp_path / "recorded" / "summary.json").read_text())
    assert row["setpoints"] == summary["setpoints"]
    (maneuver,) = summary["maneuvers"]
    # The estimate is wrong by centimetres, so truth and telemetry differ, but not by more.
    assert row["estimated_rms_m"] == pytest.approx(maneuver["level_rms_m"], abs=0.01)
    assert 0.0 < row["position_rms_m"] < row["position_max_m"] < 0.3
    assert row["position_rms_m"] != row["estimated_rms_m"]
    # On a circle of 3 m at 3 m/s, centripetal acceleration and drag need 24° of tilt.
    assert 0.4 < row["max_tilt_rad"] < 0.6
    assert 0.0 < row["rate_rms_rad_s"] < row["rate_max_rad_s"] < 1.6
    assert row["cross_axis_max"] is None  # no step was flown
    other = flight.fly_case(windy)
    assert other["digest"] != row["digest"]
    assert other["max_tilt_rad"] > row["max_tilt_rad"] + 0.1
    table = store.table(campaign.file, [row, other])
    assert table.schema == store.schema(campaign.file)
    factor = store.metadata(table)["factors"]["mock.wind.speed_m_s"]
    assert (factor["kind"], factor["values"], factor["unit"]) == ("values", [0.0, 5.0], "m/s")
    assert table.to_pylist() == [row, other]


def test_the_virtual_clock_waits_for_the_solver(tmp_path):
    pytest.importorskip("casadi")
    line = tmp_path / "line.yaml"
    limits = {"speed_m_s": 4.0, "acceleration_m_s2": 3.0, "jerk_m_s3": 10.0}
    line.write_text(bounded_yaml.dump({"line": {"to_m": [3.0, 0.0, -1.0], **limits}}))
    told = {"flight.maneuvers": ["trajectory"], "flight.trajectory": str(line)}
    (case,) = load(tmp_path, set={**QUICK, **told, "guidance.kind": "nmpc"}).cases()
    row, again = flight.fly_case(case), flight.fly_case(case, tmp_path / "recorded")
    assert row == again
    assert row["ok"], row["result"]
    predicted = json.loads((tmp_path / "recorded" / "summary.json").read_text())["nmpc"]
    assert predicted["troubles"] == {}
    assert predicted["flown"] > 100


def test_a_fault_begins_in_its_phase_and_its_ending_is_judged(tmp_path):
    (case,) = load(tmp_path, set=QUICK).cases()
    low = ({"kind": "low_battery", "remaining": 0.15},)
    landed = flight.fly_case(replace(case, fault=Fault("low", low, "maneuvers", 0.3, ("landed",))))
    assert landed["as_documented"] is True
    assert "battery" in landed["result"]
    assert not landed["ok"]
    told = Fault("pilot", ({"kind": "pilot_takeover"},), "maneuvers", 0.3, ("landed", "held"))
    piloted = flight.fly_case(replace(case, fault=told))
    assert piloted["as_documented"] is False
    assert "took over" in piloted["result"]


def test_a_case_that_fails_is_a_row_with_its_reason(tmp_path, monkeypatch):
    (case,) = load(tmp_path, set=QUICK).cases()
    cut = flight.fly_case(replace(case, flight_s=4.0))
    assert cut["result"] == "ended by limits.flight_s after 4 s of vehicle time"
    assert not cut["ok"]
    assert cut["flight_s"] < 5.0
    # A trajectory that the limits do not allow is refused before take-off.
    eight = str(CONFIGS / "trajectories/figure8.yaml")
    (case,) = load(
        tmp_path, set={**QUICK, "flight.maneuvers": ["trajectory"], "flight.trajectory": eight}
    ).cases()
    refused = flight.fly_case(case)
    assert refused["result"].startswith("trajectories/figure8/figure8.yaml: "), refused["result"]
    assert not refused["ok"]
    assert refused["setpoints"] == 0
    assert refused["position_rms_m"] is None
    monkeypatch.setattr(flight, "session", lambda *_: 1 / 0)
    row = flight.fly_case(case)
    assert row["result"] == "internal error: ZeroDivisionError: division by zero"
    assert set(row) == set(store.schema(load(tmp_path, set=QUICK).file).names)


@pytest.fixture
def quick(tmp_path):
    """The file of a campaign of three flights, and its folder."""
    told = {
        "set": {**QUICK, "hover.duration_s": 0.2},
        "sweep": {"limits.max_tilt_deg": [20, 25, 30]},
    }
    load(tmp_path, **told)
    return tmp_path / "campaign.yaml", tmp_path / "out"


@pytest.fixture
def on_dask(connected, monkeypatch):
    """Lets campaigns run on a Dask worker in this process, which begins at once."""
    monkeypatch.setattr(running, "cluster_client", connected)


def test_a_campaign_is_run_resumed_and_one_case_is_flown_again(quick, on_dask, capsys, monkeypatch):
    file, out = quick
    assert main(["campaign", str(file), "--out", str(out), "--workers", "2"]) == 0
    assert f"companion campaign report {out}" in capsys.readouterr().out
    table = store.read(out)
    assert table["case"].to_pylist() == [0, 1, 2]
    assert all(table["ok"].to_pylist())
    assert table["limits.max_tilt_deg"].to_pylist() == [20.0, 25.0, 30.0]
    described = folder.read_description(out)
    assert described.cases == 3
    assert described.versions == versions()
    whole = {path.name: path.read_bytes() for path in (out / "results").glob("*.parquet")}
    lost = store.unit_file(out, 1)
    lost.unlink()
    (out / "results" / ".unit-00001.parquet.99").write_bytes(b"torn")
    written = []
    write = store.write_unit
    monkeypatch.setattr(store, "write_unit", lambda *told: (written.append(told[2]), write(*told)))
    assert main(["campaign", str(out), "--workers", "2"]) == 0
    assert written == [1]
    assert {
        path.name: path.read_bytes() for path in (out / "results").glob("unit*.parquet")
    } == whole
    monkeypatch.setattr(flying, "write_flight_page", lambda place: f"Report: {place}")
    assert main(["campaign", "rerun", str(out), "2"]) == 0
    said = capsys.readouterr().out
    assert "bit-identical to the campaign's flight" in said
    (recording,) = (out / "cases" / "case-00002").iterdir()
    assert (recording / "flight.mcap").exists()
    assert f"Report: {recording}" in said
    _refusals(file, out, capsys)


def _refusals(file, out, capsys):
    """What may not be gone on with."""
    assert main(["campaign", "rerun", str(out), "3"]) == 2
    assert "its cases are 0 to 2" in capsys.readouterr().err
    file.write_text(file.read_text().replace("25", "26"))
    assert main(["campaign", str(file), "--out", str(out)]) == 2
    assert "holds another campaign: sweep differ" in capsys.readouterr().err
    path = out / "campaign.json"
    told = json.loads(path.read_text())
    path.write_text(json.dumps({**told, "versions": {**told["versions"], "numpy": "1.0"}}))
    assert main(["campaign", str(out)]) == 2
    assert "begun by another version: this one has numpy" in capsys.readouterr().err
    with (
        folder.lock(out),
        pytest.raises(ConfigError, match="another process"),
        folder.lock(out),
    ):
        pass


def test_what_ends_a_run_early_loses_no_finished_unit(quick, on_dask, capsys, monkeypatch):
    file, out = quick
    monkeypatch.setattr(unit, "fly_case", quick_row)
    units = []

    def fail(error):
        def write(*told):
            if len(units) == 1:
                raise error
            units.append(told[2])
            store_write(*told)

        return write

    store_write = store.write_unit
    for error, words in ((KeyboardInterrupt(), "interrupted"), (ClusterError("lost"), "lost")):
        units.clear()
        monkeypatch.setattr(store, "write_unit", fail(error))
        assert main(["campaign", str(file), "--out", str(out), "--workers", "2"]) == 1
        said = capsys.readouterr().out
        assert words in said
        assert f"companion campaign {out}" in said
    assert len(store.finished_units(out)) == 2
    monkeypatch.setattr(store, "write_unit", store_write)
    assert main(["campaign", str(out)]) == 1  # all is flown, but the program failed in it
    said = capsys.readouterr().out
    assert "1 of the flights ended by an internal error: oops" in said
    assert store.read(out)["case"].to_pylist() == [0, 1, 2]


def quick_row(case):
    return row_of(case, "internal error: oops" if case.index == 0 else "ok")


def test_units_take_seconds_and_leave_work_for_all():
    assert cases_per_unit(500, 1.25, 2) == 2
    assert cases_per_unit(500, 60.0, 2) == 1
    assert cases_per_unit(20, 0.1, 2) == 3
    assert cases_per_unit(20, 0.1, 0) == cases_per_unit(20, 0.1, 1) == 5
    assert [list(each) for each in unit_ranges(5, 2)] == [[0, 1], [2, 3], [4]]


def test_versions_that_differ_are_refused_in_one_sentence():
    ours = versions()
    assert difference(ours, dict(ours)) == ""
    require_equal(ours, dict(ours), "nobody")
    with pytest.raises(VersionError, match=r"^the worker w has numpy 1\.0 instead of"):
        require_equal(ours, {**ours, "numpy": "1.0"}, "the worker w")
