"""The page about a served flight: `test_programs.py` flies one; here none can be written."""

from companion.serve.report_pages import ReportPages


def test_a_page_that_cannot_be_written_is_told_in_one_sentence(tmp_path):
    told = []
    pages = ReportPages(told.append)
    pages.write(tmp_path)
    pages.leave()
    pages.write(tmp_path)
    failed, left = told
    assert "is this the folder of a flight?" in failed
    assert "\n" not in failed
    assert failed.endswith(f"`companion report {tmp_path}` tries again")
    assert left.startswith("No report: interrupted; ")
