"""The benchmark of other programs on the link: it counts what is lost, and tells ratios."""

from pymavlink.dialects.v20 import common as dialect

from companion.bench import serve
from companion.bench.client_program import FrameCounter


def test_missing_frames_are_counted():
    autopilot, other = dialect.MAVLink(None, 1, 1), dialect.MAVLink(None, 1, 191)
    beat = dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3)
    counter = FrameCounter()
    for sequence in (254, 255, 0, 3):
        autopilot.seq = sequence
        counter.count_frames(beat.pack(other) + beat.pack(autopilot))
    assert (counter.received, counter.lost) == (4, 2)


def test_three_clients_lose_nothing_while_a_fourth_is_stopped():
    figures = serve.run(1.0, 100.0, as_json=True)
    assert set(figures["ratio"]) == {"p50", "p99"}
    for key in ("alone", "with_clients"):
        assert figures[key]["samples"] == 100
        assert figures[key]["unanswered"] < 50
        assert 0.0 < figures[key]["p50_us"] <= figures[key]["p99_us"]
    assert len(figures["clients"]) == 3
    for counts in figures["clients"]:
        assert counts["received"] > 100 * 6, "a sample and five messages beside it"
        assert counts["lost"] == 0
