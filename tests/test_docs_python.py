"""Python blocks of README and docs: each runs as it stands, on the mock vehicle where it flies.

Those of docs/extending.md run in `test_extending`, `api/test_plugins` and
`safety/test_plugin_monitors`, the programs of docs/python.md in `api/test_python_page`.
"""

import re
from pathlib import Path

import pytest

from companion import testing
from companion.attitude import BodyRates
from tests.flight.fly import QuickVehicle, fly

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```python(?: title=\"[^\"]+\")?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: str) -> list[str]:
    return BLOCK.findall((ROOT / page).read_text("utf-8"))


@pytest.mark.parametrize("page", ["README.md", "docs/the-law.md"])
def test_the_planner_answers_as_the_comment_below_it_says(page):
    (block,) = blocks(page)
    *program, expression, shown = block.strip().splitlines()
    given = {}
    exec("\n".join(program), given)
    rates = eval(expression, given)
    assert isinstance(rates, BodyRates)
    assert shown.removeprefix("# ").startswith(f"{rates!r}:")


def test_a_recorded_flight_is_read(tmp_path, capsys):
    summary = fly(QuickVehicle(), tmp_path / "flown", hover={"duration_s": 0.5})
    assert summary.result == "ok"
    (block,) = blocks("docs/recordings.md")
    named = re.search(r'"(flights/[^"]+)"', block).group(1)
    exec(block.replace(named, str(tmp_path / "flown")), {})
    phase, count, latency = capsys.readouterr().out.split()
    assert (phase, int(count)) == (summary.facts.phases[-1][1], summary.counts.setpoints)
    assert float(latency) == 0.0  # in memory, time stands still while code runs


def test_a_program_of_ones_own_is_tested_as_the_page_on_serving_shows():
    (block,) = blocks("docs/serve.md")
    given = {}
    exec(block, given)
    given["test_it_is_answered"]()


def test_a_flight_of_ones_own_is_tested_as_the_page_on_python_shows(monkeypatch):
    monkeypatch.setattr(testing, "MockVehicle", QuickVehicle)
    (block,) = [block for block in blocks("docs/python.md") if "def test_" in block]
    flown = []

    async def my_program(vehicle):
        flown.append(vehicle.state.position_ned)
        await vehicle.land()

    given = {"my_program": my_program}
    exec(block, given)
    given["test_it_comes_back"]()
    assert len(flown) == 1


def test_the_cluster_of_the_page_on_campaigns_is_a_program():
    """It needs a cluster, and a package that is none of ours."""
    (block,) = blocks("docs/campaigns.md")
    compile(block, "docs/campaigns.md", "exec")


def test_no_page_has_a_block_that_nothing_runs():
    pages = [ROOT / "README.md", *ROOT.glob("docs/*.md")]
    counts = {
        p.relative_to(ROOT).as_posix(): p.read_text("utf-8").count("```python") for p in pages
    }
    assert {page: count for page, count in counts.items() if count} == {
        "README.md": 1,
        "docs/campaigns.md": 1,
        "docs/extending.md": 10,
        "docs/python.md": 3,
        "docs/recordings.md": 1,
        "docs/serve.md": 1,
        "docs/the-law.md": 1,
    }
