"""One entry of the registry is all that the command line, `all` and the page need of a study."""

import importlib.util
import re
import subprocess
import sys

import pytest

from companion.cli.main import main
from companion.study import registry
from companion.study.registry import STUDIES, Study

DUMMY = Study("dummy", "the sum of two numbers", "dummy_study")
MODULE = """
from matplotlib.figure import Figure

from companion.study.outcome import Finding, Outcome, Table

PROGRESS_STEPS = 1


def run(tick):
    tick("adding")
    figure = Figure()
    figure.subplots().plot([1, 2], [3, 4])
    return Outcome(
        name="dummy",
        title="Dummy: a sum",
        conditions="Two numbers.",
        figure=figure,
        caption="A line.",
        tables=(Table("dummy", "The sum.", ({"a": 1, "b": 2, "sum": 1 + 2},)),),
        findings=(Finding("asked", "The sum is 3.", 1 + 2 == 3, "It is 3."),),
    )
"""


@pytest.fixture
def dummy(tmp_path, monkeypatch):
    """A study in a file of its own, registered by one entry beside `kmax`."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "dummy_study.py").write_text(MODULE)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.delitem(sys.modules, "dummy_study", raising=False)
    monkeypatch.setattr(registry, "STUDIES", {"kmax": STUDIES["kmax"], "dummy": DUMMY})
    return DUMMY


def usage(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["study", *arguments])
    said = capsys.readouterr()
    return ended.value.code, said.out + said.err


def test_one_entry_puts_a_study_into_the_help(dummy, capsys):
    code, said = usage(capsys, "--help")
    assert code == 0
    assert re.search(r"^ +dummy +the sum of two numbers$", said, re.MULTILINE)
    assert re.search(r"^ +all +kmax, dummy$", said, re.MULTILINE)
    code, said = usage(capsys, "dumy")
    assert code == 2
    assert "dummy" in said.rsplit("choose from", 1)[1]  # in quotes before Python 3.12.8


def test_one_entry_makes_a_study_run_and_puts_it_into_the_page(dummy, tmp_path):
    out = tmp_path / "out"
    assert main(["study", "dummy", "--out", str(out)]) == 0
    assert (out / "dummy.csv").read_text() == "a,b,sum\n1,2,3\n"
    assert (out / "dummy.png").read_bytes().startswith(b"\x89PNG")
    page = (out / "dummy.html").read_text()
    assert 'id="dummy"' in page
    assert "The sum is 3." in page
    assert 'id="kmax"' not in page


def test_one_entry_puts_a_study_among_all_unless_it_says_otherwise(dummy, tmp_path, monkeypatch):
    assert main(["study", "all", "--workers", "1", "--out", str(tmp_path)]) == 0
    page = (tmp_path / "study.html").read_text()
    assert 'id="dummy"' in page
    assert 'id="kmax"' in page
    monkeypatch.setitem(registry.STUDIES, "dummy", dummy._replace(in_all=False))
    assert [study.name for study in registry.selected_studies("all")] == ["kmax"]


def test_the_extra_of_an_entry_is_asked_for(dummy, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(registry.STUDIES, "dummy", dummy._replace(extra="nmpc"))
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "casadi" else found(name)
    )
    assert main(["study", "dummy", "--out", str(tmp_path / "out")]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "companion study dummy" in said
    assert "[nmpc]'" in said
    assert main(["study", "kmax", "--out", str(tmp_path / "out")]) == 0


def test_a_study_without_a_case_or_rows_refuses_their_options(dummy, tmp_path, capsys):
    for options, words in (
        (["--case", str(tmp_path / "case.yaml")], "study dummy takes none"),
        (["--json"], "study dummy writes its tables as CSV"),
    ):
        assert main(["study", "dummy", *options, "--out", str(tmp_path / "out")]) == 2
        assert words in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("study", STUDIES.values(), ids=STUDIES)
def test_every_entry_names_a_module_that_has_what_it_promises(study):
    module = importlib.import_module(study.module)
    if study.takes_case:
        assert callable(module.prepare)
    else:
        assert module.PROGRESS_STEPS > 0
        assert callable(module.run)
    assert study.summary


def test_the_command_line_knows_the_studies_without_their_extras():
    code = (
        "import sys, companion.cli.command_line;"
        " loaded = {'matplotlib', 'jinja2', 'tabulate', 'casadi'} & set(sys.modules);"
        " raise SystemExit(str(loaded) if loaded else 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
