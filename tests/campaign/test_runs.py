"""A run of a campaign on Dask: lost units, other versions, no worker yet, interruptions."""

import errno
import logging
import os
import re
import signal
import tempfile
import threading
from contextlib import contextmanager

import pytest

from companion.campaign import (
    cluster,
    engine,
    estimate,
    flight,
    folder,
    running,
    store,
    unit,
)
from companion.campaign.cluster import ClusterError
from companion.campaign.engine import Progress
from companion.campaign.versions import VersionError, _version, versions
from companion.cli.main import main
from companion.files.yaml_file import ConfigError
from companion.program_command import program_command
from tests.campaign.test_campaign_file import load, row_of, written

TILT = {"limits.max_tilt_deg": [20, 25, 30]}


@pytest.fixture
def on_dask(connected, monkeypatch):
    """Lets campaigns run on this worker; their flights take no time."""

    monkeypatch.setattr(running, "cluster_client", connected)
    monkeypatch.setattr(unit, "fly_case", row_of)


def test_a_unit_that_is_given_up_is_told_and_can_be_gone_on_with(
    tmp_path, on_dask, monkeypatch, capsys
):
    def fly(case):
        if case.index == 1:
            raise RuntimeError("[oops]")
        return row_of(case)

    monkeypatch.setattr(unit, "fly_case", fly)
    file, out = written(tmp_path, sweep=TILT), tmp_path / "out [bold] of it"
    monkeypatch.setattr(running, "usable_cores", lambda: 2)
    command = ["campaign", str(file), "--out", str(out)]
    assert main([*command, "--scheduler", "tcp://192.0.2.1:8786"]) == 1
    told = capsys.readouterr().out
    assert f"3 flights; results in {out}\n" in told
    assert "not flown: unit 1 (cases 1 to 1): RuntimeError: [oops]\n" in told
    assert (
        "1 unit of cases could not be flown; the results of 2 of 3 flights are kept. "
        "Continue with\n"
        f"  {program_command()} campaign '{out}' --scheduler tcp://192.0.2.1:8786\n"
    ) in told
    monkeypatch.setattr(unit, "fly_case", row_of)
    assert main(["campaign", str(out)]) == 0
    told = capsys.readouterr().out
    assert "3 of 3 flights were good.\n" in told
    assert f"The results are in {out}. Write their report with\n" in told
    assert f"  {program_command()} campaign report '{out}'\n" in told


@pytest.mark.parametrize("error", [ConfigError("a case is wrong"), VersionError("the worker is")])
def test_a_refusal_of_a_worker_ends_the_run(tmp_path, on_dask, monkeypatch, capsys, error):
    def fly(_):
        raise error

    monkeypatch.setattr(unit, "fly_case", fly)
    file = written(tmp_path, sweep=TILT)
    assert main(["campaign", str(file), "--out", str(tmp_path / "out"), "--workers", "2"]) == 2
    assert capsys.readouterr().err == f"companion: {error}\n"


def test_a_worker_of_another_version_flies_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(unit, "fly_case", lambda _: pytest.fail("it flew"))
    campaign = load(tmp_path, sweep=TILT)
    other = {**versions(), "numpy": "1.0"}
    with pytest.raises(
        VersionError, match=r"^the worker this process has numpy .* instead of 1\.0"
    ):
        unit.fly_planned_cases(campaign, list(campaign.planned_cases()), other)
    with pytest.raises(VersionError, match=r"^the worker this process has numpy"):
        unit.fly_cases("flights", list(campaign.cases()), other)


def test_cases_without_a_folder_come_back_in_order_or_not_at_all(
    tmp_path, dask, on_dask, monkeypatch
):
    cases = list(load(tmp_path, sweep=TILT).cases())
    rows = engine.run_on_cluster(dask, "flights", cases, 0.1)
    assert [row["case"] for row in rows] == [0, 1, 2]
    monkeypatch.setattr(unit, "fly_case", lambda _: 1 / 0)
    with pytest.raises(ClusterError, match="not be flown: ZeroDivisionError: division by zero"):
        engine.run_on_cluster(dask, "flights", cases, 0.1)


def test_endings_with_a_fault_are_counted(tmp_path, on_dask, monkeypatch, capsys):
    fault = {"inject": [{"kind": "stop_telemetry"}], "ends": ["held"]}
    monkeypatch.setattr(
        unit, "fly_case", lambda case: row_of(case) | {"as_documented": case.index == 0}
    )
    file = written(
        tmp_path, sweep={"fault": ["lost", "gone"]}, faults={"lost": fault, "gone": fault}
    )
    assert main(["campaign", str(file), "--out", str(tmp_path / "out")]) == 0
    assert "1 of 2 flights with a fault ended as documented.\n" in capsys.readouterr().out


def test_more_cases_than_a_few_are_measured_and_shared_out(tmp_path, on_dask, monkeypatch, capsys):
    monkeypatch.setattr(estimate, "case_time", lambda *_: 0.5)
    file, out = written(tmp_path, sweep=TILT), tmp_path / "out"
    assert main(["campaign", str(file), "--out", str(out), "--workers", "1"]) == 0
    assert "3 flights, about 1.5 s with 1 worker; results in" in capsys.readouterr().out
    assert folder.read_description(out).case_s == 0.5
    file = written(tmp_path, sweep=TILT, limits={"max_cases": 2})
    out = tmp_path / "again"
    assert main(["campaign", str(file), "--out", str(out), "--workers", "1", "--yes"]) == 0
    assert "3 of 3 flights were good" in capsys.readouterr().out


def test_a_case_is_measured_by_some_cases_and_never_by_its_first_run(tmp_path, monkeypatch):
    ran, now = [], [0.0]

    def run(kind, cases):
        ran.append([(case.index, case.flight_s) for case in cases])
        now[0] += 100.0 if len(ran) == 1 else 2.0 * len(cases)

    monkeypatch.setattr(estimate, "run_cases", run)
    monkeypatch.setattr(estimate, "perf_counter", lambda: now[0])
    cases = list(load(tmp_path, samples=3, sweep=TILT).cases())
    usual = cases[0].flight_s
    assert estimate.case_time("flights", cases) == 2.0
    assert ran == [[(0, 1.0)], [(0, usual), (4, usual), (8, usual)]]
    ran.clear()
    planners = {"planner.name": ["exact", "so3"]}
    cases = list(load(tmp_path, samples=100, sweep=planners).cases())
    assert estimate.case_time("batch", cases) == 2.0
    assert [index for index, _ in ran[0]] == list(range(0, 128, 2))
    assert ran[0] == ran[1]


def test_a_cluster_without_a_worker_is_waited_for(tmp_path, dask, on_dask, monkeypatch, capsys):
    counts = [0]
    monkeypatch.setattr(running, "number_of_workers", lambda _: counts.pop() if counts else 1)
    waited = []
    monkeypatch.setattr(running, "wait_for_workers", waited.append)
    file = written(tmp_path, sweep=TILT)
    assert main(["campaign", str(file), "--out", str(tmp_path / "out"), "--workers", "2"]) == 0
    assert waited == [dask]
    assert "waiting for the cluster's first worker…\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("error", "said"),
    [(KeyboardInterrupt(), "interrupted"), (ClusterError("lost [x]"), "lost [x]")],
)
def test_a_run_that_ends_before_it_began_says_so(tmp_path, monkeypatch, capsys, error, said):
    @contextmanager
    def connected(*_):
        raise error
        yield

    monkeypatch.setattr(running, "cluster_client", connected)
    file = written(tmp_path, sweep=TILT)
    assert main(["campaign", str(file), "--out", str(tmp_path / "out"), "--workers", "2"]) == 1
    assert capsys.readouterr().out == f"{said}; no campaign was started\n"


def test_a_folder_takes_no_out(tmp_path, capsys):
    assert main(["campaign", str(tmp_path), "--out", str(tmp_path / "other")]) == 2
    assert "leave it out" in capsys.readouterr().err


def test_sigterm_ends_a_campaign_like_ctrl_c_and_a_second_one_is_ignored():
    before = signal.getsignal(signal.SIGTERM)
    ended = []
    try:
        with running.interruptible():
            try:
                signal.raise_signal(signal.SIGTERM)
            except KeyboardInterrupt:
                signal.raise_signal(signal.SIGTERM)
                signal.raise_signal(signal.SIGINT)
                ended.append("in order")
                raise
    except KeyboardInterrupt:
        ended.append("interrupted")
    assert ended == ["in order", "interrupted"]
    assert signal.getsignal(signal.SIGTERM) == before


def test_the_reason_of_a_lost_unit_is_a_sentence():
    assert cluster._failure_reason(ValueError("x")) == "ValueError: x"
    from distributed import KilledWorker  # noqa: PLC0415  slow to import

    died = KilledWorker("a task", None, [])
    assert cluster._failure_reason(died).startswith("every worker that flew these cases died, ")
    with pytest.raises(ConfigError, match="bad key"):
        cluster._failure_reason(ConfigError("bad key"))


class Gone:
    """A future of a scheduler that is lost."""

    status = "finished"

    def result(self):
        from distributed.client import FutureCancelledError  # noqa: PLC0415  slow to import

        raise FutureCancelledError("x", "lost")


def test_a_lost_scheduler_is_no_lost_unit():
    with pytest.raises(ClusterError, match="the connection to the Dask scheduler is lost"):
        cluster._ended_unit(0, Gone())
    Gone.status = "cancelled"
    with pytest.raises(ClusterError, match="the connection to the Dask scheduler is lost"):
        cluster._ended_unit(0, Gone())


def test_a_scheduler_that_does_not_answer_is_wrong_usage(monkeypatch):
    monkeypatch.setattr(cluster, "_CONNECT_TIMEOUT_S", 0.2)
    for address in ("tcp://127.0.0.1:1", "nothing://x"):
        with (
            pytest.raises(ConfigError, match=f"no Dask scheduler answers at {address}"),
            cluster.cluster_client(address, None),
        ):
            pass


class Asked:
    """A client whose workers tell these versions."""

    def __init__(self, worker, distributed="1"):
        self.worker, self.distributed = worker, distributed

    def get_versions(self):
        host = {"python": "3.11.7.final.0"}
        return {
            "client": {"host": host, "packages": {"distributed": "1"}},
            "scheduler": {"host": host, "packages": {"distributed": self.distributed}},
        }

    def run(self, function, on_error):
        assert on_error == "return"
        return {"tcp://w": self.worker}


def test_a_cluster_of_other_versions_is_refused_before_anything_is_flown():
    cluster._compare_versions(Asked(versions()))
    with pytest.raises(VersionError, match=r"^the Dask scheduler has distributed 2 instead of 1"):
        cluster._compare_versions(Asked(versions(), distributed="2"))
    with pytest.raises(VersionError, match=r"^the worker tcp://w has numpy 1\.0 instead of"):
        cluster._compare_versions(Asked({**versions(), "numpy": "1.0"}))
    with pytest.raises(VersionError, match=r"^the worker tcp://w cannot run this version .*no mod"):
        cluster._compare_versions(Asked(ModuleNotFoundError("no module")))


@pytest.mark.timeout(120)
def test_our_own_workers_ignore_ctrl_c_and_end_with_the_run():
    with cluster.cluster_client(None, 1) as client:
        assert cluster.number_of_workers(client) == 1
        cluster.wait_for_workers(client)
        (ended,) = cluster.run_tasks(client, {7: (signal.pthread_sigmask, signal.SIG_BLOCK, [])})
        assert ended.number == 7
        assert signal.SIGINT in ended.result
        (ended,) = cluster.run_tasks(client, {8: (os.getpid,)})
        assert ended.result != os.getpid()
    with pytest.raises(ProcessLookupError):
        os.kill(ended.result, 0)


def test_progress_counts_what_earlier_runs_flew(tmp_path, dask, on_dask, capsys):
    campaign, out = load(tmp_path, sweep=TILT), tmp_path / "out"
    description = folder.describe(campaign, 2, None)
    folder.make(out, campaign, description)
    shown = [each.flown_cases for each in engine.run(dask, campaign, description, out)]
    assert shown[0] == 0
    assert sorted(shown[1:])[-1] == 3
    assert list(engine.run(dask, campaign, description, out)) == [Progress(flown_cases=3)]


def test_a_termination_waits_until_the_cluster_is_made():
    handled = []
    before = signal.signal(signal.SIGTERM, lambda *_: handled.append("ended"))
    try:
        with cluster._termination_deferred():
            signal.raise_signal(signal.SIGTERM)
            assert handled == []
        assert handled == ["ended"]
    finally:
        signal.signal(signal.SIGTERM, before)


def test_outside_the_main_thread_signals_are_left_alone():
    before, seen = signal.getsignal(signal.SIGTERM), []

    def work():
        with cluster._termination_deferred():
            seen.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]


def test_a_new_campaign_has_a_folder_with_its_name_and_time_and_tells_of_few_samples(
    tmp_path, on_dask, monkeypatch, capsys
):
    file = written(tmp_path, sweep={"mock.wind.speed_m_s": {"uniform": [2, 6]}}, samples=1)
    monkeypatch.chdir(tmp_path)
    assert main(["campaign", str(file), "--workers", "2"]) == 0
    (out,) = (tmp_path / "runs" / "campaigns").iterdir()
    assert re.fullmatch(r"test-\d{4}-\d\d-\d\dT\d\d-\d\d-\d\dZ", out.name)
    told = capsys.readouterr().out
    assert (
        "with samples: 1 the campaign flies only one value of mock.wind.speed_m_s; raise samples"
        in told
    )


def test_lists_and_truths_are_columns_of_their_own_kind(tmp_path):
    campaign = load(
        tmp_path,
        sweep={
            "flight.maneuvers": [["hover"], ["hover", "circle"]],
            "flight.slow_down": [True, False],
        },
    )
    rows = [row_of(case) for case in campaign.cases()]
    table = store.table(campaign.file, rows)
    assert table["flight.maneuvers"].to_pylist() == [
        "hover",
        "hover",
        "hover,circle",
        "hover,circle",
    ]
    assert table["flight.slow_down"].to_pylist() == [True, False] * 2
    assert str(table.schema.field("flight.slow_down").type) == "bool"


def test_a_package_that_is_not_there_is_a_version_too():
    assert _version("no-such-package") == "not installed"
    assert _version("numpy")[0].isdigit()


def test_only_the_loggers_of_dask_are_silenced():
    dasks, other = logging.getLogger("distributed.of_a_test"), logging.getLogger("of_a_test")
    other.setLevel(logging.INFO)
    cluster._silence_dask()
    assert not dasks.isEnabledFor(logging.CRITICAL)
    assert other.level == logging.INFO


def test_a_case_keeps_its_files_where_dask_removes_those_of_a_killed_worker(
    tmp_path, dask, monkeypatch
):
    """Each worker that was killed or interrupted in a flight left a folder in /tmp."""

    monkeypatch.setattr(flight, "fly_in", lambda place, *_: {"folder": str(place.parent)})
    case = next(load(tmp_path, sweep=TILT).cases())
    row = dask.submit(flight.fly_case, case, pure=False).result()
    [worker_folder] = dask.run(lambda dask_worker: dask_worker.local_directory).values()
    assert row["folder"] == worker_folder
    assert flight.fly_case(case)["folder"] == tempfile.gettempdir()


def test_a_full_disk_says_how_to_go_on(tmp_path, on_dask, monkeypatch, capsys):
    """It said that there was no space left, and nothing about the flights that were kept."""

    def write_unit(place, *_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(place / "x"))

    monkeypatch.setattr(store, "write_unit", write_unit)
    out = tmp_path / "out"
    file = written(tmp_path, sweep=TILT)
    assert main(["campaign", str(file), "--out", str(out), "--workers", "2"]) == 1
    assert (
        f"{out / 'x'}: No space left on device; the results of 0 of 3 flights are kept. Continue "
        f"with\n  {program_command('campaign', out)}\n"
    ) in capsys.readouterr().out
