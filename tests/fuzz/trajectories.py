"""Trajectory files: refused in one sentence, or accepted and then finite at every time."""

import warnings
from math import inf, isfinite, nextafter
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from companion.config import Config, trajectory_file
from companion.config.files import changed
from companion.files.yaml_file import ConfigError
from companion.flight.maneuvers import configured_maneuvers
from companion.guidance import Pose
from tests.fuzz.target import Case, Target
from tests.fuzz.texts import PATHS, SHIPPED, as_text, folder_of, mutated, numbers, scalars

_LONGEST_MESSAGE = 5000
_POSE = Pose((1.0, 2.0, -5.0), 0.5)
_SHARES = (0.0, 1e-9, 0.01, 0.1, 0.25, 0.4999, 0.5, 0.73, 0.99, 1.0 - 1e-9, 1.0, 1.5)


def _check(case: Case) -> None:
    with folder_of(case["files"]) as folder, warnings.catch_warnings():
        warnings.simplefilter("error")  # a warning of NumPy is as loose as a traceback
        warnings.simplefilter("default", ResourceWarning)  # of what other tests left behind
        path = folder / next(iter(case["files"]))
        try:
            trajectory = trajectory_file.load(path)
        except ConfigError as error:
            _one_sentence(error)
            return
        assert 0.0 < trajectory.duration < inf, trajectory.duration
        times = [share * trajectory.duration for share in _SHARES]
        for time in (-1.0, -inf, *times, nextafter(trajectory.duration, 0.0), 1e9, inf):
            sample = trajectory.at(time)
            vectors = (*sample.position, *sample.velocity, *sample.acceleration, *sample.jerk)
            numbers_ = (*vectors, sample.heading, sample.heading_rate)
            assert all(map(isfinite, numbers_)), (time, sample)
        _preflight(path, case["slow_down"])


def _preflight(path: Path, slow_down: bool) -> None:
    """As a flight would, see whether it can be flown within the limits."""
    flight = {"maneuvers": ("trajectory",), "trajectory": path, "slow_down": slow_down}
    try:
        flown = configured_maneuvers(changed(Config(), {"flight": flight}, "fuzzing"))
    except ConfigError as error:
        _one_sentence(error)
        return
    assert 0.0 < flown.duration < inf, flown.duration
    for share in _SHARES:
        reference = flown.at(share * flown.duration, _POSE)
        assert all(map(isfinite, (*reference.position_ned, reference.heading))), reference


def _one_sentence(error: ConfigError) -> None:
    said = str(error)
    assert said
    assert "\n" not in said, said
    assert len(said) < _LONGEST_MESSAGE, f"{len(said)} characters: {said[:200]!r}…"


_SHAPES = {
    "hover": ("duration_s",),
    "line": ("to_m", "speed_m_s", "acceleration_m_s2", "jerk_m_s3", "heading"),
    "circle": ("radius_m", "speed_m_s", "laps", "acceleration_m_s2", "direction_deg", "heading"),
    "helix": ("radius_m", "rise_m", "speed_m_s", "laps", "acceleration_m_s2", "heading"),
    "figure_eight": ("half_width_m", "peak_speed_m_s", "shape", "laps", "acceleration_m_s2"),
    "waypoints": ("points_m", "speed_m_s", "acceleration_m_s2", "heading", "headings_deg"),
    "csv": ("file", "frame", "heading", "cutoff_hz", "acceleration_m_s2"),
}
_OPTIONAL = {"acceleration_m_s2", "jerk_m_s3", "heading", "headings_deg", "laps", "direction_deg"}
_OPTIONAL |= {"shape", "frame", "cutoff_hz"}
_coordinate = st.one_of(st.floats(-20.0, 20.0), st.sampled_from((0.0, 1.0)), numbers)
_point = st.lists(_coordinate, min_size=3, max_size=3)
_sizes = st.one_of(
    st.floats(0.1, 20.0),
    st.floats(0.0, 10_000.0),
    st.sampled_from((1e-9, 5e-324, 1e-6, 0.001, 0.01, 1.0, 100.0, 1000.0, 10_000.0)),
    numbers,
)


_VALUES: dict[str, st.SearchStrategy[Any]] = {
    "to_m": _point,
    "points_m": st.lists(_point, max_size=6),
    "headings_deg": st.lists(st.one_of(st.none(), st.floats(-360.0, 360.0), numbers), max_size=6),
    "heading": st.sampled_from(("fixed", "along", "file")),
    "shape": st.sampled_from(("gerono", "bernoulli")),
    "frame": st.sampled_from(("enu", "nwu", "ned")),
    "file": st.one_of(st.just("table.csv"), st.just("table.csv"), st.sampled_from(PATHS)),
    "direction_deg": _coordinate,
    "rise_m": _coordinate,
}
"""By key; all others are sizes."""


def _scalar(value: Any) -> str:
    match value:
        case None:
            return "null"
        case list():
            return "[" + ", ".join(map(_scalar, value)) + "]"
        case float() if not isfinite(value):
            return {inf: ".inf", -inf: "-.inf"}.get(value, ".nan")
        case float():
            return format(value, ".17g" if 1e-4 < abs(value) < 1e15 else ".17f")
        case _:
            return str(value)


@st.composite
def _by_shape(draw: Any) -> str:
    """One shape with most of its keys, seldom two."""
    lines = []
    for shape in draw(st.lists(st.sampled_from(sorted(_SHAPES)), min_size=1, max_size=1)):
        lines.append(f"{shape}:")
        for key in _SHAPES[shape]:
            if key in _OPTIONAL and draw(st.booleans()):
                continue
            odd = draw(st.integers(0, 30)) == 0
            lines.append(
                f"  {key}: {draw(scalars) if odd else _scalar(draw(_VALUES.get(key, _sizes)))}"
            )
    return "\n".join(lines) + "\n"


_FOLDER = SHIPPED / "trajectories"
_YAML = [path.read_text(encoding="utf-8") for path in sorted(_FOLDER.glob("*.yaml"))]
_TABLE = (_FOLDER / "loop.csv").read_text(encoding="utf-8")
yaml_texts = st.one_of(_by_shape(), _by_shape(), mutated(st.sampled_from(_YAML)))

_HEADERS = (
    "t,x,y,z",
    "t,p_x,p_y,p_z",
    "t,x,y,z,yaw",
    "t,x,y,z,vx,vy,vz",
    "t,x,y,z,yaw,vx,vy,vz,ax,ay,az",
    "t,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v_x,v_y,v_z",
    "time,x,y,z,t",
    "t,x,x,y,z",
    "x,y,z",
    "",
)
_cells = st.one_of(
    st.floats(-10.0, 10.0).map(repr),
    st.sampled_from(("0", "1", "nan", "inf", "1e300", "1e-300", "", " 1 ", "1_0", "0x1", "९", '"')),
    numbers.map(repr),
)


@st.composite
def _table(draw: Any) -> str:
    """A table in which time mostly rises, in steps of some size."""
    header = draw(st.sampled_from(_HEADERS))
    width = header.count(",") + 1
    rows = draw(st.integers(0, 9) if draw(st.booleans()) else st.just(30))
    step = draw(st.one_of(st.sampled_from((0.1, 0.01, 1.0, 1e-12, 3600.0, 1e9)), numbers))
    odd = draw(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9), _cells), max_size=3))
    columns = draw(st.lists(_coordinate, min_size=width, max_size=width))
    lines = [header]
    for row in range(rows):
        cells = [repr(step * row), *(repr(value * row) for value in columns[1:])]
        for at, column, text in odd:
            if at == row and column < len(cells):
                cells[column] = text
        lines.append(",".join(cells))
    return draw(st.sampled_from(("\n", "\r\n", "\r"))).join(lines) + "\n"


_csv_texts = st.one_of(
    _table(), _table(), mutated(st.just(_TABLE)), st.binary(max_size=60).map(as_text)
)


@st.composite
def _files(draw: Any) -> dict[str, str]:
    if draw(st.integers(0, 2)) == 0:
        return {"table.csv": draw(_csv_texts)}
    files = {"main.yaml": draw(yaml_texts)}
    if "table.csv" in files["main.yaml"]:
        files["table.csv"] = draw(_csv_texts)
    return files


_cases = st.fixed_dictionaries({"files": _files(), "slow_down": st.booleans()})

TARGET = Target("trajectories", _cases, _check, seconds=10.0)
