"""A new monitor touches two files: its judge, and its row in the one table."""

import ast
from pathlib import Path

import companion
from companion.safety import Action, autopilot_judges, table
from companion.safety.monitor import Monitor
from tests.flight.fly import fly, mock_vehicle

ROOT = Path(companion.__file__).parent
TABLE = ROOT / "safety" / "table.py"
JUDGES = {path.stem for path in (ROOT / "safety").glob("*_judges.py")}


def names_used(path):
    """Every name, attribute and imported module of a file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from (getattr(node, "module", None) or "").split(".")
            for alias in node.names:
                yield from alias.name.split(".")


def users(names):
    """The files of the program that use one of `names`."""
    return {path for path in mentioning(names) if names & set(names_used(path))}


def mentioning(words):
    """The files of the program with one of the words in their text: to parse all takes seconds."""
    texts = {path: path.read_text() for path in ROOT.rglob("*.py")}
    return [path for path, text in texts.items() if any(word in text for word in words)]


def test_only_the_table_names_judges_and_makes_monitors():
    assert len(JUDGES) >= 3
    assert users(JUDGES) == {TABLE}
    makers = {
        path
        for path in mentioning({"Monitor"})
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and getattr(node.func, "id", None) == "Monitor"
    }
    assert makers == {TABLE}


def test_every_judge_stands_in_the_table():
    """A judge without a row would never be asked."""
    used = set(names_used(TABLE))
    for stem in JUDGES:
        tree = ast.parse((ROOT / "safety" / f"{stem}.py").read_text())
        functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        judges = {name for name in functions if not name.startswith("_")}
        assert judges
        assert judges <= used, judges - used


def test_a_judge_and_a_row_are_all_that_a_flight_needs(monkeypatch):
    """The new judge warns above 1 m and lands after 2 s, with no other file changed."""

    def high(snapshot, raised):
        height = snapshot.motion.height
        return f"{height:.0f} m is too high" if height is not None and height > 1.0 else None

    rows = table._autopilot_monitors

    def with_new_row(config):
        judge = autopilot_judges.high
        return (
            *rows(config),
            Monitor("high", judge, Action.WARN),
            Monitor("too high", judge, Action.LAND, lasts=2.0),
        )

    monkeypatch.setattr(autopilot_judges, "high", high, raising=False)
    monkeypatch.setattr(table, "_autopilot_monitors", with_new_row)
    with mock_vehicle() as mock:
        summary = fly(mock, hover={"duration_s": 8.0})
        assert mock.state()["armed"] is False
    assert (summary.result, summary.phase) == ("2 m is too high", "maneuvers")
    told = [text for _, text in summary.events]
    assert "safety: high: 2 m is too high → warn" in told
    assert "safety: too high: 2 m is too high → land" in told
