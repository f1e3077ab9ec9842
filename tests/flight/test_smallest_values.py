"""What the configuration accepts, the vehicle can be flown with."""

import pytest

from companion.config import Config
from tests.flight.fly import fly, mock_vehicle


def smallest(section, key):
    """The smallest value that the schema accepts."""
    schema = Config.model_json_schema()
    reference = schema["properties"][section]["$ref"].rpartition("/")[2]
    field = schema["$defs"][reference]["properties"][key]
    return next(each["minimum"] for each in (field, *field.get("anyOf", ())) if "minimum" in each)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    ("section", "key"),
    [("limits", "max_tilt_rate_deg_s"), ("guidance", "disturbance_bandwidth_rad_s")],
)
def test_a_hover_in_a_light_wind_holds_its_place(autopilot, section, key):
    """With less, it swung or drifted by metres, though every check had passed."""
    with mock_vehicle(autopilot=autopilot, wind={"speed_m_s": 2.0, "gust_m_s": 0.5}) as mock:
        few = {section: {key: smallest(section, key)}, "hover": {"duration_s": 10.0}}
        summary = fly(mock, flight={"takeoff_height_m": 4.0}, **few)
    assert summary.result == "ok", summary.events
    assert summary.tracking()["position_max_m"] < 0.8
