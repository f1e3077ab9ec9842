"""Compare planners on one vehicle: which one flies straight steps behind a real rate loop?

Each planner flies the corners of the paper's figure 2 on the mock vehicle, whose rate loop is as
slow as PX4's. The program prints the largest distance from the straight line of a step. In the
ideal case of `batch_study.py` the paper's law flies straight; here only the planner that predicts
the rate loop does.

Run: python examples/compare_planners.py
"""

from companion.config.files import changed, load, shipped
from companion.testing import MockVehicle, fly

PX4 = shipped("mock-px4.yaml")
CORNERS = {
    "flight": {"maneuvers": ["corners"]},
    "corners": {"north_coefficient": 0.4, "east_coefficient": 0.5, "settle_s": 1.0},
    "limits": {"max_tilt_deg": 45.0, "max_tilt_rate_deg_s": 400.0},
    "safety": {"max_body_rate_deg_s": 700.0},
}
for name in ("first-order", "model-following"):  # or any of companion.attitude.PLANNER_NAMES
    config = changed(load(PX4), {**CORNERS, "planner": {"name": name}}, "corners")
    summary = fly(config, MockVehicle(config=PX4))
    off = summary.response().cross_axis_max
    print(f"{name:<16} leaves its straight lines by {off:.4f}  {summary.result}")
