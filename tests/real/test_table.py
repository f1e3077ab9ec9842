"""The page is made from rows alone, and its ratios are those of truths."""

from tests.real import table
from tests.real.build import ROOT


def steps(vehicle, truth, **more):
    cross = {"reported": 0.01, "telemetry": 0.01, "truth": truth, "attitude_late_ms": 1.0}
    row = {"vehicle": vehicle, "airframe": "stock", "flight": "corners400", "planner": "exact"}
    return {**row, "cross_axis": cross, "load": "0.5 0.4 0.3", **more}


def cells(page, vehicle):
    (line,) = (line for line in page.splitlines() if line.startswith(f"| {vehicle} |"))
    return [cell.strip() for cell in line.split("|")[1:-1]]


def by_column(page, vehicle):
    return dict(zip(cells(page, "vehicle"), cells(page, vehicle), strict=True))


def test_medians_and_the_ratio_to_the_mock():
    rows = [steps("px4", truth) for truth in (0.004, 0.006, 0.02)] + [steps("mock-px4", 0.005)]
    row = by_column(table.markdown(rows), "px4")
    assert "along" not in row  # a column that is empty in all rows is left out
    assert (row["truth"], row["flown"], row["mock"], row["ratio"]) == (
        "0.0060",
        "3",
        "0.0050",
        "1.20",
    )


def test_another_airframe_is_another_vehicle():
    rows = [steps("px4", 0.01, airframe="unlike"), steps("mock-px4", 0.005)]
    page = table.markdown(rows)
    assert "ratio" not in by_column(page, "px4 unlike")
    both = table.markdown([*rows, steps("px4", 0.01)])
    assert by_column(both, "px4 unlike")["ratio"] == ""
    assert by_column(both, "px4")["ratio"] == "2.00"


def test_a_variant_is_a_figure_of_its_own_and_failures_are_listed():
    part = {
        "telemetry": {"rms": 0.07},
        "truth": {"rms": 0.08, "late_ms": 3.0},
        "estimator": {"rms": 0.05},
    }
    row = {
        "vehicle": "ardupilot", "airframe": "stock", "flight": "circle5@wind", "planner": "exact",
        "load": "0.5", "reported": {"position_rms_m": 0.1}, "tracking": {"circle5": part},
    }  # fmt: skip
    page = table.markdown([row, {**row, "tracking": {}, "error": "no GPS"}])
    assert cells(page, "ardupilot")[1] == "circle5@wind"
    assert "- ardupilot, circle5@wind (load 0.5): no GPS" in page


def test_what_identify_found_is_shown_with_its_spread():
    rows = [
        {
            "vehicle": "px4", "airframe": "stock", "flight": "identify", "load": "0.5",
            "roll": {"lag_ms": lag, "dead_time_ms": 40.0},
        }
        for lag in (46.0, 48.0, 49.0)
    ]  # fmt: skip
    rows.append({**rows[0], "roll": None, "error": "refused"})
    assert cells(table.markdown(rows), "px4")[1:] == [
        "roll", "48.0 (46.0 to 49.0)", "40.0 (40.0 to 40.0)", "3 of 4"
    ]  # fmt: skip


def test_the_page_is_put_between_its_marks_in_the_docs():
    docs = (ROOT / "docs" / "real-autopilots.md").read_text()
    once = table.with_page(docs, "first")
    assert "\nfirst\n" in once
    assert table.with_page(once, "second") == once.replace("\nfirst\n", "\nsecond\n")
