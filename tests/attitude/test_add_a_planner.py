"""A planner without memory is added in two files: its law, and one line in the registry."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import companion

LAW = '''
"""Rates straight towards the target, as the linearised attitude has them."""


def small_angle(q, target, dt, constants):
    """Body rates p·(error of the coefficients), for small tilts at heading 0."""
    w, x, y, z = q
    north, east, heading, heading_rate = target
    return constants.gain * (east - 2.0 * x), -constants.gain * (north + 2.0 * y), heading_rate
'''

USE = """
import json
from companion import batch
from companion.attitude import LAW_NAMES, make_planner
from companion.config import Config
from companion.config.files import changed

planner = make_planner("small-angle", gain=4.0)
q, target = (1.0, 0.0, 0.0, 0.0), (0.1, 0.2, 0.0, 0.3)
print(json.dumps({
    "flown": planner.rates(q, target, 0.004),
    "mapped": batch.rates(planner, [[x] for x in q], [[x] for x in target], 0.004, compiled=False)
    .ravel().tolist(),
    "is_law": "small-angle" in LAW_NAMES,
    "configured": changed(Config(), {"planner": {"name": "small-angle"}}, "test").planner.name,
}))
"""


def test_a_new_law_is_flown_mapped_and_configured_by_its_file_and_the_registry(tmp_path):
    copy = tmp_path / "companion"
    skipped = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(companion.__file__).parent, copy, ignore=skipped)
    (copy / "attitude" / "small_angle.py").write_text(LAW, encoding="utf-8")
    registry = copy / "attitude" / "planner.py"
    text = registry.read_text(encoding="utf-8")
    for before, added in (
        ("from companion.attitude.types", "from companion.attitude.small_angle import small_angle"),
        ('    "euler": euler,', '    "small-angle": small_angle,'),
    ):
        assert text.count(before) == 1
        text = text.replace(before, f"{added}\n{before}")
    registry.write_text(text, encoding="utf-8")
    told = subprocess.run(
        [sys.executable, "-c", USE], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert told.returncode == 0, told.stderr
    found = json.loads(told.stdout)
    assert found["flown"] == found["mapped"] == [0.8, -0.4, 0.3]
    assert found["is_law"]
    assert found["configured"] == "small-angle"
