"""Files of trajectories: the shipped ones, every key, and faults told in one sentence."""

import pickle
import re
from math import degrees, hypot
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydantic import BaseModel

from companion.config.trajectory_file import TrajectoryFile, load, read
from companion.drag import Drag
from companion.files.yaml_file import ConfigError
from companion.guidance.trajectory import line
from companion.guidance.trajectory.demand import demand, sampled_motion
from tests.trajectory.finite_differences import (
    assert_derivatives_agree,
    assert_rests_at_both_ends,
    evenly,
    inner_times,
)

SHIPPED = Path(__file__).parents[2] / "configs" / "trajectories"
FILES = sorted(SHIPPED.glob("*.yaml"))


def _model(shape):
    return next(m for m in TrajectoryFile.model_fields[shape].annotation.__args__ if m)


def _load(tmp_path, text):
    path = tmp_path / "given.yaml"
    path.write_text(text)
    return load(path)


def test_there_is_one_file_for_each_shape():
    assert {next(iter(yaml.safe_load(p.read_text()))) for p in FILES} == set(
        TrajectoryFile.model_fields
    )


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_a_shipped_trajectory_flies_as_its_first_lines_say(path):
    trajectory = load(path)
    jumps = 10.0 if "line" in path.stem else 0.0
    assert_derivatives_agree(trajectory, inner_times(trajectory), jumps)
    assert_rests_at_both_ends(trajectory)
    told = re.search(r"drag of 1/s it takes ([\d.]+)° of tilt and (\d+)°/s", path.read_text())
    needs = demand(sampled_motion(trajectory, evenly(trajectory, 0.005)), Drag(1.0), 9.80665)
    if told:
        assert degrees(needs.tilt.max()) == pytest.approx(float(told[1]), abs=0.06)
        assert degrees(needs.tilt_rate.max()) == pytest.approx(float(told[2]), abs=0.6)
    else:
        assert needs.tilt.max() == 0.0


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_a_shipped_trajectory_shows_every_key(path):
    ((shape, keys),) = yaml.safe_load(path.read_text()).items()
    assert set(_model(shape).model_fields) - set(keys) <= {"headings_deg"}


def test_every_key_is_described():
    for shape in TrajectoryFile.model_fields:
        model = _model(shape)
        assert issubclass(model, BaseModel)
        for key, field in model.model_fields.items():
            assert field.description, f"{shape}.{key}"


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_a_trajectory_can_be_sent_to_another_process(path):
    trajectory = load(path)
    copy = pickle.loads(pickle.dumps(trajectory))
    for t in inner_times(trajectory, 7):
        assert copy.at(t) == trajectory.at(t)


def test_the_figure_eight_of_the_shipped_file():
    eight = load(SHIPPED / "figure8.yaml")
    places = np.array([eight.at(t).position for t in inner_times(eight, 2001)])
    assert np.abs(places[:, 0]).max() == pytest.approx(3.0, abs=1e-3)
    speeds = [hypot(*eight.at(t).velocity) for t in inner_times(eight, 4001)]
    assert max(speeds) == pytest.approx(5.0, abs=1e-3)


def _faces(trajectory, time):
    """Whether the heading is that of the velocity."""
    sample = trajectory.at(time)
    along = np.arctan2(sample.velocity[1], sample.velocity[0])
    return bool(np.cos(along - sample.heading) > 0.999)


@pytest.mark.parametrize(
    "text",
    [
        "line: {to_m: [3, 4, 0], speed_m_s: 2, heading: along}",
        "circle: {radius_m: 3, speed_m_s: 2, heading: along}",
        "helix: {radius_m: 3, rise_m: 1, speed_m_s: 2, heading: along}",
        "figure_eight: {half_width_m: 3, peak_speed_m_s: 2, heading: along}",
        "waypoints: {points_m: [[3, 4, 0], [6, 4, 0]], speed_m_s: 2, heading: along}",
    ],
)
def test_the_heading_can_be_along_the_path(tmp_path, text):
    trajectory = _load(tmp_path, text)
    assert not trajectory.holds_heading
    assert _faces(trajectory, 0.45 * trajectory.duration)
    assert _load(tmp_path, text.replace("along", "fixed")).holds_heading


def test_waypoints_say_how_far_they_leave_the_straight_lines_or_fly_along_them(tmp_path):
    keys = "points_m: [[4, 0, 0], [4, 4, 0]], speed_m_s: 2, jerk_m_s3: 4"
    path = tmp_path / "path.yaml"
    path.write_text(f"waypoints: {{{keys}}}")
    (note,) = read(path).notes
    assert re.search(
        r"leaves the straight lines .* by up to 0\.\d m; .* waypoints.stops: true", note
    )
    path.write_text(f"waypoints: {{{keys}, stops: true}}")
    stopping = read(path)
    assert stopping.notes == ()
    leg = line((4.0, 0.0, 0.0), 2.0, 3.0, 4.0)
    assert stopping.trajectory.at(0.4 * leg.duration) == leg.at(0.4 * leg.duration)
    assert stopping.trajectory.duration == pytest.approx(2.0 * leg.duration)
    path.write_text("waypoints: {points_m: [[4, 0, 0], [9, 0, 0]], speed_m_s: 2}")
    assert read(path).notes == ()  # they lie on one line


def test_angles_are_degrees_and_keys_reach_what_they_name(tmp_path):
    round_ = _load(
        tmp_path,
        "circle: {radius_m: 3, speed_m_s: 2, laps: 2.5, direction_deg: 90, acceleration_m_s2: 1}",
    )
    assert round_.at(round_.duration).position == pytest.approx((0.0, 6.0, 0.0), abs=1e-9)
    assert round_.duration == pytest.approx(2.5 * 2.0 * np.pi * 3.0 / 2.0 + 2.1875 * 2.0)
    path = _load(
        tmp_path,
        "waypoints: {points_m: [[3, 0, 0], [3, 3, 0]], speed_m_s: 2, headings_deg: [null, 90]}",
    )
    assert path.at(path.duration).heading == pytest.approx(np.pi / 2.0)
    bernoulli = _load(
        tmp_path, "figure_eight: {half_width_m: 3, peak_speed_m_s: 2, shape: bernoulli}"
    )
    assert bernoulli.name == "bernoulli eight"
    straight = _load(
        tmp_path, "line: {to_m: [0, 0, -9], speed_m_s: 1, acceleration_m_s2: 5, jerk_m_s3: 4}"
    )
    assert straight.duration == pytest.approx(9.0 + 2.0 * 0.25**0.5)


def _csv(tmp_path):
    rows = [
        f"{t},{t * t * (3 - 2 * t)},0,{0.5 * t * t * (3 - 2 * t)}" for t in np.linspace(0, 1, 50)
    ]
    (tmp_path / "way.csv").write_text("\n".join(["t,x,y,z", *rows]))


def test_a_csv_file_lies_beside_its_yaml_or_stands_alone(tmp_path):
    """In the default frame x is east and z is up."""
    _csv(tmp_path)
    for trajectory in (_load(tmp_path, "csv: {file: way.csv}"), load(tmp_path / "way.csv")):
        assert trajectory.at(9.0).position == pytest.approx((0.0, 1.0, -0.5), abs=1e-6)
        assert trajectory.name == "way"
    ned = _load(tmp_path, "csv: {file: way.csv, frame: ned, heading: along, cutoff_hz: 3}")
    assert ned.at(9.0).position == pytest.approx((1.0, 0.0, 0.5), abs=1e-6)
    assert not ned.holds_heading


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "give exactly one trajectory, one of: hover, line, circle, helix"),
        ("hover: {duration_s: 1}\nline: {to_m: [1, 0, 0], speed_m_s: 1}", "give exactly one"),
        ("circl: {radius_m: 3}", "`circl` is not a known key; did you mean `circle`?"),
        (
            "circle: {radius_m: 3, sped_m_s: 2, speed_m_s: 2}",
            "`circle.sped_m_s` is not a known key; did you mean `speed_m_s`?",
        ),
        ("circle: {radius_m: 3}", "`circle.speed_m_s` is missing"),
        ("hover:", "`hover.duration_s` is missing"),
        ("line: {to_m: [1, 0, .inf], speed_m_s: 1}", "`line.to_m.2` must be a finite number"),
        ("line: {to_m: [0, 0, 0], speed_m_s: 1}", "a line must end at another point"),
        (
            "waypoints: {points_m: [[1, 0, 0]], speed_m_s: 1, heading: along, headings_deg: [0]}",
            "`waypoints`: give either heading or headings_deg",
        ),
        (
            "waypoints: {points_m: [[1, 0, 0]], speed_m_s: 1, headings_deg: [0, 0]}",
            "there are 2 headings for 1 waypoints",
        ),
        (
            "waypoints: {points_m: [[1, 0, 0]], speed_m_s: 1, stops: true, heading: along}",
            "`waypoints`: with `heading: along` the vehicle would turn on the spot at each "
            "stop; use `headings_deg`",
        ),
        ("csv: {file: none.csv}", "none.csv: cannot read it: No such file"),
        (
            "figure_eight: {half_width_m: 3, peak_speed_m_s: 2, laps: 1.5}",
            "the number of laps of a figure-eight must be a whole number",
        ),
    ],
)
def test_a_fault_is_told_in_a_sentence_that_names_the_file(tmp_path, text, sentence):
    with pytest.raises(ConfigError) as caught:
        _load(tmp_path, text)
    line = ", line 1" if sentence.startswith("`") else ""
    assert str(caught.value).startswith(f"{tmp_path / 'given.yaml'}{line}: ")
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        (["t,x,y,z"], "needs a header and at least 4 samples"),
        (
            ["t,x,y,z,vx,vy,vz", *(f"{k / 10},{k / 10},0,0,9,9,9" for k in range(40))],
            "the velocity is not the derivative of the positions",
        ),
    ],
)
def test_a_fault_in_a_csv_names_it_once(tmp_path, rows, sentence):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(rows))
    with pytest.raises(ConfigError) as caught:
        load(path)
    assert str(caught.value).startswith(f"{path}: {sentence}")
    with pytest.raises(ConfigError) as caught:
        _load(tmp_path, "csv: {file: a.csv}")
    assert str(caught.value).startswith(f"{tmp_path / 'given.yaml'}: {path}: {sentence}")


def test_a_missing_csv_is_told_too(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.csv: cannot read it"):
        load(tmp_path / "none.csv")


TABLE = ["t,x,y,z", *(f"{t / 10},{t * t * (30 - t) / 4500},0,{t / 100}" for t in range(20))]


def test_the_frame_of_a_table_is_said_and_changes_where_it_leads(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(TABLE))
    assumed, notes = read(path)
    note, longer = notes
    assert note.startswith(
        "a.csv is read in s, m and rad with x east, y north, z up (enu), because it"
    )
    assert "# frame: ned" in note
    assert longer.startswith("a.csv begins or ends in motion: ramps")
    path.write_text("\n".join(["# frame: ned", *TABLE]))
    told, notes = read(path)
    assert notes[0] == "a.csv is read in s, m and rad with x north, y east, z down (ned)"
    north, east, down = told.at(1.5).position
    assert assumed.at(1.5).position == pytest.approx((east, north, -down))
    (tmp_path / "b.yaml").write_text("csv: {file: a.csv, frame: ned}")
    assert read(tmp_path / "b.yaml").notes == notes


def test_a_table_with_few_rows_says_how_its_path_and_its_duration_differ(tmp_path):
    path = tmp_path / "square.csv"
    corners = [(0, 0), (4, 0), (4, 4), (4, 4), (0, 4), (0, 0)]
    path.write_text(
        "t,x,y,z\n" + "".join(f"{3 * k},{x},{y},0\n" for k, (x, y) in enumerate(corners))
    )
    square, notes = read(path)
    _, longer, detour = notes
    assert f"make it last {square.duration:.1f} s instead of 15.0 s" in longer
    east = [square.at(0.02 * k).position[1] for k in range(int(square.duration / 0.02))]
    outside = max(max(east) - 4.0, -min(east))
    assert outside > 0.5
    told = float(detour.split("up to ")[1].split(" m")[0])
    assert told >= round(outside, 1)
    assert detour.endswith("to fly along the lines, give more rows")


@pytest.mark.parametrize(
    ("comment", "words"),
    [
        ("# frame: enu", "its comment says frame: enu, and csv.frame says ned"),
        ("# frame: body", "its frame 'body' is not one of enu, nwu, ned"),
    ],
)
def test_a_frame_that_cannot_be_is_refused(tmp_path, comment, words):
    (tmp_path / "a.csv").write_text("\n".join([comment, *TABLE]))
    (tmp_path / "b.yaml").write_text("csv: {file: a.csv, frame: ned}")
    with pytest.raises(ConfigError) as caught:
        load(tmp_path / "b.yaml")
    assert words in str(caught.value)


def test_unused_columns_are_told(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\n".join([f"{TABLE[0]},volts", *(f"{line},9" for line in TABLE[1:])]))
    assert read(path).notes[1] == "a.csv: these columns are not used: volts"
