"""The page about a flight: from its record, a cut-off record or a `.tlog`; and of two flights."""

import base64
import dataclasses
import gzip
import json
import re
import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.cli.main import main
from companion.config import Config
from companion.recording.flight_record import read_flight
from companion.report import PAGE, flight_data, page
from companion.report.control_plots import control_plots
from companion.report.early_end import early_end
from companion.report.flight_data import recorded_flight
from companion.report.html_page import rendered_page
from companion.report.motion_plots import motion_plots
from companion.report.plots import Plot, drawn_indices
from tests.flight.fly import fly, mock_vehicle

FLIGHT = {
    "flight": {"maneuvers": ["hover", "steps", "circle"]},
    "hover": {"duration_s": 2.0},
    "steps": {"duration_s": 0.5, "settle_s": 1.0},
    "circle": {"laps": 0.5},
}

SWINGING = {
    "flight": {"maneuvers": ["hover", "steps"]},
    "hover": {"duration_s": 4.0},
    "guidance": {"position_weight_per_s4": 4000.0, "velocity_weight_per_s2": 60.0},
    "safety": {"max_speed_m_s": 1.2, "speed_action": "land"},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of one flight in memory."""
    flown = tmp_path_factory.mktemp("flights") / "one"
    flown.mkdir()
    with mock_vehicle() as mock:
        assert fly(mock, flown, **FLIGHT).result == "ok"
    return flown


@pytest.fixture
def copied(folder, tmp_path):
    """A copy of the folder, to be damaged."""
    return shutil.copytree(folder, tmp_path / "copy")


def plots_of(path):
    """The plots of a page, as its script reads them, by title."""
    text = path.read_text("utf-8")
    found = re.search(r'<script id="plots" type="application/json">(.*?)</script>', text, re.S)
    return dict(zip(headings(text), json.loads(found[1]), strict=True))


def headings(text):
    return re.findall(r'<h2>([^<]*)</h2>\n<p class="note">', text)


def body(path):
    """The page without Plotly and the data."""
    return re.sub(r"<script.*?</script>", "", path.read_text("utf-8"), flags=re.S)


def test_the_page_says_first_whether_the_flight_was_good_and_shows_all_of_it(folder, capsys):
    assert main(["report", str(folder)]) == 0
    path = folder / PAGE
    assert capsys.readouterr().out.strip() == str(path)
    text = body(path)
    assert re.search(r"<h1[^>]*>The flight was (not )?good", text)
    assert text.index("<h1") < text.index("Tracking by maneuver") < text.index("Timeline")
    for maneuver in ("hover", "steps", "circle"):
        assert f"<td>{maneuver}</td>" in text
    assert "flight.arm" in text, "the configuration that is not the default"
    assert not re.search(r'(src|href)="', text), "the page needs no network"
    plots = plots_of(path)
    assert {"Track", "Step response", "Tracking error", "Body rate, yaw", "Thrust"} <= set(plots)
    phases = {phase.name: phase for phase in recorded_flight(folder).phases}
    sent = plots["Thrust"]["traces"][0]["x"]
    assert sent[0] > phases["checks"].begin + 1.0, "nothing is sent before the stream begins"
    assert sent[-1] < phases["land"].begin + 1.0, "nothing is sent after the hand-back"
    heights = [y for y in plots["Height"]["traces"][0]["y"] if y is not None]
    assert 1.8 < max(heights) < 2.3
    error = plots["Tracking error"]
    drawn = [y for y in error["traces"][0]["y"] if y is not None]
    assert error["layout"]["yaxis"]["range"][1] < 0.5 * max(drawn), "the way back sets no scale"
    measured = next(t for t in plots["Step response"]["traces"] if t["name"] == "measured")
    assert max(measured["y"]) == pytest.approx(0.25, abs=0.05)
    assert [one["text"] for one in plots["Height"]["layout"]["annotations"]] == [
        "hover",
        "steps",
        "circle",
    ]


def test_a_record_that_was_copied_in_part_is_no_success(copied, capsys):
    """Half of a record, beside the summary of the whole flight, was called identical in replay."""
    record = copied / "flight.mcap"
    record.write_bytes(record.read_bytes()[: record.stat().st_size // 2])
    told = f"{record} ends at {read_flight(copied).duration:.1f} s, before its flight did: "
    for command in ("report", "replay", "export --csv", "plot"):
        assert main([*command.split(), str(copied)]) == 1, command
        assert told in capsys.readouterr().out, command
    assert f'<p class="bad">{told}' in body(copied / PAGE)
    (copied / "summary.json").unlink()  # a flight that was killed recorded all that it could
    assert main(["replay", str(copied)]) == 0


def test_the_page_holds_plotly_packed(folder):
    """A page had 5.8 MB with Plotly as it is."""
    path = page.write_report(folder)
    packed = re.search(r'<script id="plotly" type="text/plain">(.*?)</script>', path.read_text())
    assert b"plotly.js v" in gzip.decompress(base64.b64decode(packed[1]))[:200]
    assert path.stat().st_size < 3.0e6


@pytest.fixture(scope="module")
def failed(tmp_path_factory):
    """The folder of a flight that swung in hover and became too fast in its steps."""
    flown = tmp_path_factory.mktemp("flights") / "failed"
    flown.mkdir()
    with mock_vehicle() as mock:
        summary = fly(mock, flown, **SWINGING)
    assert summary.facts.early_end.monitor == "speed"
    return flown


def test_a_failed_flight_shows_where_it_ended_and_the_limit_it_crossed(failed):
    plots = plots_of(page.write_report(failed))
    told = json.loads((failed / "summary.json").read_text())
    time = told["early_end"]["time_s"]
    for title in ("Timeline", "Height", "Speed and tilt", "Body rate, roll"):
        layout = plots[title]["layout"]
        assert layout["shapes"][-1]["x0"] == time, title
        assert layout["annotations"][-1]["hovertext"] == told["result"]
    names = {trace["name"] for plot in plots.values() for trace in plot["traces"]}
    assert "limit: safety.max_speed_m_s" in names
    speeds = next(t for t in plots["Speed and tilt"]["traces"] if "limit" in t["name"])
    assert speeds["y"] == [1.2, 1.2]
    cross = next(t for t in plots["Track"]["traces"] if t["name"] == "ended early")
    assert cross["mode"] == "markers"
    text = body(failed / PAGE)
    assert re.search(r"The flight ended early at \d+\.\d s: \S", text)
    events = text.index("Events within 5 s of the end")
    assert text.index("<h1") < events < text.index("Tracking by maneuver")
    assert told["result"] in text[events : text.index("Tracking by maneuver")]
    assert "autopilot: " not in text[events : text.index("Tracking by maneuver")]


def test_the_track_in_space_fits_its_picture_also_where_the_vehicle_only_climbs(folder):
    flight = recorded_flight(folder)
    climb = np.column_stack([np.zeros(50), np.full(50, 0.01), np.linspace(0.0, 60.0, 50)])
    curves = {"position": flight_data.Curve(np.arange(50.0), climb)}
    plot = next(
        plot
        for plot in motion_plots([dataclasses.replace(flight, curves=curves)])
        if plot.title == "Track in space"
    )
    scene = plot.layout["scene"]
    assert max(scene["aspectratio"].values()) < 1.3
    assert min(scene["aspectratio"].values()) > 0.5, "no axis is too short to be read"
    low, high = scene["zaxis"]["range"]
    assert low < climb[0, 2]
    assert climb[-1, 2] < high


def test_the_last_maneuver_of_a_failed_flight_ends_with_its_phase(failed):
    flight = recorded_flight(failed)
    (phase,) = (each for each in flight.phases if each.name == "maneuvers")
    assert flight.maneuvers[-1].end == phase.end < flight.phases[-1].end


def test_weights_that_are_too_large_make_a_swing_and_no_good_flight(failed):
    """The stranger's flight: 16° of tilt back and forth, and it was called good."""
    checks = json.loads((failed / "summary.json").read_text())["verdict"]["checks"]
    swing = next(one for one in checks if one["found"].startswith("swings by"))
    assert (swing["what"], swing["good"]) == ("hover", False)
    assert "lower planner.gain_per_s" in swing["remedy"]


@pytest.mark.parametrize(
    ("monitor", "reason", "curve", "key"),
    [
        ("tilt", "60° of tilt", "tilt", "limits.max_tilt_deg + safety.tilt_margin_deg"),
        ("fence", "9 m off, beyond limits.fence_radius_m", "track", "limits.fence_radius_m"),
        ("braking", "0.5 m, below limits.fence_floor_m", "height", "limits.fence_floor_m"),
        ("fence", "40 m up, above limits.fence_ceiling_m", "height", "limits.fence_ceiling_m"),
        ("fence", "outside the polygon", "track", "safety.fence_polygon_m"),
        ("thrust", "at limits.max_thrust", "thrust", "limits.min_thrust, max_thrust"),
    ],
)
def test_each_limit_is_drawn_where_it_is_crossed(folder, monitor, reason, curve, key):
    record, end = read_flight(folder), {"time_s": 9.0, "monitor": monitor}
    polygon = ((-5.0, -5.0), (5.0, -5.0), (0.0, 5.0))
    config = Config.model_validate({"safety": {"fence_polygon_m": polygon}})
    found = early_end({"early_end": end, "result": reason}, record, config)
    assert (found.limit.curve, found.limit.key) == (curve, key)
    assert bool(found.limit.outline) == (curve == "track")
    flight = dataclasses.replace(recorded_flight(folder), early_end=found)
    drawn = [t["name"] for p in (*motion_plots([flight]), *control_plots(flight)) for t in p.traces]
    assert f"limit: {key}" in drawn
    assert (
        early_end({"early_end": {**end, "monitor": "gps"}, "result": ""}, record, config).limit
        is None
    )


def test_a_record_that_was_cut_off_makes_a_page_that_says_so(copied):
    (copied / "summary.json").unlink()
    record = copied / "flight.mcap"
    record.write_bytes(record.read_bytes()[: record.stat().st_size // 2])
    text = body(page.write_report(copied))
    assert "The flight ended early: the record ends" in text
    assert "The recording ends before the flight was over." in text


def test_a_tlog_alone_makes_a_page(folder, tmp_path):
    out = page.write_report(folder / "flight.tlog", tmp_path / "page.html")
    assert re.search(r"<h1>flight.tlog: \d+ s, up to 2\.\d m high, .*° tilted</h1>", body(out))
    assert "open-loop" not in body(out), "a .tlog knows no maneuvers"
    plots = plots_of(out)
    assert {"Track", "Height", "Body rate, roll", "Acceleration coefficient, north"} <= set(plots)
    own = plots_of(page.write_report(folder, tmp_path / "own.html"))
    theirs, ours = (
        max(y for y in each["Body rate, roll"]["traces"][0]["y"] if y is not None)
        for each in (plots, own)
    )
    assert theirs == pytest.approx(ours, rel=1e-3), "the same commands from both recordings"
    lanes, own_lanes = (
        {trace["name"] for trace in each["Timeline"]["traces"]} for each in (plots, own)
    )
    assert lanes == {"modes"}, "a .tlog knows the autopilot's modes, not our phases"
    assert own_lanes == {"phases", "maneuvers", "events"}


def test_flights_stand_beside_each_other(folder, copied, tmp_path):
    config = copied / "config.yaml"
    config.write_text(config.read_text().replace("gain_per_s: 5.0", "gain_per_s: 6.0"))
    config.write_text(re.sub(r"(endpoint: .*):\d+", r"\1:50123", config.read_text()))
    changed = "gain_per_s: 6.0" in config.read_text()
    out = page.write_comparison([folder, copied], tmp_path / "compare.html")
    text = body(out)
    assert "2 flights beside each other" in text
    assert "<th>one</th><th>copy</th>" in text
    assert ("planner.gain_per_s" in text) == changed
    assert "link.endpoint" not in text, "only its port differs"
    assert text.count("The flight was ") == 2, "the verdict of each"
    steps = {trace["name"] for trace in plots_of(out)["Step responses"]["traces"]}
    assert {"one: measured", "copy: measured", "copy: target"} <= steps
    names = {trace["name"] for trace in plots_of(out)["Track"]["traces"]}
    assert {"one: flown", "copy: flown"} <= names


def test_what_cannot_be_shown_is_one_sentence(tmp_path, capsys, monkeypatch):
    assert main(["report", str(tmp_path)]) == 2
    assert "is this the folder of a flight?" in capsys.readouterr().err
    other = tmp_path / "other.tlog"
    other.write_bytes(b"no log")
    assert main(["compare", str(other)]) == 2
    assert "not a .tlog" in capsys.readouterr().err
    monkeypatch.setattr("companion.extras.importlib.util.find_spec", lambda _: None)
    assert main(["report", str(tmp_path)]) == 2
    assert "[report]'" in capsys.readouterr().err


@pytest.mark.parametrize("wrong", [{"maneuvers": [5]}, {"early_end": 3}])
def test_a_summary_with_values_of_another_kind_is_one_sentence(copied, capsys, wrong):
    path = copied / "summary.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **wrong}))
    assert main(["report", str(copied)]) == 2
    assert "rename its summary.json" in capsys.readouterr().err


def test_what_is_marked_as_code_is_shown_as_code(failed):
    assert main(["report", str(failed)]) == 0
    text = body(failed / PAGE)
    assert "in phase <code>maneuvers</code>" in text
    assert "`" not in text


def test_text_of_a_log_cannot_become_a_tag():
    plot = Plot("", "", [{"text": "</script><script>alert(1)"}])
    assert "<script>alert" not in rendered_page("companion.report", "base.html.j2", "", [plot])


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(1, 9000), st.floats(0.0, 1.0))
def test_thinning_keeps_the_extremes_and_the_gaps(seed, count, missing):
    random = np.random.default_rng(seed)
    values = random.normal(size=count)
    values[random.random(count) < missing] = np.nan
    kept = drawn_indices(values)
    assert len(kept) <= 3 * 2000
    assert (np.diff(kept) > 0).all()
    if not np.isnan(values).all():
        assert np.nanmax(values[kept]) == np.nanmax(values)
        assert np.nanmin(values[kept]) == np.nanmin(values)
    assert np.isnan(values[kept]).any() == np.isnan(values).any()


@pytest.mark.parametrize("gain", [5.0, float("nan")])
def test_the_ideal_response_is_drawn_where_the_gain_is_known(folder, gain):
    flight = dataclasses.replace(recorded_flight(folder), gain=gain)
    drawn = [trace["name"] for plot in control_plots(flight) for trace in plot.traces]
    assert any(name.startswith("nearest model: ") for name in drawn)
    assert ("ideal: first order, 0.2 s" in drawn) == (gain == 5.0)
