"""A configuration made in Python is refused with the words of a file, not those of pydantic."""

import pickle
from inspect import signature

import pytest

from companion.config import Config
from companion.config.limits import LimitsConfig
from companion.files.yaml_file import ConfigError


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Config(limits={"max_tilt_deg": 90.0}), "Config: `limits.max_tilt_deg`.* 60 .*90"),
        (lambda: Config(limits={"max_tilt": 20.0}), "`limits.max_tilt`.*did you mean `max_tilt_d"),
        (lambda: Config(limit={}), "^Config: `limit` is not a known key; did you mean `limits`"),
        (
            lambda: LimitsConfig(max_tilt_deg="20"),
            "^LimitsConfig: `max_tilt_deg` .* 20 without quo",
        ),
        (lambda: LimitsConfig(min_thrust=0.95), "^LimitsConfig: min_thrust must be below max_thr"),
        (lambda: Config(limits={"max_tilt_deg": 10**400}), "`limits.max_tilt_deg`"),
        (lambda: Config(hover=LimitsConfig()), "`hover` is a section"),
    ],
)
def test_what_python_gives_is_refused_as_in_a_file(make, said):
    with pytest.raises(ConfigError, match=said) as error:
        make()
    assert "pydantic" not in str(error.value)


def test_faults_of_several_sections_are_told_together():
    with pytest.raises(ConfigError, match=r"`limits.max_tilt_deg`.*; `hover.duration_s`"):
        Config(limits={"max_tilt_deg": -1.0}, hover={"duration_s": -1.0})


def test_a_good_one_is_made_kept_and_described_as_before():
    config = Config(limits=LimitsConfig(max_tilt_deg=20.0), hover={"duration_s": 3.0})
    assert (config.limits.max_tilt_deg, config.hover.duration_s) == (20.0, 3.0)
    assert pickle.loads(pickle.dumps(config)) == config
    assert "max_tilt_deg" in signature(LimitsConfig).parameters
