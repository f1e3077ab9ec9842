"""`companion study` as a user runs it: its numbers, its files, its page, its errors."""

import csv
import importlib.util
import math
import os
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from rich.console import Console

from companion.cli.main import main
from companion.files.yaml_file import ConfigError
from companion.study import registry, report, runner
from companion.study.custom_case import Case
from companion.study.paper import fig2, fig3, fig4, fig5_flights, kmax, rates
from companion.study.registry import STUDIES

ROOT = Path(__file__).parents[2]
PROGRESS_STEPS = {
    "fig2": fig2.PROGRESS_STEPS,
    "fig3": fig3.PROGRESS_STEPS,
    "fig4": fig4.PROGRESS_STEPS,
    "fig5": fig5_flights.PROGRESS_STEPS,
    "rates": rates.PROGRESS_STEPS,
    "kmax": kmax.PROGRESS_STEPS,
}
"""The studies of the paper, and how often each should tick."""
CASE = ROOT / "configs" / "study-case.yaml"
EIGHT = tuple(k * math.pi / 4.0 for k in range(-3, 5))
"""Headings, best and worst of Euler angles among them; figure 3 alone flies all 72."""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """All studies of the paper, once; and how often each of them ticked. `test_lag` flies ours."""
    out = tmp_path_factory.mktemp("study")
    ticks = Counter()
    tick = runner._tick

    def counting(progress, task, study, part):
        ticks[study] += 1
        tick(progress, task, study, part)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "_tick", counting)
        patch.setattr(registry, "STUDIES", {name: STUDIES[name] for name in PROGRESS_STEPS})
        # They are away from the reference most, and reach 5 %, within a second; Euler in half.
        patch.setattr(fig2, "FIGURE_2", replace(fig2.FIGURE_2, headings=EIGHT, seconds=1.0))
        patch.setattr(fig3, "FIGURE_2", replace(fig3.FIGURE_2, seconds=0.5))
        patch.setattr(fig4, "FIGURE_4", replace(fig4.FIGURE_4, headings=EIGHT, seconds=1.0))
        step = replace(fig5_flights.STEP, headings=EIGHT[3:6:2], seconds=1.0)
        patch.setattr(fig5_flights, "STEP", step)
        # Of the sweep only the cross-track is shown, which is largest in the first half second.
        patch.setattr(fig5_flights, "FIGURE_2", replace(fig5_flights.FIGURE_2, seconds=0.5))
        page, _ = runner.run("all", None, out, Console(quiet=True))
    return out, page, ticks


@pytest.fixture
def unpainted(monkeypatch):
    """Figures are made and not painted, which is most of a study's time; `results` paints them."""
    monkeypatch.setattr(report, "_lay_out", lambda _: None)
    monkeypatch.setattr(report, "_image", lambda *_: b"")


def rows(results, name):
    with (results[0] / f"{name}.csv").open(newline="") as file:
        header, *body = csv.reader(file)
    return {row[0]: dict(zip(header[1:], row[1:], strict=True)) for row in body}


def number(table, row, column):
    (key,) = [key for key in table[row] if key.startswith(column)]
    return float(table[row][key])


@pytest.mark.parametrize(
    ("method", "deviation", "cross_track"),
    [
        ("first-order", 8.2e-4, 1.2e-4),
        ("quaternion", 2.41e-2, 2.37e-2),
        ("so3", 2.37e-2, 2.37e-2),
        ("euler, best at -90°", 6.3e-3, None),
        ("euler, worst at 0°", 4.57e-2, None),
    ],
)
def test_the_table_of_figure_2_has_the_known_numbers(results, method, deviation, cross_track):
    table = rows(results, "fig2")
    assert number(table, method, "largest deviation") == pytest.approx(deviation, rel=0.02)
    if cross_track is not None:
        assert number(table, method, "cross-track") == pytest.approx(cross_track, rel=0.02)
        assert number(table, method, "difference between headings") < 1e-9


def test_figure_2_says_which_of_its_axes_are_magnified(monkeypatch):
    short = replace(fig2.FIGURE_2, headings=EIGHT[:2], seconds=0.5)
    monkeypatch.setattr(fig2, "FIGURE_2", short)
    (north, east, away, plane) = fig2.run(lambda _: None).figure.axes
    span = {axes: abs(np.subtract(*axes.get_ylim())) for axes in (north, east)}
    assert f"magnified: this axis spans 1/{span[north] / span[east]:.0f}" in east.get_title()
    assert "magnified: the $a_E$ axis spans 1/" in plane.get_title()
    assert "magnified" not in north.get_title() + away.get_title()


def test_the_table_of_figure_3_is_of_period_pi_and_spans_that_of_figure_2(results):
    away = {
        int(angle): float(next(iter(row.values()))) for angle, row in rows(results, "fig3").items()
    }
    assert len(away) == 72
    for angle in range(-175, 1, 5):
        assert away[angle] == pytest.approx(away[angle + 180], rel=1e-6)
    assert min(away.values()) == pytest.approx(6.3e-3, rel=0.02)
    assert max(away.values()) == pytest.approx(4.57e-2, rel=0.02)


@pytest.mark.parametrize(
    ("method", "rate", "time"),
    [
        ("first-order", math.pi / 2, 0.692),
        ("first-order, paper's limit", 1.30, 0.771),
        ("so3", math.pi / 2, 0.685),
    ],
)
def test_the_table_of_figure_4_has_the_known_numbers(results, method, rate, time):
    table = rows(results, "fig4")
    assert number(table, method, "largest √") == pytest.approx(rate, rel=0.02)
    assert number(table, method, "time to 5 %") == pytest.approx(time, rel=0.02)


def test_exact_is_exact_at_every_rate_and_the_paper_is_not(results):
    table = rows(results, "rates")
    assert list(table) == ["1000", "500", "250", "100", "50"]
    for hz in table:
        assert number(table, hz, "exact: deviation") <= 1e-12
    assert number(table, "1000", "proposed: deviation") == pytest.approx(8.2e-4, rel=0.02)
    assert number(table, "50", "proposed: deviation") == pytest.approx(1.7e-2, rel=0.03)


@pytest.mark.parametrize(("tilt", "k"), [("30", 1.333), ("45", 2.0), ("60", 4.0)])
def test_k_max_is_that_of_appendix_a(results, tilt, k):
    table = rows(results, "kmax")
    assert number(table, tilt, "K_max computed") == pytest.approx(k, rel=1e-3)
    assert number(table, tilt, "1/(1") == pytest.approx(k, rel=1e-3)


def test_a_slow_inner_loop_takes_the_straight_line_from_the_proposed_method(results):
    table = rows(results, "fig5-quickness")
    quickest, slowest = min(table, key=float), max(table, key=float)
    assert number(table, quickest, "first-order") < 0.2 * number(table, quickest, "quaternion")
    assert number(table, slowest, "first-order") > number(table, slowest, "quaternion")


def test_every_study_writes_its_figure_and_its_tables(results):
    out, page, _ = results
    names = {path.name for path in out.iterdir()}
    for study in PROGRESS_STEPS:
        assert {f"{study}.{ending}" for ending in ("svg", "png", "csv", "md")} <= names
        assert (out / f"{study}.png").read_bytes().startswith(b"\x89PNG")
        assert f'id="{study}"' in page.read_text()
    for path in out.glob("*.md"):
        table = path.read_text().strip().split("\n\n")[1].splitlines()
        assert len({line.count("|") for line in table}) == 1, path.name


def test_the_page_stands_alone_and_states_what_did_not_hold(results):
    text = results[1].read_text()
    links = re.findall(r'(?:src|href|url)\s*[=(]\s*["\']?([^"\')>\s]+)', text)
    assert links
    assert all(link.startswith(("#", "data:image/svg+xml;base64,")) for link in links)
    assert "<script" not in text
    verdicts = re.findall(r'class="(holds|fails)">', text)
    assert {"holds", "fails"} == set(verdicts)
    cells = {cell.strip() for cell in re.findall(r"<td[^>]*>([^<]*)</td>", text)}
    assert "never" in cells
    assert not {"nan", "None", "inf", ""} & cells


def test_the_progress_bar_ends_full(results):
    assert dict(results[2]) == PROGRESS_STEPS


def test_the_same_study_gives_the_same_files(results, tmp_path):
    runner.run("kmax", None, tmp_path, Console(quiet=True))
    for name in ("kmax.svg", "kmax.csv", "kmax.md", "kmax.png"):
        assert (tmp_path / name).read_bytes() == (results[0] / name).read_bytes(), name


def custom(tmp_path, capsys, **changes):
    data = yaml.safe_load(CASE.read_text()) | changes
    case = tmp_path / "case.yaml"
    case.write_text(yaml.safe_dump(data))
    code = main(["study", "custom", "--case", str(case), "--out", str(tmp_path / "out")])
    return code, " ".join(capsys.readouterr().err.split())


def test_the_shipped_case_is_right_and_marks_what_differs_from_the_defaults():
    shown, default = yaml.safe_load(CASE.read_text()), Case(start=(0, 0), target=(0.1, 0))
    assert list(shown) == list(Case.model_fields)
    assert list(shown["limits"]) == list(type(default.limits).model_fields)
    for line in CASE.read_text().splitlines():
        pair, _, marked = line.partition("  # default: ")
        key = pair.partition(":")[0]
        if line.lstrip().startswith("#") or key.strip() in ("", "start", "target", "limits"):
            continue
        holder, given = (default.limits, shown["limits"]) if key[0] == " " else (default, shown)
        standard = getattr(holder, key.strip())
        standard = list(standard) if isinstance(standard, tuple) else standard
        assert (yaml.safe_load(marked) if marked else given[key.strip()]) == standard, line


def test_a_case_of_ones_own(tmp_path, capsys):
    code, _ = custom(tmp_path, capsys, rates_hz=[100.0, 50.0], seconds=1.0)
    assert code == 0
    with (tmp_path / "out" / "custom.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert len(table) == 10
    assert max(float(row["cross-track"]) for row in table if row["method"] == "exact") < 1e-12
    with (tmp_path / "out" / "custom-response.csv").open(newline="") as file:
        series = list(csv.DictReader(file))
    assert len(series) == 5 * 3 * (100 + 50)
    first = series[0]
    assert [float(first[key]) for key in ("time, s", "a_N", "a_E")] == pytest.approx([0, -0.3, 0.1])
    assert "max_tilt_deg 40.0" in (tmp_path / "out" / "custom.html").read_text()


@pytest.mark.usefixtures("unpainted")
def test_a_case_with_the_inner_loop_and_the_limit_of_equation_33(tmp_path, capsys):
    limits = {"max_tilt_deg": 40.0, "max_tilt_rate_deg_s": 90.0, "rate_limit": "paper"}
    changes = {"limits": limits, "headings_deg": [0.0], "rates_hz": [100.0], "seconds": 0.4}
    methods = {"methods": ["first-order"]}
    assert custom(tmp_path, capsys, **changes, **methods)[0] == 0
    ideal = (tmp_path / "out" / "custom.csv").read_text()
    flown = {**methods, "inner_loop": True, "transport_delay_ms": 20.0}
    assert custom(tmp_path, capsys, **changes, **flown)[0] == 0
    assert (tmp_path / "out" / "custom.csv").read_text() != ideal


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"strat": [0, 0]}, "`strat` is not a known key; did you mean `start`?"),
        ({"limits": {"max_tilt": 3}}, "`limits.max_tilt` is not a known key; did you mean"),
        ({"methods": ["so4"]}, "unknown method 'so4'"),
        ({"methods": ["so3", "so3"]}, "has the same value twice"),
        ({"methods": []}, "`methods`"),
        ({"start": [0.9, 0.9]}, "tilt below 75°"),
        ({"start": [0.4, 0.3]}, "nothing to fly"),
        ({"target": [0.7, 0.0]}, "beyond limits.max_tilt_deg"),
        ({"limits": {"rate_limit": "paper"}}, "equation 33"),
        ({"inner_loop": True, "rates_hz": [300]}, "must divide 1000"),
        ({"transport_delay_ms": 5}, "needs inner_loop"),
        ({"seconds": float("inf")}, "`seconds`"),
        ({"seconds": 0.001}, "`seconds`"),
        ({"rates_hz": [100, 100]}, "has the same value twice"),
        ({"rates_hz": [1000], "seconds": 60, "headings_deg": list(range(360))}, "fit into memory"),
        ({"rates_hz": [0]}, "`rates_hz.0` must be at least 10 (got 0)"),
        ({"methods": "so3"}, "is a list"),
        ({"inner_loop": True, "transport_delay_ms": 0.5}, "`transport_delay_ms`"),
        ({"quickness": 3}, "needs inner_loop"),
    ],
)
def test_a_bad_case_is_one_clear_sentence(tmp_path, capsys, changes, words):
    code, said = custom(tmp_path, capsys, **changes)
    assert code == 2
    assert words in said
    assert not (tmp_path / "out").exists()


def test_custom_wants_a_case_and_the_others_have_theirs(tmp_path):
    with pytest.raises(ConfigError, match="--case FILE"):
        runner.run("custom", None, tmp_path, Console(quiet=True))
    with pytest.raises(ConfigError, match="goes with study custom"):
        runner.run("fig2", CASE, tmp_path, Console(quiet=True))


@pytest.mark.usefixtures("unpainted")
def test_what_is_interrupted_leaves_no_broken_page(tmp_path, capsys, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    assert main(["study", "kmax", "--out", str(tmp_path)]) == 0
    page = (tmp_path / "kmax.html").read_bytes()
    monkeypatch.setattr("companion.study.runner.write_page", interrupted)
    assert main(["study", "kmax", "--out", str(tmp_path)]) == 1
    assert "Interrupted" in capsys.readouterr().out
    assert (tmp_path / "kmax.html").read_bytes() == page
    assert not list(tmp_path.glob(".*"))


def test_without_the_extra_one_sentence_says_what_to_install(tmp_path, capsys, monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "matplotlib" else found(name)
    )
    assert main(["study", "kmax", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "[study]'" in said
    assert said.count("\n") == 1


def test_a_place_that_cannot_be_written_is_said_before_the_work(tmp_path, capsys):
    (tmp_path / "file").touch()
    assert main(["study", "fig5", "--out", str(tmp_path / "file")]) == 2
    assert "cannot write to" in capsys.readouterr().err


def test_a_full_disk_is_one_sentence(tmp_path, capsys):
    (tmp_path / f".kmax.png.{os.getpid()}").symlink_to("/dev/full")
    assert main(["study", "kmax", "--out", str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert "No space left" in said
    assert "Traceback" not in said
