"""`make real` goes on where it was, the most important flights first."""

from collections import Counter

from tests.real import campaign
from tests.real.campaign import MOCK_SETS, NEAR, SETS, STRAIGHT, already_flown, missing, planned


def rows(vehicle, *flights, **more):
    return [{"vehicle": vehicle, "airframe": "stock", "flight": name, **more} for name in flights]


def test_each_flight_once_before_any_comes_again_and_medians_before_the_rest():
    flights = planned("px4", list(SETS), 3)
    repeated = [*STRAIGHT, *NEAR, *SETS["nmpc"]]
    assert flights[:16] == 2 * repeated
    assert flights[24:27] == SETS["identify"]
    assert flights.index("ten") > flights.index("corners90:euler")


def test_px4s_simulator_has_no_turbulence_and_the_mock_vehicle_flies_what_it_can():
    assert "circle5@wind" not in planned("px4", list(SETS), 1)
    assert "circle5@wind" in planned("ardupilot", list(SETS), 1)
    flown = planned("mock-ardupilot", list(SETS), 3)
    assert {flight for flight, times in Counter(flown).items() if times == 3} == {*STRAIGHT, *NEAR}
    assert set(flown) == {flight for name in MOCK_SETS for flight in SETS[name]}


def test_what_was_flown_to_its_end_is_not_flown_again(tmp_path):
    file = tmp_path / "vehicle.yaml"
    file.touch()
    known = [
        *rows("px4", "corners400", "corners400", "hover"),
        *rows("px4", "corners90", error="it stood still"),
        *rows("px4", "identify", file=str(file)),
        *rows("px4", *["ten"] * 9),
        *rows("ardupilot", "corners90"),
        *rows("px4", "corners90", airframe="heavy"),
    ]
    held = already_flown(known, "px4")
    assert held.identified == file
    left = missing(planned("px4", ["straight", "identify", "ends"], 2), held.counts)
    assert left == ["corners90", "corners90", *SETS["identify"][1:], "ten"]
    assert already_flown(rows("px4", *["ten"] * 10), "px4").counts["ten"] == 1


def test_the_sets_are_those_of_the_page(request):
    page = (request.config.rootpath / "docs" / "real-autopilots.md").read_text()
    assert f"a part: {', '.join(SETS)}" in page
    assert set(campaign.REPEATED) < set(SETS)
