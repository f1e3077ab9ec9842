"""Setting parameters: asked for, undoable before it is done, read back, never while armed."""

import asyncio
from types import SimpleNamespace

import pytest
import yaml

from companion.files.yaml_file import ConfigError, load
from companion.mavlink.errors import ParameterRefused, UnknownParameter
from companion.preflight.evidence import Identity
from companion.preflight.finding import Finding, ParameterChange
from companion.preflight.parameter_fixes import (
    Answer,
    UndoContents,
    UndoFile,
    VehicleArmedError,
    apply_fixes,
    restore,
)
from companion.vehicle.parameter_rules import CheckResult
from companion.vehicle.registry import autopilot_for

YES, NO, ALL, QUIT = Answer.YES, Answer.NO, Answer.ALL, Answer.QUIT


class FakeLink:
    """A vehicle's parameters; `locked` ones keep their value, `drifting` ones do not hold it."""

    def __init__(self, undo_folder, **values):
        self.values = dict(values)
        self.locked, self.drifting = set(), set()
        self.autopilot = autopilot_for(12, 2)
        self.settings = SimpleNamespace(target_system=1)
        self.state = SimpleNamespace(heartbeat=SimpleNamespace(received=0.0, armed=False))
        self.undo_at_write = []
        self._folder = undo_folder

    async def read_parameter(self, name):
        if name not in self.values:
            raise UnknownParameter(f"{name}: no answer")
        return self.values[name]

    async def write_parameter(self, name, value):
        (written,) = self._folder.glob("doctor-undo-*.yaml")
        self.undo_at_write.append(dict(load(written, UndoContents).parameters))
        if name in self.locked:
            raise ParameterRefused(f"{name}: the parameter is read-only")
        self.values[name] = value + (0.1 if name in self.drifting else 0.0)
        return value


def finding(parameter, old, new):
    change = ParameterChange(parameter, old, new, reboot=False)
    return Finding(parameter, CheckResult.UNSAFE, f"{parameter} is {old:g}", change=change)


WRONG = [finding("A", 5.0, 1.0), finding("B", 2.0, 3.0), finding("C", 7.0, 8.0)]
SAFE = Finding("D", CheckResult.SAFE, "D is 1")


def treat(link, folder, answers, findings=(*WRONG, SAFE)):
    """Mend with scripted answers; what became of each change, and the undo file."""
    script, outcomes, proposed = iter(answers), [], []

    async def ask(finding):
        proposed.append(finding.key)
        return next(script)

    async def scene():
        link.state.heartbeat.received = asyncio.get_running_loop().time()
        undo = UndoFile(folder, link, Identity("1.18.0", 0, "00ab"))
        await apply_fixes(link, findings, ask, undo, outcomes.append)
        return undo.path

    return asyncio.run(scene()), [(o.change.parameter, o.refusal) for o in outcomes], proposed


@pytest.mark.parametrize(
    ("answers", "proposed", "mended"),
    [
        ([YES, NO, YES], "ABC", "AC"),
        ([YES, ALL], "AB", "ABC"),
        ([NO, QUIT], "AB", ""),
        ([NO, NO, NO], "ABC", ""),
    ],
)
def test_each_change_is_asked_for(tmp_path, answers, proposed, mended):
    link = FakeLink(tmp_path, A=5.0, B=2.0, C=7.0)
    path, outcomes, asked = treat(link, tmp_path, answers)
    assert asked == list(proposed)
    assert outcomes == [(name, "") for name in mended]
    for wrong in WRONG:
        name, old, new, _ = wrong.change
        assert link.values[name] == (new if name in mended else old)
    assert path.exists() == bool(mended)


def test_the_old_value_is_on_the_disk_before_the_new_one_is_set(tmp_path):
    link = FakeLink(tmp_path, A=5.0, B=2.0, C=7.0)
    path, _, _ = treat(link, tmp_path, [ALL])
    assert link.undo_at_write == [{"A": 5.0}, {"A": 5.0, "B": 2.0}, {"A": 5.0, "B": 2.0, "C": 7.0}]
    told = yaml.safe_load(path.read_text())
    assert (told["autopilot"], told["system"], told["uid"]) == ("PX4", 1, "00ab")
    assert list(told) == ["autopilot", "system", "uid", "time", "parameters"]


def test_the_first_value_of_a_parameter_is_kept_and_no_other_runs_file_is_touched(tmp_path):
    paths = set()
    for _ in range(3):  # within one second, most likely
        link = FakeLink(tmp_path, A=5.0)
        undo = UndoFile(tmp_path, link, Identity())
        undo.add("A", 5.0)
        undo.add("A", 1.0)
        assert load(undo.path, UndoContents).parameters == {"A": 5.0}
        paths.add(undo.path)
    assert len(paths) == 3


def test_a_refused_write_and_one_that_does_not_hold_are_told_and_the_rest_goes_on(tmp_path):
    link = FakeLink(tmp_path, A=5.0, B=2.0, C=7.0)
    link.locked.add("A")
    link.drifting.add("B")
    _, outcomes, _ = treat(link, tmp_path, [ALL])
    assert [name for name, _ in outcomes] == ["A", "B", "C"]
    assert "read-only" in outcomes[0][1]
    assert "3.1 was read back instead of 3" in outcomes[1][1]
    assert outcomes[2][1] == ""


def test_nothing_is_set_while_armed_or_while_nobody_knows(tmp_path):
    link = FakeLink(tmp_path, A=5.0, B=2.0, C=7.0)
    link.state.heartbeat.armed = True
    with pytest.raises(VehicleArmedError, match="is armed"):
        treat(link, tmp_path, [ALL])
    link.state.heartbeat.armed = False

    async def long_thought(_):
        link.state.heartbeat.received = asyncio.get_running_loop().time() - 3.1
        return YES

    async def scene():
        undo = UndoFile(tmp_path, link, Identity())
        await apply_fixes(link, WRONG, long_thought, undo, lambda _: None)

    with pytest.raises(VehicleArmedError, match="no heartbeat"):
        asyncio.run(scene())
    assert link.values == {"A": 5.0, "B": 2.0, "C": 7.0}
    assert list(tmp_path.iterdir()) == []


def test_without_an_undo_file_nothing_is_set(tmp_path):
    (tmp_path / "flights").write_text("not a folder")
    link = FakeLink(tmp_path, A=5.0, B=2.0, C=7.0)
    with pytest.raises(ConfigError, match=r"recording\.directory"):
        treat(link, tmp_path / "flights", [ALL])
    assert link.values == {"A": 5.0, "B": 2.0, "C": 7.0}


def test_restoring_goes_backwards_and_tells_what_it_cannot(tmp_path):
    link = FakeLink(tmp_path, A=5.0, B=2.0, C=7.0)
    path, _, _ = treat(link, tmp_path, [ALL])
    undo, outcomes = load(path, UndoContents), []
    assert undo.matches_vehicle(link, Identity())
    assert undo.matches_vehicle(link, Identity(uid="00ab"))
    assert not undo.matches_vehicle(link, Identity(uid="00ac"))
    link.settings.target_system = 2
    assert not undo.matches_vehicle(link, Identity())
    del link.values["B"]

    async def scene():
        link.state.heartbeat.received = asyncio.get_running_loop().time()
        await restore(link, undo, outcomes.append)

    asyncio.run(scene())
    assert [o.change.parameter for o in outcomes] == ["C", "B", "A"]
    assert [bool(o.refusal) for o in outcomes] == [False, True, False]
    assert (link.values["A"], link.values["C"]) == (5.0, 7.0)
