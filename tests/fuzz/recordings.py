"""Files of others: recordings, undo files, tables of figures. Refused in a sentence, or read.

The commands `identify --log`, `plot` and `export` are called as a user calls them.
"""

import contextlib
import io
import struct
import tempfile
import warnings
from pathlib import Path
from typing import Any

from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.cli.main import main
from companion.files.yaml_file import ConfigError, load
from companion.preflight.parameter_fixes import UndoContents
from companion.recording.mcap_file import cdr
from companion.recording.mcap_file.channels import CHANNELS
from companion.recording.mcap_file.fields import CDR_HEADER
from companion.recording.mcap_file.writer import McapWriter
from tests.fuzz.configuration import one_sentence
from tests.fuzz.target import Case, Target
from tests.fuzz.texts import folder_of, mutated, scalars

_RECORDINGS = Path(__file__).parents[1] / "mavlink" / "recordings"


def _check(case: Case) -> None:
    files = {name: text for name, text in case.items() if name not in ("tlog", "mcap")}
    with folder_of(files) as folder:
        if "tlog" in case:
            (folder / "flight.tlog").write_bytes(bytes.fromhex(case["tlog"]))
            _command("identify", "--log", folder / "flight.tlog", "--out", folder / "v.yaml")
        if "undo.yaml" in case:
            with contextlib.suppress(ConfigError):
                load(folder / "undo.yaml", UndoContents)
        if "mcap" in case:
            (folder / "flight.mcap").write_bytes(bytes.fromhex(case["mcap"]))
            _command("plot", folder)
            _command("export", folder, "--csv")


def _command(*arguments: Any) -> None:
    """Run a command: it says what is wrong in a line, and warns of nothing."""
    errors = io.StringIO()
    with (
        contextlib.redirect_stderr(errors),
        contextlib.redirect_stdout(io.StringIO()),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("error")
        warnings.simplefilter("default", ResourceWarning)  # of what other tests left behind
        code = main([str(argument) for argument in arguments])
    said = errors.getvalue()
    assert code in (0, 1, 2), code
    assert "internal error" not in said, said[:2000]
    if code == 2:
        one_sentence(said)


# --- cases

_TLOGS = [path.read_bytes()[:12_000] for path in sorted(_RECORDINGS.glob("*.tlog"))]


@st.composite
def _mutated_tlog(draw: Any) -> bytes:
    return _damaged(draw, draw(st.sampled_from(_TLOGS)))


def _damaged(draw: Any, whole: bytes) -> bytes:
    """Bytes that are cut off, changed, left out or inserted."""
    data = bytearray(whole)
    del data[draw(st.integers(0, len(data))) :]
    for _ in range(draw(st.integers(0, 6))):
        at = draw(st.integers(0, max(0, len(data) - 1)))
        match draw(st.sampled_from(("set", "cut", "insert"))):
            case "set":
                data[at : at + 1] = draw(st.binary(min_size=1, max_size=4))
            case "cut":
                del data[at : at + draw(st.integers(1, 300))]
            case _:
                data[at:at] = draw(st.binary(max_size=30))
    return bytes(data)


_floats = st.one_of(
    st.floats(-3.0, 3.0, width=32),
    st.floats(width=32),
    st.sampled_from((float("nan"), float("inf"), 3.4e38, -3.4e38, 1e-40, 0.0)),
)
_stamps = st.one_of(st.none(), st.integers(0, 2**32 - 1))


@st.composite
def _flown_tlog(draw: Any) -> bytes:
    """A flight by rates, with odd values and stamps here and there."""
    mav, companion = dialect.MAVLink(None, 1, 1), dialect.MAVLink(None, 1, 191)
    records: list[bytes] = []

    def add(message: Any, sender: Any = mav) -> None:
        records.append(struct.pack(">Q", 10**15 + 1000 * len(records)) + message.pack(sender))

    count = draw(st.sampled_from((3, 30, 200, 400)))
    period = draw(st.sampled_from((1, 4, 20, 400, 2_000_000)))
    odd = draw(st.dictionaries(st.integers(0, count), st.tuples(_stamps, _floats), max_size=5))
    size = draw(_floats)
    for k in range(count):
        stamp, value = odd.get(k, (None, size if k % 7 < 4 else -size))
        time = (k * period if stamp is None else stamp) & 0xFFFFFFFF
        if k % 10 == 0:
            add(dialect.MAVLink_heartbeat_message(2, 12, 157, 0x00060000, 4, 3))
        add(dialect.MAVLink_attitude_quaternion_message(time, 1, 0, 0, 0, value, size, value))
        add(dialect.MAVLink_highres_imu_message(time * 1000, 0, 0, value, *(0,) * 10, 0))
        target = dialect.MAVLink_set_attitude_target_message(
            time, 1, 1, 128, [1, 0, 0, 0], value, size, -value, abs(value)
        )
        add(target, companion)
    return b"".join(records)


_undo = (
    "autopilot: PX4\nsystem: 1\nuid: '0000000000000007'\ntime: '2026-01-01T00:00:00+00:00'\n"
    "parameters:\n  COM_OF_LOSS_T: 1.0\n  MPC_THR_HOVER: 0.5\n"
)


@st.composite
def _undo_text(draw: Any) -> str:
    keys = ("autopilot", "system", "uid", "time", "parameters")
    lines = [f"{key}: {draw(scalars)}" for key in keys if draw(st.booleans())]
    return "\n".join(lines) + "\n"


_SUMMARIES = st.sampled_from(
    (
        '{"gain_per_s": 5.0}',
        "[]",
        "{}",
        "{",
        '{"gain_per_s": 5.0, "phases": 3, "maneuvers": []}',
        '{"phases": [], "maneuvers": [], "early_end": {"time_s": 1e999}, "result": ""}',
        '{"gain_per_s": 5.0, "phases": [{"time_s": 1, "name": "$a"}], "result": "$_{",'
        ' "maneuvers": [{"name": "", "begin_s": 2, "duration_s": -1, "open_loop": 1}],'
        ' "early_end": {"time_s": 1e8}}',
    )
)


def _record(rows: list[list[float]], gain: str) -> bytes:
    """A `flight.mcap` whose channels of numbers have these rows, as far as they are wide."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.mcap"
        writer = McapWriter(path)
        writer.metadata("flight", {"began_s": "0.0", "epoch_s": "0.0", "gain_per_s": gain})
        writer.message("/phase", 0, cdr.fields_message((0.0,), ("connect", "a heartbeat")))
        for number, row in enumerate(rows):
            for channel in CHANNELS:
                values = (row * len(channel.numbers))[: len(channel.numbers)]
                data = channel.packing.pack(
                    CDR_HEADER, *values, *(number % 2,) * len(channel.codes)
                )
                writer.message(channel.topic, number, data)
        writer.close()
        return path.read_bytes()


@st.composite
def _records(draw: Any) -> bytes:
    """A recorded flight with odd numbers, or one whose bytes are damaged."""
    row = st.lists(st.one_of(_floats, st.floats(-1.0, 1.0)), min_size=1, max_size=9)
    gain = draw(st.sampled_from(("5.0", "0", "nan", "", "1e999")))
    data = _record(draw(st.lists(row, max_size=4)) * draw(st.sampled_from((1, 1, 5))), gain)
    return _damaged(draw, data) if draw(st.booleans()) else data


_tables = st.fixed_dictionaries(
    {"mcap": _records().map(bytes.hex)}, optional={"summary.json": _SUMMARIES}
)
_tlogs = st.one_of(_flown_tlog(), _flown_tlog(), _mutated_tlog(), st.binary(max_size=100))
_cases = st.one_of(
    _tlogs.map(lambda data: {"tlog": data.hex()}),
    _tlogs.map(lambda data: {"tlog": data.hex()}),
    st.one_of(mutated(st.just(_undo)), _undo_text()).map(lambda text: {"undo.yaml": text}),
    _tables,
)

TARGET = Target("recordings", _cases, _check, seconds=10.0)
