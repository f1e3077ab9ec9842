"""A flight heeds what the doctor finds: it refuses what is unsafe, unless that is accepted."""

from tests.flight.fly import fly, mock_vehicle


def test_what_is_unsafe_is_refused_before_arming_or_accepted_by_name():
    told = {}
    with mock_vehicle(parameters={"COM_OF_LOSS_T": 5.0}) as mock:
        refused = fly(mock)
        assert not mock.state()["armed"]
        accepted = fly(mock, None, flight={"accept": ["COM_OF_LOSS_T"]}, hover={"duration_s": 0.5})
    for name, summary in (("refused", refused), ("accepted", accepted)):
        told[name] = [text for _, text in summary.events]
    assert (refused.phase, accepted.phase, accepted.result) == ("checks", "disarm", "ok")
    assert refused.result.startswith("COM_OF_LOSS_T is 5: when setpoints stop")
    assert refused.result.endswith("set COM_OF_LOSS_T to 0.75")
    assert "unsafe, but accepted by flight.accept: " + refused.result in told["accepted"]
    assert (
        "preflight warnings: COM_LOW_BAT_ACT, planner.name; `companion doctor` says what to set, "
        "docs/troubleshooting.md explains each" in told["accepted"]
    )
    # The checks before arming make some of these findings again.
    assert sum(text.startswith("preflight warnings: ") for text in told["accepted"]) == 1
