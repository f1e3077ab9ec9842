"""What `companion plot` draws, and what it refuses in one sentence, without a traceback."""

import json
import warnings
from dataclasses import replace
from importlib.util import find_spec
from math import nan

import numpy as np
import pytest

from companion.cli.main import main
from companion.recording.flight_record import RecordError
from companion.recording.mcap_file.channels import MOTION
from companion.recording.mcap_file.fields import CDR_HEADER
from companion.recording.mcap_file.loop_channels import SAMPLE, SETPOINT
from companion.recording.mcap_file.writer import McapWriter
from companion.recording.measurements.recorded_summary import _REQUIRED_KEYS
from companion.report import PictureError
from companion.report.early_end import EarlyEndMark
from companion.report.flight_data import Curve, FlightData, Span
from companion.report.picture import draw_flight
from companion.report.picture_history import PANEL_HEIGHTS, draw_history

pytestmark = pytest.mark.skipif(find_spec("matplotlib") is None, reason="no Matplotlib")

TIME = 0.1 * np.arange(100.0)
FLIGHT = FlightData(
    "a flight",
    {
        "motion": Curve(TIME, np.column_stack((0.5 * TIME, np.full(100, 1.5), np.full(100, 20.0)))),
        "error": Curve(TIME, np.full((100, 1), 0.3)),
        "reference": Curve(TIME, np.where(TIME[:, None] < 6.0, np.ones(3), nan)),
    },
    phases=(
        *(Span(0.0, 0.05, "connect"), Span(0.05, 3.0, "checks")),
        *(Span(3.0, 5.0, "takeoff"), Span(5.0, 8.2, "maneuvers")),
    ),
    maneuvers=(Span(5.0, 6.0, "hover"), Span(6.0, 8.2, "steps")),
    early_end=EarlyEndMark(8.2, "the vehicle is 9.1 m away, which costs $100"),
)
WHOLE = {
    **dict.fromkeys(_REQUIRED_KEYS),
    "result": "too far away",
    "early_end": {"time_s": 8.2, "monitor": None},
}


def record(folder, *, steps=False, motion=False, gain="5.0", largest=2.0, summary=None):
    """A folder with a step north, ten seconds of motion, or both."""
    writer = McapWriter(folder / "flight.mcap")
    writer.metadata("flight", {"began_s": "0.0", "epoch_s": "0.0", "gain_per_s": gain})
    for k in range(15 * steps):
        time = 0.004 * k
        numbers = {"received_s": time, "vehicle_time_s": time, "q_w": 1.0, "target_north": 0.1}
        for channel, codes in ((SAMPLE, {}), (SETPOINT, {"is_step": 1})):
            columns = (*channel.numbers, *channel.codes)
            row = [{**numbers, **codes}.get(column.name, 0) for column in columns]
            writer.message(channel.topic, k, channel.packing.pack(CDR_HEADER, *row))
    for k in range(100 * motion):
        row = (0.1 * k, nan, 0.05 * k, 1.0, largest, nan)
        writer.message("/motion", k, MOTION.packing.pack(CDR_HEADER, *row))
    writer.close()
    (folder / "summary.json").write_text(json.dumps(summary))


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        ({"largest": 1e300}, "motion: not a valid record of a flight: a number is above 1e+09"),
        ({"gain": "0"}, "damaged .*division by zero"),
        ({"gain": "x"}, "damaged .*could not convert"),
        ({"summary": {**WHOLE, "early_end": {"monitor": None, "time_s": None}}}, "damaged"),
        ({"summary": {**WHOLE, "early_end": 3}}, "damaged .*rename its summary.json"),
    ],
)
def test_files_that_no_flight_writes_are_refused(tmp_path, broken, words):
    record(tmp_path, **{"steps": True, "motion": True, "summary": WHOLE, **broken})
    with pytest.raises(RecordError, match=words.replace("+", r"\+")):
        draw_flight(tmp_path, tmp_path / "out.png")


def test_a_folder_without_a_flight_is_refused(tmp_path):
    with pytest.raises(RecordError, match="is this the folder of a flight"):
        draw_flight(tmp_path, tmp_path / "out.png")
    record(tmp_path, summary=WHOLE)
    with pytest.raises(PictureError, match="no flight with anything to draw"):
        draw_flight(tmp_path, tmp_path / "out.png")


def test_each_panel_has_its_curve_its_unit_and_all_marks():
    from matplotlib import pyplot  # noqa: PLC0415  takes a third of a second, in every worker

    figure, panels = pyplot.subplots(len(PANEL_HEIGHTS), 1)
    try:
        draw_history(panels, FLIGHT)
        labels = [axes.get_ylabel() for axes in panels]
        assert labels == ["tracking error, m", "speed, m/s", "tilt, °", "height, m"]
        assert panels[-1].get_xlabel() == "time since the flight began, s"
        shown = (("error", 0), ("motion", 1), ("motion", 2), ("motion", 0))
        for axes, (name, column) in zip(panels, shown, strict=True):
            (curve,) = [line for line in axes.lines if len(line.get_xdata()) == len(TIME)]
            assert curve.get_ydata().tolist() == FLIGHT.curves[name].values[:, column].tolist()
            assert len(axes.patches) == 2  # both maneuvers
            assert sum(list(line.get_xdata()) == [8.2, 8.2] for line in axes.lines) == 1
        names = [text.get_text() for text in panels[0].texts]
        assert names == ["hover", "steps (open loop)"]
        assert panels[0].get_title() == (
            r"ended at 8.2 s: the vehicle is 9.1 m away, which costs \$100"
        )
        phases = [text.get_text().strip() for text in panels[-1].texts]
        assert phases == ["connect, checks", "takeoff", "maneuvers"]
    finally:
        pyplot.close(figure)


def test_a_panel_without_a_value_says_so_instead_of_an_axis_of_negative_errors():
    """A flight that ended before the takeover has no tracking error."""
    from matplotlib import pyplot  # noqa: PLC0415

    unknown = {"error": Curve(TIME, np.full((100, 1), nan))}
    for curves in ({**FLIGHT.curves, **unknown}, {"motion": FLIGHT.curves["motion"]}):
        figure, panels = pyplot.subplots(len(PANEL_HEIGHTS), 1)
        try:
            draw_history(panels, replace(FLIGHT, curves=curves))
            assert "not measured" in [text.get_text() for text in panels[0].texts]
            assert [len(axes.get_yticks()) > 0 for axes in panels] == [False, True, True, True]
        finally:
            pyplot.close(figure)


def test_a_damaged_record_is_drawn_and_its_fault_told(tmp_path, capsys):
    record(tmp_path, motion=True, summary=WHOLE)
    path = tmp_path / "flight.mcap"
    path.write_bytes(path.read_bytes()[:-400])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main(["plot", str(tmp_path)]) == 1
    told, written = capsys.readouterr().out.splitlines()
    assert "before its flight did: it was cut off" in told
    assert written == str(tmp_path / "flight.png")


@pytest.mark.parametrize("kept", [("motion",), ("steps",), ("motion", "steps")])
def test_a_flight_is_drawn_with_what_it_recorded(tmp_path, kept):
    record(tmp_path, **dict.fromkeys(kept, True), summary=WHOLE if "steps" in kept else {})
    draw_flight(tmp_path, tmp_path / "out.png")
    assert (tmp_path / "out.png").read_bytes()[:4] == b"\x89PNG"


def test_the_drawing_has_the_name_it_is_given_also_without_a_suffix(tmp_path, capsys):
    record(tmp_path, motion=True, summary=WHOLE)
    out = tmp_path / "drawing"
    assert main(["plot", str(tmp_path), "--out", str(out)]) == 0
    assert out.read_bytes()[:4] == b"\x89PNG"
    assert main(["plot", str(tmp_path), "--out", str(tmp_path)]) == 2  # it was `FOLDER.png`
    assert f"{tmp_path}: cannot write it: Is a directory" in capsys.readouterr().err


def test_a_reason_that_is_too_long_is_cut():
    import matplotlib  # noqa: PLC0415  an extra

    matplotlib.use("Agg")
    from matplotlib.figure import Figure  # noqa: PLC0415

    axes = list(Figure().subplots(len(PANEL_HEIGHTS), sharex=True))
    draw_history(axes, replace(FLIGHT, early_end=EarlyEndMark(8.2, "x" * 500)))
    title = axes[0].get_title()
    assert title.startswith("ended at 8.2 s: xxx")
    assert title.endswith("xxx…")
    assert len(title) < 140
