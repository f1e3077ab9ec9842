"""Make a configuration in Python: check it, see what it changes, and write it as a YAML file.

A configuration from any source is checked as a whole. A wrong key or value raises a `ConfigError`
whose text says what is wrong, where, and what was probably meant.

Run: python examples/configure_in_code.py   (writes indoor.yaml)
"""

from pathlib import Path

from companion.config import Config
from companion.config.files import changed
from companion.files import bounded_yaml
from companion.files.yaml_file import ConfigError

INDOOR = {
    "limits": {"max_tilt_deg": 15.0, "fence_radius_m": 3.0, "fence_ceiling_m": 2.5},
    "flight": {"takeoff_height_m": 1.5, "maneuvers": ["hover"]},
}
config = changed(Config(), INDOOR, "indoor limits")
print(f"fence: {config.limits.fence_radius_m} m, tilt: {config.limits.max_tilt:.3f} rad")
Path("indoor.yaml").write_text(bounded_yaml.dump(INDOOR), encoding="utf-8")
print("written: indoor.yaml; see `companion config --diff indoor.yaml`")

for wrong in ({"limits": {"max_tilt": 15.0}}, {"limits": {"max_tilt_deg": "steep"}}):
    try:
        changed(config, wrong, "an example of a mistake")
    except ConfigError as error:
        print(f"refused: {error}")
