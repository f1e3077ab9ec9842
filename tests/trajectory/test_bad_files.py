"""Files of trajectories that were attacked: one sentence, bounded work, no warning of NumPy."""

import importlib
import os
import re
import warnings
from contextlib import suppress

import numpy as np
import pytest

from companion.config.trajectory_file import load
from companion.config.trajectory_file import read as read_trajectory
from companion.drag import Drag
from companion.files import bounded_file
from companion.files.bounded_file import FileRefusedError, read_text
from companion.files.yaml_file import ConfigError
from companion.guidance.trajectory import Envelope, csv_file, curves, slow_down, violations
from companion.guidance.trajectory.csv_file import parse_csv
from companion.guidance.trajectory.curves import MOST_CHECKS
from companion.guidance.trajectory.from_samples import SampleOptions, from_samples
from companion.guidance.trajectory.sample import TrajectoryError

fitted = importlib.import_module("companion.guidance.trajectory.from_samples")
"""The module; the package has a function of this name."""

ENVELOPE = Envelope(1.0, 2.0, 1.0, 1.0, 20.0, 2.0, 1.0, 15.0, drag=Drag(0.5))


def judged(path):
    """Load and judge as before a flight; a warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        trajectory = load(path)
        violations(trajectory, ENVELOPE)
        with suppress(TrajectoryError):
            slow_down(trajectory, ENVELOPE)
        return trajectory


def refused(path):
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        with pytest.raises(ConfigError) as error:
            load(path)
    text = str(error.value)
    assert text.startswith(str(path)), text
    assert len(text) < 500
    assert "\n" not in text
    return text


def rows(count=50, step=0.02, scale=1.0, offset=0.0):
    return [f"{offset + k * step!r},{scale * (k / count) ** 3!r},0,0" for k in range(count)]


def csv_of(tmp_path, lines, header="t,x,y,z"):
    path = tmp_path / "given.csv"
    path.write_text("\n".join([header, *lines]))
    return path


def yaml_of(tmp_path, text):
    path = tmp_path / "given.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (rows(step=1e-12), "line 3: 1e-12 s after the previous sample; write time in s"),
        (rows(step=3600.0), "line 3: 3.6e+03 s after the previous sample"),
        (rows(step=5.0, count=1000), "lasts 4995 s, and 3600 s is the longest"),
        (rows(step=1.0, count=1000, scale=100.0), "450 s is the longest with cutoff_hz 5"),
        (rows(count=5, step=2e-4), "lasts less than 0.1 s"),
        (rows(scale=1e300), "x is 8e+294, more than 10000 m"),
        (rows(scale=-1e5), "more than 10000 m from the first position"),
        (rows(offset=1e300), "line 3: 0 s after|time does not increase"),
        ([*rows(20), "9,1e400,0,0"], "x is '1e400', not a number"),
        ([*rows(20), "9,nan,0,0"], "'nan', not a number"),
        ([*rows(20), "9,1_0,0,0"], "'1_0', not a number"),
        ([*rows(20), f"9,{'7' * 5000},0,0"], "x is '7+…', not a number"),
        ([*rows(20), f"9,{'x' * 9000},0,0"], "x is 'x+…', not a number"),
        ([*rows(20), "9,\0,0,0"], "not a number"),
        ([*rows(20), "9,0,5,0,0"], "line 22: 5 values for 4 columns; write decimals with a point"),
    ],
)
def test_numbers_that_no_vehicle_flies_are_refused_by_line(tmp_path, lines, words):
    assert re.search(
        words.replace("+03", r"\+03").replace("+294", r"\+294"), refused(csv_of(tmp_path, lines))
    )


@pytest.mark.parametrize(
    ("columns", "values", "words"),
    [
        ("vx,vy,vz", "1e5,0,0", "vx is 1e\\+05, more than 100 m/s"),
        ("yaw", "1e300", "yaw is 1e\\+300, more than 10000 rad"),
        ("qw,qx,qy,qz", "0,0,0,0", "the quaternion has the length 0, not 1"),
        ("qw,qx,qy,qz", "1e300,0,0,0", "qw is 1e\\+300"),
        ("vx,vy,vz,ax,ay,az", "0,0,0,1e4,0,0", "ax is 1e\\+04, more than 1000"),
    ],
)
def test_so_are_other_columns(columns, values, words):
    lines = [f"t,x,y,z,{columns}", *(f"{row},{values}" for row in rows())]
    with pytest.raises(TrajectoryError, match=f"line 2: {words}"):
        parse_csv(lines, "given")


def test_a_yaw_in_degrees_is_refused_and_one_that_wraps_is_not():
    turning = [f"{row},{(0.5 * k + 3.0) % 6.2832:.4f}" for k, row in enumerate(rows())]
    assert parse_csv(["t,x,y,z,yaw", *turning], "given").yaw is not None
    degrees = [f"{row},{90 * (k % 2)}" for k, row in enumerate(rows())]
    with pytest.raises(TrajectoryError, match=r"yaw changes by 90 rad .* in degrees"):
        parse_csv(["t,x,y,z,yaw", *degrees], "given")


@pytest.mark.parametrize("yaw", [90.0, -90.0, 7.0])
def test_a_yaw_in_degrees_that_stays_the_same_is_refused(yaw):
    """Flown in rad, 90 would face 117° away from where the file says."""
    for values in (f"{yaw}", f"{yaw:.0f}"):
        lines = ["t,x,y,z,yaw", *(f"{row},{values}" for row in rows())]
        with pytest.raises(TrajectoryError, match=rf"yaw begins at {yaw:g} rad, .* in degrees"):
            parse_csv(lines, "given")


def test_a_yaw_of_many_turns_is_told_and_one_of_two_is_not(tmp_path):
    for end, told in ((90.0, True), (12.0, False)):
        lines = [f"{row},{end * k / 49}" for k, row in enumerate(rows())]
        loaded = read_trajectory(csv_of(tmp_path, lines, "t,x,y,z,yaw"))
        notes = [note for note in loaded.notes if "its yaw turns by 90 rad, 14.3 turns" in note]
        assert bool(notes) == told


def test_latitude_and_longitude_are_told_and_a_path_of_a_metre_is_not(tmp_path):
    for size, told in ((3e-4, True), (1.0, False), (0.0, False)):
        lines = [f"{0.1 * k},{47.39 + size * k / 49},8.54,10" for k in range(50)]
        loaded = read_trajectory(csv_of(tmp_path, lines, "t,x,y,z"))
        assert any("moves by only 0.3 mm" in note for note in loaded.notes) == told


def test_a_column_that_is_named_twice_is_refused():
    lines = ["t,x,y,z,x_m", *(f"{row},0" for row in rows())]
    with pytest.raises(TrajectoryError, match="names the column x more than once"):
        parse_csv(lines, "given")


def test_decimal_commas_are_refused():
    """Read as columns, `0,02,1,5` would fly another path."""
    lines = [f"{k // 10},{k % 10},0,{k},0,0,0,0" for k in range(50)]
    with pytest.raises(TrajectoryError, match="line 2: 8 values for 4 columns; write decimals"):
        parse_csv(["t,x,y,z", *lines], "given")


def test_commas_at_the_end_of_a_row_are_no_values():
    parse_csv(["t,x,y,z", *(f"{row},," for row in rows())], "given")


@pytest.mark.parametrize("scale", [1e-300, 0.0, 1e-9])
def test_what_stays_where_it_is_can_be_judged(tmp_path, scale):
    judged(csv_of(tmp_path, rows(scale=scale)))


def test_noise_of_steps_as_short_as_they_may_be_raises_no_warning(tmp_path):
    rng = np.random.default_rng(1)
    lines = [f"{k * 1e-4!r},{rng.uniform(-9.0, 9.0)},0,0" for k in range(2000)]
    judged(csv_of(tmp_path, ["0,0,0,0", *lines[1:]]))


def test_a_table_is_read_no_further_than_it_may_be_long(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_file, "_MOST_SAMPLES", 100)
    assert load(csv_of(tmp_path, rows(100))).duration > 0.0
    read = []

    def lines():
        yield "t,x,y,z"
        for row in rows(100_000, step=1e-3):
            read.append(row)
            yield row

    with pytest.raises(TrajectoryError, match="more than 100 samples; leave some out"):
        parse_csv(lines(), "given")
    assert len(read) < 110


def test_a_large_file_is_not_read_whole(tmp_path, monkeypatch):
    path = csv_of(tmp_path, rows())
    monkeypatch.setattr(csv_file, "_MOST_BYTES", 1000)
    assert "larger than 0.001 MB" in refused(path)
    sizes = []
    real = os.fdopen

    def watched(*args, **options):
        file = real(*args, **options)
        read = file.read
        return _Watched(file, lambda size: sizes.append(size) or read(size))

    monkeypatch.setattr(bounded_file.os, "fdopen", watched)
    refused(path)
    assert sizes == [1001]


class _Watched:
    def __init__(self, file, read):
        self._file, self.read = file, read

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()

    def fileno(self):
        return self._file.fileno()


def test_only_regular_files_are_read(tmp_path):
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    assert "not a regular file" in refused(pipe)
    zero = tmp_path / "zero.csv"
    zero.symlink_to("/dev/zero")
    assert "not a regular file" in refused(zero)
    assert "not a regular file" in refused_table(tmp_path, "/dev/zero")
    with pytest.raises(FileRefusedError, match=r"not a regular file|cannot read it"):
        read_text(tmp_path, 10)


def refused_table(tmp_path, name):
    path = yaml_of(tmp_path, f"csv: {{file: {name}}}")
    return refused(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("circle: {radius_m: 3, speed_m_s: 2, laps: 1000}", "it lasts 9426 s"),
        ("circle: {radius_m: 3, speed_m_s: 1.0e-300}", "`circle.speed_m_s`"),
        ("circle: {radius_m: 1.0e-300, speed_m_s: 1}", "`circle.radius_m`"),
        ("circle: {radius_m: 1.0e+300, speed_m_s: 1}", "`circle.radius_m`"),
        ("circle: {radius_m: 3, speed_m_s: 2, laps: 1.0e-300}", "`circle.laps`"),
        ("circle: {radius_m: 3, speed_m_s: 2, acceleration_m_s2: 1.0e-300}", "acceleration_m_s2"),
        ("hover: {duration_s: 1.0e-300}", "`hover.duration_s`"),
        ("line: {to_m: [1.0e-300, 0, 0], speed_m_s: 1}", "must end at another point"),
        ("line: {to_m: [1.0e+300, 0, 0], speed_m_s: 1}", "`line.to_m.0`"),
        ("line: {to_m: [9000, 0, 0], speed_m_s: 0.01}", "3600 s is the longest"),
        ("line: {to_m: [1, 0, 0], speed_m_s: 1, jerk_m_s3: 1.0e-300}", "`line.jerk_m_s3`"),
        ("waypoints: {points_m: [[1.0e-300, 0, 0]], speed_m_s: 1}", "is the same as the start"),
        ("waypoints: {points_m: [[1.0e+300, 0, 0]], speed_m_s: 1}", "`waypoints.points_m.0.0`"),
        (
            "waypoints: {points_m: [[0.001001, 0, 0], [9999, 0, 0], [0, 0, 0]], speed_m_s: 0.5,"
            " heading: along}",
            "3600 s is the longest",
        ),
    ],
)
def test_shapes_that_no_vehicle_flies_are_refused(tmp_path, text, words):
    assert words in refused(yaml_of(tmp_path, text))


@pytest.mark.parametrize(
    "text",
    [
        "circle: {radius_m: 0.5, speed_m_s: 2, laps: 1000}",
        "helix: {radius_m: 1000, rise_m: 1000, speed_m_s: 20, laps: 3}",
        "helix: {radius_m: 0.01, rise_m: -1000, speed_m_s: 100, laps: 0.01}",
        "circle: {radius_m: 0.01, speed_m_s: 100, acceleration_m_s2: 100, laps: 0.01}",
        "line: {to_m: [0.0011, 0, 0], speed_m_s: 100, acceleration_m_s2: 100, jerk_m_s3: 1000}",
        "line: {to_m: [0.0011, 0, 0], speed_m_s: 0.01, acceleration_m_s2: 0.01, jerk_m_s3: 0.01}",
        "waypoints: {points_m: [[0.0011, 0, 0], [5, 0, 0], [5, 0.0011, 0]], speed_m_s: 50}",
    ],
)
def test_the_edges_of_what_is_permitted_are_judged_without_a_warning(tmp_path, text):
    judged(yaml_of(tmp_path, text))


def test_the_longest_table_that_may_be_fitted_can_be_judged(monkeypatch):
    """What `cutoff_hz` allows takes no more than MOST_CHECKS, in motion at its ends, too."""
    assert fitted._MOST_PIECES * fitted._CHECKS_PER_PIECE < 0.95 * MOST_CHECKS
    monkeypatch.setattr(fitted, "_MOST_PIECES", 100)
    monkeypatch.setattr(curves, "MOST_CHECKS", 100 * fitted._CHECKS_PER_PIECE + 3 * 256)
    moving = [f"{0.01 * k},{0.02 * k},0,0" for k in range(1000)]
    trajectory = from_samples(parse_csv(["t,x,y,z", *moving], "given"), SampleOptions())
    assert len(trajectory.check_times()) >= 100 * fitted._CHECKS_PER_PIECE
