"""A new monitor touches two files: its check, and its row in the one table."""

import ast
from pathlib import Path

import companion
from companion.safety import Action, autopilot_breaches, table
from companion.safety.monitor import Monitor
from tests.flight.fly import fly, mock_vehicle

ROOT = Path(companion.__file__).parent
TABLE = ROOT / "safety" / "table.py"
CHECK_MODULES = {path.stem for path in (ROOT / "safety").glob("*_breaches.py")}


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
    assert len(CHECK_MODULES) >= 3
    assert users(CHECK_MODULES) == {TABLE}
    makers = {
        path
        for path in mentioning({"Monitor"})
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and getattr(node.func, "id", None) == "Monitor"
    }
    assert makers == {TABLE}


def test_every_judge_stands_in_the_table():
    """A check without a row would never be asked."""
    used = set(names_used(TABLE))
    for stem in CHECK_MODULES:
        tree = ast.parse((ROOT / "safety" / f"{stem}.py").read_text())
        functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        checks = {name for name in functions if not name.startswith("_")}
        assert checks
        assert checks <= used, checks - used


def test_a_judge_and_a_row_are_all_that_a_flight_needs(monkeypatch):
    """The new check warns above 1 m and lands after 2 s, with no other file changed."""

    def high(snapshot, raised):
        height = snapshot.motion.height
        return f"{height:.0f} m is too high" if height is not None and height > 1.0 else None

    rows = table._autopilot_monitors

    def with_new_row(config):
        check = autopilot_breaches.high
        return (
            *rows(config),
            Monitor("high", check, Action.WARN),
            Monitor("too high", check, Action.LAND, raise_after=2.0),
        )

    monkeypatch.setattr(autopilot_breaches, "high", high, raising=False)
    monkeypatch.setattr(table, "_autopilot_monitors", with_new_row)
    with mock_vehicle() as mock:
        summary = fly(mock, hover={"duration_s": 8.0})
        assert mock.state()["armed"] is False
    assert (summary.result, summary.phase) == ("2 m is too high", "maneuvers")
    told = [text for _, text in summary.events]
    assert "safety: high: 2 m is too high → warn" in told
    assert "safety: too high: 2 m is too high → land" in told
