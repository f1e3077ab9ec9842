"""Trajectories from CSV: what is published is read, understood in its frame, and smooth."""

from math import hypot, pi

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from companion.guidance.trajectory import (
    Frame,
    HeadingFrom,
    Laps,
    SampleOptions,
    TrajectoryError,
    circle,
    from_samples,
    gerono_eight,
    read_csv,
)
from companion.guidance.trajectory.csv_file import parse_csv
from tests.trajectory.finite_differences import (
    assert_derivatives_agree,
    assert_rests_at_both_ends,
    inner_times,
)

EIGHT = gerono_eight(3.0, Laps(5.0, 2))
NED = SampleOptions(Frame.NED)


def _lines(trajectory, step=0.02, derivatives=0, digits=9, begin=0.0, end=None, yaw=False):
    """CSV of a trajectory in NED."""
    names = ["x,y,z", "vx,vy,vz", "ax,ay,az"][: derivatives + 1]
    lines = [",".join(["t", *names, *(["yaw"] if yaw else [])])]
    last = trajectory.duration if end is None else end
    for t in np.linspace(begin, last, round((last - begin) / step) + 1).tolist():
        s = trajectory.at(t)
        row = [*s.position, *(s.velocity + s.acceleration)[: 3 * derivatives]]
        row += [s.heading] if yaw else []
        lines.append(",".join([f"{t:.9f}", *(f"{x:.{digits}f}" for x in row)]))
    return lines


def _errors(found, expected, count=500):
    """Largest differences of position, velocity, acceleration, jerk."""
    times = np.linspace(0.0, expected.duration, count).tolist()
    one, other = ([t.at(x)[:4] for x in times] for t in (found, expected))
    return np.linalg.norm(np.subtract(one, other), axis=2).max(axis=0)


@pytest.mark.parametrize("derivatives", [0, 1, 2])
@pytest.mark.parametrize("step", [0.005, 0.02, 0.1])
def test_a_round_trip_brings_the_trajectory_back(derivatives, step):
    found = from_samples(parse_csv(_lines(EIGHT, step, derivatives), "x"), NED)
    assert found.duration == pytest.approx(EIGHT.duration)
    assert (_errors(found, EIGHT) < (1e-5, 1e-4, 1e-3, 2e-2)).all()
    assert_derivatives_agree(found, inner_times(found))
    assert_rests_at_both_ends(found)


def test_millimetres_do_not_make_it_ring():
    """Interpolated, samples rounded to 1 mm at 100 Hz would jerk by some 1000 m/s³."""
    lines = _lines(EIGHT, 0.01, digits=3)
    found = from_samples(parse_csv(lines, "x"), NED)
    assert (_errors(found, EIGHT) < (1e-3, 1e-2, 0.25, 8.0)).all()
    rough = from_samples(parse_csv(lines, "x"), NED._replace(cutoff=20.0))
    assert _errors(rough, EIGHT)[3] > 10.0 * _errors(found, EIGHT)[3]


def test_given_velocities_are_used():
    """Between positions too sparse for the figure, they tell where it went."""
    sparse = {
        d: from_samples(parse_csv(_lines(EIGHT, 0.75, d), "x"), NED).at(6.6).position
        for d in (0, 1)
    }
    expected = EIGHT.at(6.6).position
    without, with_them = (np.linalg.norm(np.subtract(sparse[d], expected)) for d in (0, 1))
    assert with_them < 0.2 * without


def test_slow_faults_of_the_velocities_are_not_believed_against_the_positions():
    """At a fifth of the cutoff, velocities off by b shift it by b·ω/(ω² + ω_c²), here 1.8 mm."""
    lines = _lines(EIGHT, derivatives=1)
    off = [lines[0]]
    for line in lines[1:]:
        row = [float(x) for x in line.split(",")]
        row[4] += 0.3 * np.sin(2.0 * pi * row[0])
        off.append(",".join(str(float(x)) for x in row))
    found = from_samples(parse_csv(off, "x"), NED)
    assert 1e-3 < _errors(found, EIGHT)[0] < 3e-3


def _agilicious(frame_of_ned, body_of_frd, trajectory):
    """Lines as Agilicious writes them, of a trajectory given in NED, seen in a z-up frame."""
    header = "t,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v_x,v_y,v_z,w_x,w_y,w_z,a_lin_x,a_lin_y,a_lin_z"
    lines = [header]
    for t in np.linspace(0.0, trajectory.duration, 400).tolist():
        s = trajectory.at(t)
        tilt = Rotation.from_rotvec([0.3 * np.sin(t), 0.2, 0.0])
        attitude = frame_of_ned * tilt * Rotation.from_euler("z", s.heading) * body_of_frd
        p, v, a = (frame_of_ned.apply(x) for x in (s.position, s.velocity, s.acceleration))
        x, y, z, w = attitude.as_quat()
        # More values than the header has names, as in published files.
        row = [
            100.0 + t,
            p[0] + 7.0,
            p[1] + 8.0,
            p[2] + 9.0,
            w,
            x,
            y,
            z,
            *v,
            0.0,
            0.0,
            0.0,
            *a,
            1.0,
            2.0,
        ]
        lines.append(",".join(repr(float(x)) for x in row))
    return lines


@pytest.mark.parametrize(
    ("frame", "ned_from_frame"),
    [
        (Frame.ENU, [[0, 1, 0], [1, 0, 0], [0, 0, -1]]),
        (Frame.NWU, [[1, 0, 0], [0, -1, 0], [0, 0, -1]]),
    ],
)
def test_a_file_of_agilicious_is_understood_in_its_frame(frame, ned_from_frame):
    """Position, derivatives and the heading of its quaternions; judged by SciPy's Rotation."""
    flown = circle(5.0, Laps(4.0, 2, direction=0.4, face_path=True))
    frame_of_ned = Rotation.from_matrix(ned_from_frame).inv()
    flu_to_frd = Rotation.from_euler("x", pi)
    lines = _agilicious(frame_of_ned, flu_to_frd, flown)
    found = from_samples(parse_csv(lines, "x"), SampleOptions(frame))
    assert (_errors(found, flown) < (1e-5, 1e-4, 1e-3, 5e-2)).all()
    turns = {
        round((found.at(t).heading - flown.at(t).heading) / (2.0 * pi), 3) for t in range(1, 15)
    }
    assert len(turns) == 1
    assert turns.pop() % 1.0 == pytest.approx(0.0, abs=1e-3)
    rates = [(found.at(t).heading_rate, flown.at(t).heading_rate) for t in range(1, 15)]
    np.testing.assert_allclose(*zip(*rates, strict=True), atol=1e-2)


def test_the_default_frame_is_enu():
    assert SampleOptions().frame is Frame.ENU


def test_a_yaw_column_is_followed_fixed_or_passed_over():
    around = circle(5.0, Laps(4.0, 2, face_path=True))
    read = parse_csv(_lines(around, yaw=True), "x")
    followed = from_samples(read, NED)
    assert followed.at(8.0).heading == pytest.approx(around.at(8.0).heading, abs=1e-3)
    assert_derivatives_agree(followed, inner_times(followed))
    fixed = from_samples(read, NED._replace(heading=HeadingFrom.FIXED))
    assert fixed.holds_heading
    assert from_samples(parse_csv(_lines(around), "x"), NED).holds_heading


def test_facing_along_a_path_that_stands_still_for_a_while():
    """North, a stop of 3 s, east: the heading turns once, calmly, and not with the noise."""
    rng = np.random.default_rng(1)
    lines = ["t,x,y,z"]
    for t in np.arange(0.0, 11.0, 0.02):
        u, w = np.clip(t / 4.0, 0.0, 1.0), np.clip((t - 7.0) / 4.0, 0.0, 1.0)
        n, e = (8.0 * s**3 * (10.0 - 15.0 * s + 6.0 * s * s) for s in (u, w))
        noise = rng.normal(0.0, 1e-3, 2)
        lines.append(f"{t:.3f},{n + noise[0]:.4f},{e + noise[1]:.4f},0")
    found = from_samples(parse_csv(lines, "x"), NED._replace(heading=HeadingFrom.ALONG_PATH))
    assert found.at(2.0).heading == pytest.approx(0.0, abs=0.02)
    assert found.at(9.0).heading == pytest.approx(pi / 2.0, abs=0.02)
    rates = [abs(found.at(t).heading_rate) for t in np.linspace(0.0, found.duration, 500)]
    assert max(rates) < 1.0


def test_samples_in_motion_at_their_ends_are_begun_and_ended_at_rest():
    steady = circle(5.0, Laps(4.0, 3))
    begin, end = 0.3 * steady.duration, 0.7 * steady.duration
    assert hypot(*steady.at(begin).velocity) == pytest.approx(4.0)
    found = from_samples(parse_csv(_lines(steady, begin=begin, end=end), "x"), NED)
    assert_rests_at_both_ends(found)
    assert_derivatives_agree(found, inner_times(found))
    ramp = 2.1875 * 4.0 / 3.0
    assert found.duration == pytest.approx(end - begin + ramp, rel=1e-3)
    assert hypot(*found.at(0.5 * found.duration).velocity) == pytest.approx(4.0, rel=1e-3)
    # It keeps to the circle while it gathers speed.
    centre = np.subtract((5.0, 0.0, 0.0), steady.at(begin).position)
    for t in np.linspace(0.0, found.duration, 100):
        arm = np.subtract(found.at(t).position, centre)
        assert np.linalg.norm(arm) == pytest.approx(5.0, abs=2e-3)


def test_velocities_of_another_frame_are_refused():
    lines = _lines(EIGHT, derivatives=1)
    swapped = [lines[0].replace("vx,vy", "vy,vx"), *lines[1:]]
    with pytest.raises(TrajectoryError, match=r"velocity is not the derivative .* off by \d"):
        from_samples(parse_csv(swapped, "x"), NED)


def test_accelerations_with_gravity_are_refused():
    lines = _lines(EIGHT, derivatives=2)
    heavy = [lines[0]]
    for line in lines[1:]:
        front, down = line.rsplit(",", 1)
        heavy.append(f"{front},{float(down) - 9.81}")
    with pytest.raises(TrajectoryError, match="acceleration is not the derivative"):
        from_samples(parse_csv(heavy, "x"), NED)


GOOD = ["t,x,y,z", "0,0,0,0", "1,1,0,0", "2,2,0,0", "3,3,0,0"]


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        ([], "needs a header and at least 4 samples"),
        (GOOD[:4], "needs a header and at least 4 samples"),
        (["t,x,y", "0,0,0"], "column z of the position is missing; expected .*found t,x,y"),
        (["t,p_x,p_y", *GOOD[1:]], "column p_z of the position is missing; expected .*found t,p_"),
        (
            ["t,lat,lon", *GOOD[1:]],
            r"x,y,z or .* \(if in NED, below a line `# frame: ned`\), found",
        ),
        (["0,0,0,0", *GOOD[1:]], "first line must name the columns, such as t,x,y,z"),
        (["t;x;y;z", *["1;2;3;4"] * 4], "separated by semicolons; use commas"),
        (["t_ms,x,y,z", *GOOD[1:]], "column t_ms is in ms; give t in s, m or rad"),
        (["t,x,y,z,yaw [deg]", *GOOD[1:]], r"column yaw \[deg\] is in deg; give yaw in s, m or"),
        (["x,y,z,w", *GOOD[1:]], "names no time"),
        ([*GOOD[:2], "1,one,0,0", *GOOD[3:]], "line 3: x is 'one', not a number"),
        ([*GOOD[:2], "1,nan,0,0", *GOOD[3:]], "line 3: x is 'nan', not a number"),
        ([*GOOD[:2], "1,1", *GOOD[3:]], "line 3: y is '', not a number"),
        (["# made by hand", *GOOD[:4], "", "2,3,0,0"], "line 7: time does not increase"),
    ],
)
def test_a_bad_table_is_refused_with_its_line(lines, text):
    with pytest.raises(TrajectoryError, match=f"^x(,|: ).*{text}"):
        parse_csv(lines, "x")


def test_the_first_complete_spelling_counts_and_the_case_does_not():
    read = parse_csv([" T ,P_X,p_y,p_z,x,y,z", *(f"{t},1,2,{t},9,9,9" for t in range(5))], "x")
    assert read.position[3].tolist() == [1.0, 2.0, 3.0]
    assert read.derivatives == ()
    assert read.yaw is None


def test_accelerations_without_velocities_are_passed_over():
    assert (
        parse_csv(["t,x,y,z,ax,ay,az", *(f"{t},0,0,0,5,5,5" for t in range(5))], "x").derivatives
        == ()
    )


def test_a_file_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(TrajectoryError, match=r"none\.csv: cannot read it: No such file"):
        read_csv(tmp_path / "none.csv")
    (tmp_path / "picture.csv").write_bytes(b"\xff\xd8\xff\xe0")
    with pytest.raises(TrajectoryError, match=r"picture\.csv: not a text file"):
        read_csv(tmp_path / "picture.csv")


def test_a_column_may_say_its_unit():
    for header in ("t_s,x_m,y_m,z_m,yaw_rad", "time [s],x [m],y [m],z (m),heading[rad]"):
        read = parse_csv([header, *(f"{t},1,2,{t},0.5" for t in range(5))], "x")
        assert read.position[3].tolist() == [1.0, 2.0, 3.0]
        assert read.yaw is not None


def test_a_comment_before_the_header_says_the_frame_and_unused_columns_are_known():
    lines = ["t,x,y,z,battery", *(f"{t},1,2,{t},9" for t in range(5))]
    assert parse_csv(lines, "x").frame is None
    assert parse_csv(["# made by hand", "# frame: NED", *lines], "x").frame == "ned"
    for below in (1, 3):  # it would be flown as ENU: down instead of up
        with pytest.raises(TrajectoryError, match=f"x, line {below + 1}: the frame is named below"):
            parse_csv([*lines[:below], "# frame: ned", *lines[below:]], "x")
    assert parse_csv(lines, "x").unused_columns == ("battery",)
