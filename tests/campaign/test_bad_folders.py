"""A campaign's folder with damaged or foreign files, and on a disk that takes no more."""

import errno
import json
import os
import shutil
from types import SimpleNamespace

import pyarrow
import pyarrow.parquet
import pytest

from companion.campaign import folder, store
from companion.campaign import rerun as again
from companion.campaign.report.results import Results
from companion.campaign.versions import versions
from companion.cli.main import main
from companion.files.yaml_file import ConfigError
from tests.campaign.test_campaign_file import load, row_of

TILT = {"limits.max_tilt_deg": [20, 25, 30]}


@pytest.fixture
def begun(tmp_path):
    """A campaign of three flights with a trajectory, and its folder; the last one is missing."""
    (tmp_path / "table.csv").write_text(
        "\n".join(["t,x,y,z", *(f"{0.5 * k},{0.2 * k},0,0" for k in range(9))])
    )
    (tmp_path / "path.yaml").write_text("csv: {file: table.csv, frame: enu}\n")
    campaign = load(tmp_path, sweep=TILT, set={"flight.trajectory": "path.yaml"})
    out = tmp_path / "out"
    folder.make(out, campaign, folder.describe(campaign, 1, None))
    for case in list(campaign.cases())[:2]:
        store.write_unit(out, campaign.file, case.index, [row_of(case)], {})
    return campaign, out


def test_what_was_begun_can_be_gone_on_with(begun):
    campaign, out = begun
    assert folder.resume(out, campaign).cases == 3
    assert store.finished_units(out) == {0, 1}


@pytest.mark.parametrize(
    "told",
    [
        "",
        "{",
        "[]",
        "7",
        "{}",
        '{"versions": {}}',
        {"unit": 0},
        {"unit": "all"},
        {"cases": -1},
        {"cases": None},
        {"unit": 1.5},
        {"further": 1},
    ],
)
def test_a_damaged_description_is_one_sentence(begun, told, capsys):
    _, out = begun
    path = out / "campaign.json"
    whole = json.loads(path.read_text())
    path.write_text(told if isinstance(told, str) else json.dumps({**whole, **told}))
    for command in (["campaign", str(out)], ["campaign", "rerun", str(out), "0"]):
        assert main(command) == 2
        assert capsys.readouterr().err == (
            f"companion: {path} is damaged; start the campaign again with another --out\n"
        )


def test_unknown_versions_are_other_versions(begun, capsys):
    _, out = begun
    path = out / "campaign.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "versions": {}}))
    assert main(["campaign", str(out)]) == 2
    assert "was begun by another version: this one has companion " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "words"), [("- 1\n", "is damaged"), ("a: [", "campaign.yaml: "), (None, "campaign")]
)
def test_a_damaged_campaign_file_is_refused(begun, text, words):
    campaign, out = begun
    path = out / folder.CAMPAIGN_FILE_NAME
    path.unlink() if text is None else path.write_text(text)
    with pytest.raises(ConfigError, match=words):
        folder.resume(out, campaign)


@pytest.mark.parametrize("damage", ["changed", "gone", "no text"])
def test_another_trajectory_is_another_campaign(begun, damage):
    campaign, out = begun
    table = out / "trajectories" / "path" / "table.csv"
    if damage == "gone":
        table.unlink()
    else:
        table.write_bytes(table.read_bytes() + (b"4.5,2,0,0\n" if damage == "changed" else b"\xff"))
    with pytest.raises(ConfigError, match=r"another campaign: trajectories/path/table\.csv differ"):
        folder.resume(out, campaign)


def test_only_the_limits_on_its_size_may_change(begun, tmp_path):
    _campaign, out = begun
    told = {"sweep": TILT, "set": {"flight.trajectory": "path.yaml"}}
    folder.resume(out, load(tmp_path, **told, limits={"max_hours": 9.0, "max_cases": 7}))
    with pytest.raises(ConfigError, match="another campaign: limits differ"):
        folder.resume(out, load(tmp_path, **told, limits={"flight_s": 9.0}))


def test_a_folder_that_holds_other_files_or_is_none_is_refused(begun, tmp_path):
    campaign, _ = begun
    description = folder.describe(campaign, 1, None)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").write_text("mine")
    with pytest.raises(ConfigError, match="holds files, but no campaign;"):
        folder.make(tmp_path / "other", campaign, description)
    assert [path.name for path in (tmp_path / "other").iterdir()] == ["notes.txt"]
    below = tmp_path / "table.csv" / "below"
    with pytest.raises(ConfigError, match="cannot be written: Not a directory"):
        folder.make(below, campaign, description)
    with (
        pytest.raises(ConfigError, match="cannot be written: Not a directory"),
        folder.lock(below),
    ):
        pass


def test_a_page_that_cannot_be_written_is_wrong_usage(begun, tmp_path, capsys):
    _campaign, out = begun
    page = tmp_path / "missing" / "page.html"
    assert main(["campaign", "report", str(out), "--out", str(page)]) == 2
    assert f"{page}: cannot write there: No such file" in capsys.readouterr().err


def test_results_that_cannot_be_read_are_named(begun, capsys):
    campaign, out = begun
    path = store.unit_file(out, 1)
    whole = path.read_bytes()
    metadata_size = int.from_bytes(whole[-8:-4], "little")
    blank_metadata = whole[: -8 - metadata_size] + bytes(metadata_size) + whole[-8:]
    for damaged in (whole[: len(whole) // 2], blank_metadata):
        path.write_bytes(damaged)
        assert main(["campaign", "report", str(out)]) == 2
        (said,) = capsys.readouterr().err.splitlines()
        assert f"{path}: cannot be read: " in said
        assert "; delete this file and continue the campaign" in said
    with pytest.raises(ConfigError, match=r"unit-00001.*cannot be read"):
        again._stored_row(out, campaign, SimpleNamespace(unit=1), 1)
    pyarrow.parquet.write_table(pyarrow.table({"a": [1]}), path)
    with pytest.raises(ConfigError, match="holds files of different campaigns"):
        store.read(out)
    other = store.schema(campaign.file).metadata
    pyarrow.parquet.write_table(pyarrow.table({"a": [1]}).replace_schema_metadata(other), path)
    with pytest.raises(ConfigError, match="holds files of different campaigns"):
        store.read(out)
    pyarrow.parquet.write_table(pyarrow.table({"a": [1]}), path)
    store.unit_file(out, 0).unlink()
    with pytest.raises(ConfigError, match="holds files of different campaigns"):
        Results.read(out)
    path.unlink()
    with pytest.raises(ConfigError, match="there are no results"):
        store.read(out)


def test_a_full_disk_leaves_no_torn_unit(begun, monkeypatch):
    campaign, out = begun
    (case,) = list(campaign.cases())[2:]

    sync, synced = os.fsync, []

    def full(descriptor):
        synced.append(descriptor)
        if len(synced) == 3:  # after the timing and its folder
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"unit-00002\.parquet|No space left"):
        store.write_unit(out, campaign.file, 2, [row_of(case)], {})
    assert store.finished_units(out) == {0, 1}
    assert not list((out / "results").glob(".unit-*"))


def test_the_tables_of_a_report_are_whole_or_not_there(begun, monkeypatch, tmp_path):
    from companion.campaign.report import page  # noqa: PLC0415  slow to import

    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        page.write_tables(pyarrow.table({"a": [1]}), tmp_path)
    assert not list(tmp_path.glob("*results*"))


def test_a_case_flown_again_is_compared_with_its_row(begun, monkeypatch):
    _, out = begun
    monkeypatch.setattr(again, "fly_case", lambda case, _: row_of(case))
    for case, said in (
        (1, "bit-identical to the campaign's flight: digest d1."),
        (2, "has not flown this case yet."),
    ):
        found = again.rerun(out, case)
        assert found.identical
        assert found.lines[0] == f"case {case} (limits.max_tilt_deg = {20 + 5 * case}): good"
        assert found.lines[-1].endswith(said)
    bad = {"ok": False, "failed_checks": "touchdown", "digest": "other"}
    monkeypatch.setattr(again, "fly_case", lambda case, _: row_of(case) | bad)
    path = out / "campaign.json"
    told = json.loads(path.read_text())
    path.write_text(json.dumps({**told, "versions": {**versions(), "numpy": "1.0"}}))
    found = again.rerun(out, 0)
    assert not found.identical
    judged, version, differs = found.lines
    assert judged.endswith("not good: touchdown")
    assert version.startswith("The campaign was flown by another version: this one has numpy")
    assert differs == "This flight differs from the campaign's flight in ok, failed_checks, digest."


def test_a_batch_has_no_flight_to_repeat(tmp_path):
    steps = {"flight.maneuvers": ["corners"], "planner.name": "exact"}
    campaign = load(tmp_path, kind="batch", set=steps, sweep=TILT)
    out = tmp_path / "out"
    folder.make(out, campaign, folder.describe(campaign, 1, None))
    with pytest.raises(ConfigError, match="the kind `batch` has no flights to record"):
        again.rerun(out, 0)
    shutil.rmtree(out)
    with pytest.raises(ConfigError, match="no campaign was begun here"):
        again.rerun(out, 0)
