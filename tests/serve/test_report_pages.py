"""The page about a served flight: `test_programs.py` flies one; here none can be written."""

import subprocess

from companion.program_command import program_command
from companion.serve import report_pages
from companion.serve.report_pages import ReportPages


def test_a_page_that_cannot_be_written_is_told_in_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(
        report_pages, "_lower_priority", lambda pid: None
    )  # the computer may be busy
    pages = ReportPages()
    failed = pages.write(tmp_path)
    pages.stop()
    left = pages.write(tmp_path)
    assert "is this the folder of a flight?" in failed
    assert "\n" not in failed
    assert failed.endswith(f"`{program_command('report', tmp_path)}` tries again")
    assert left.startswith("No report: interrupted; ")


class Hung:
    """A process that no signal ends, as on a disk that hangs."""

    pid, killed = 0, 0

    def __init__(self, meanwhile):
        self._meanwhile = meanwhile

    def communicate(self, timeout):
        self._meanwhile()
        raise subprocess.TimeoutExpired("companion report", timeout)

    def kill(self):
        self.killed += 1


def test_a_process_that_cannot_be_killed_is_not_waited_for(tmp_path, monkeypatch):
    told = []
    pages = ReportPages()
    monkeypatch.setattr(report_pages, "_lower_priority", lambda pid: None)
    monkeypatch.setattr(report_pages, "_PAGE_TIMEOUT", 0.0)
    hung, left = Hung(lambda: None), Hung(pages.stop)
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: [hung, left][len(told)])
    told.append(pages.write(tmp_path))
    told.append(pages.write(tmp_path))
    assert told[0].startswith("No report: the page was not written within 0 s; ")
    assert told[1].startswith("No report: interrupted; ")
    assert hung.killed >= 1
    assert left.killed >= 1
