"""The catalogue is complete: each row has a named test or a reason, each mark a row."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.conftest import pytest_collection_modifyitems
from tests.faults.catalogue._rows import Row, rows
from tests.faults.catalogue._shown_by import ROOT, Showing, marked, showings
from tests.faults.catalogue._verdicts import Ends, Listener, judged
from tests.faults.catalogue.page import page

ROW = Row("F01", "late", "TCP", "a time-out", "another's value", "by the simulator")
SHOWING = Showing("tests/test_x.py", "test_f01_late", ("F01",), soak=False)


def test_the_rows_are_f01_to_f87_each_once():
    assert [row.id for row in rows()] == [f"F{number:02d}" for number in range(1, 88)]


def test_each_row_says_all_that_a_row_says():
    for row in rows():
        assert all((row.fault, row.layer, row.sees, row.never, row.injected)), row.id
        assert row.sees.endswith("."), row.id
        assert row.never.endswith("."), row.id


def test_each_row_has_a_test_named_after_it_or_a_reason():
    for row in rows():
        names = [s.test for s in showings() if row.id in s.faults]
        if row.not_run:
            assert names == [], f"{row.id} has tests, and a reason for having none"
        else:
            # One of them is found by the number; others may have names of their own.
            token = f"_{row.id.lower()}_"
            assert any(token in f"{name}_" for name in names), f"{row.id}: no test_{token[1:]}..."


def test_each_mark_and_each_name_leads_to_a_row():
    known = {row.id for row in rows()}
    for showing in showings():
        assert set(showing.faults) <= known, showing.node
        in_name = {p.upper() for p in showing.test.split("_") if p.upper() in known}
        assert in_name <= set(showing.faults), f"{showing.node}: name and marks differ"


def test_the_shipped_page_is_that_of_the_catalogue():
    shipped = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
    assert shipped == page(), "run: python -m tests.faults.catalogue.page > docs/faults.md"


def test_the_reference_calls_no_row_by_a_number_that_is_not_there():
    reference = (ROOT / "docs" / "reference" / "faults.md").read_text(encoding="utf-8")
    headings = [line.split()[1] for line in reference.splitlines() if line.startswith("### F")]
    assert set(headings) <= {row.id for row in rows()}


MARKED = """\
import pytest

@pytest.mark.parametrize("x", [1, pytest.param(2, marks=pytest.mark.fault("F02"))])
@pytest.mark.fault("F01", "F03")
def test_f01_something(x): ...

@pytest.mark.soak
@pytest.mark.fault("F04")
class TestMany: ...

def test_unmarked(): ...
"""


def read(source: str, folder: Path, monkeypatch) -> list[Showing]:
    monkeypatch.setattr("tests.faults.catalogue._shown_by.ROOT", folder)
    (folder / "test_x.py").write_text(source, encoding="utf-8")
    return list(marked(folder / "test_x.py"))


def test_marks_are_read_from_tests_their_parameters_and_classes(tmp_path, monkeypatch):
    function, whole = read(MARKED, tmp_path, monkeypatch)
    assert (function.test, set(function.faults)) == ("test_f01_something", {"F01", "F02", "F03"})
    assert (whole.faults, whole.soak, function.soak) == (("F04",), True, False)


def test_a_module_that_is_left_to_soak_is_said_to_be(tmp_path, monkeypatch):
    source = "pytestmark = pytest.mark.soak\n@pytest.mark.fault('F11')\ndef test_f11_x(): ...\n"
    (showing,) = read(source, tmp_path, monkeypatch)
    assert showing.soak


@pytest.mark.parametrize(
    "source",
    ["pytestmark = pytest.mark.fault('F01')", "@pytest.mark.fault(NUMBER)\ndef test_x(): ..."],
)
def test_a_mark_that_cannot_be_read_is_no_mark(source, tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=r"test_x\.py"):
        read(source, tmp_path, monkeypatch)


@pytest.mark.parametrize(
    ("ends", "word", "why"),
    [
        ({SHOWING.node: Ends(passed=2)}, "passed", ""),
        ({SHOWING.node: Ends(passed=2, failed=1)}, "FAILED", SHOWING.node),
        ({SHOWING.node: Ends(why_skipped=["no root"])}, "not run", "no root"),
        ({SHOWING.node: Ends(1, 0, ["no root"])}, "in part", "no root"),
        ({}, "not run", SHOWING.node),
    ],
)
def test_only_what_ran_and_passed_is_called_passed(ends, word, why):
    verdict = judged(ROW, [SHOWING], {"F01": ends})
    assert verdict.word == word
    assert why in verdict.why
    assert verdict.word in verdict.line


def test_a_row_whose_second_test_did_not_run_has_passed_in_part():
    other = Showing("tests/test_y.py", "test_other", ("F01",), soak=True)
    verdict = judged(ROW, [SHOWING, other], {"F01": {SHOWING.node: Ends(passed=1)}})
    assert (verdict.word, verdict.why) == ("in part", other.node)


def report(outcome, when="call", longrepr=None):
    return SimpleNamespace(
        nodeid=f"{SHOWING.node}[a]",
        user_properties=[("fault", "F01"), ("other", 1)],
        failed=outcome == "failed",
        skipped=outcome == "skipped",
        when=when,
        longrepr=longrepr,
    )


def test_a_column_for_real_hardware_takes_nothing_from_a_row_and_is_counted():
    listener = Listener()
    listener.pytest_runtest_logreport(report("passed"))
    reason = ("file", 1, "Skipped: no hardware: set ROBOLINK_EPSON_URL to a real controller")
    listener.pytest_runtest_logreport(report("skipped", "setup", reason))
    assert judged(ROW, [SHOWING], listener.ends).word == "passed"
    assert listener.ends["F01"][SHOWING.node].on_hardware == 1


def test_a_test_that_breaks_while_it_is_set_up_or_torn_down_has_failed():
    for when in ("setup", "teardown"):
        listener = Listener()
        listener.pytest_runtest_logreport(report("passed"))
        listener.pytest_runtest_logreport(report("failed", when))
        assert judged(ROW, [SHOWING], listener.ends).word == "FAILED"


def test_why_a_test_was_skipped_is_told():
    listener = Listener()
    listener.pytest_runtest_logreport(report("skipped", "setup", ("f", 1, "Skipped: no root")))
    assert judged(ROW, [SHOWING], listener.ends).why == f"{SHOWING.node}; no root"


def test_the_rows_travel_with_the_report_of_a_test():
    mark = SimpleNamespace(args=("F07", "F01"))
    item = SimpleNamespace(
        nodeid="test_x", user_properties=[], iter_markers={"fault": [mark]}.__getitem__
    )
    soaked = SimpleNamespace(option=SimpleNamespace(markexpr="fault and (soak or not soak)"))
    pytest_collection_modifyitems(soaked, [item])
    assert item.user_properties == [("fault", "F01"), ("fault", "F07")]
