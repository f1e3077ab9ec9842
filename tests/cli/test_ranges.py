"""Numbers, lists and texts of files have bounds: a huge limit would switch its monitor off."""

import pytest

from companion.config import Config
from companion.files.yaml_file import ConfigError, parse
from companion.preflight.parameter_fixes import UndoContents
from companion.study.custom_case import Case

_BELOW = {"minimum", "exclusiveMinimum"}
_ABOVE = {"maximum", "exclusiveMaximum"}


def leaves(schema, node, place):
    """Every simple value that a schema describes, with where it stands."""
    if "$ref" in node:
        yield from leaves(schema, schema["$defs"][node["$ref"].rpartition("/")[2]], place)
    for key in ("anyOf", "oneOf", "allOf"):
        for part in node.get(key, ()):
            yield from leaves(schema, part, place)
    yield place, node
    for name, part in node.get("properties", {}).items():
        yield from leaves(schema, part, f"{place}.{name}")
    for part in (*node.get("prefixItems", ()), *filter(None, [node.get("items")])):
        yield from leaves(schema, part, f"{place}[]")
    if isinstance(node.get("additionalProperties"), dict):
        yield from leaves(schema, node["additionalProperties"], f"{place}.*")


@pytest.mark.parametrize("model", [Config, Case, UndoContents])
def test_every_value_has_bounds(model):
    schema = model.model_json_schema()
    seen = 0
    for place, node in leaves(schema, schema, model.__name__):
        kind = node.get("type")
        if kind in ("number", "integer"):
            assert _BELOW & node.keys(), f"{place} has no smallest value"
            assert _ABOVE & node.keys(), f"{place} has no largest value"
        elif kind == "string":
            assert {"enum", "const", "maxLength"} & node.keys(), f"{place} may have any length"
        elif kind == "array":
            assert "maxItems" in node, f"{place} may have any number of items"
        else:
            continue
        seen += 1
    assert seen > 4


@pytest.mark.parametrize(
    "key",
    [
        "max_body_rate_deg_s",
        "tilt_margin_deg",
        "max_reset_m",
        "max_reset_deg",
        "max_speed_m_s",
        "max_tracking_error_m",
        "max_loss",
        "max_missed",
        "max_starved",
        "max_round_trip_ms",
    ],
)
@pytest.mark.parametrize("value", ["1.0e+308", "-1.0e+308", ".inf", "9999999"])
def test_a_monitor_cannot_be_switched_off_by_a_huge_limit(key, value):
    with pytest.raises(ConfigError, match=f"`safety.{key}`"):
        parse(f"safety: {{{key}: {value}}}", "c.yaml", Config)


def test_the_widest_tilt_that_can_be_asked_for_is_still_watched():
    """max_tilt_deg + tilt_margin_deg stays below the 180° that no tilt exceeds."""
    limits = Config.model_json_schema()["$defs"]
    widest = limits["LimitsConfig"]["properties"]["max_tilt_deg"]["maximum"]
    margin = limits["SafetyConfig"]["properties"]["tilt_margin_deg"]["maximum"]
    assert widest + margin <= 120.0
