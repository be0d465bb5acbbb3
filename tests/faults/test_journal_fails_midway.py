"""The journal fails in the middle of a calibration: the earlier tool is restored all the same.

Its marker, which names the earlier tool and the old value, is stored before anything changes; so
restoring them needs no further record. What cannot be recorded stays open for ``recover``.
"""

from contextlib import contextmanager

import pytest
from robolink_cli.console.exit_codes import USAGE

from robolink.errors import JournalError
from robolink.journal.store.store import Store
from robolink.model import MarkerKind
from tests.faults._nozzle_cell import OLD_TIP, served_cell

DOUBT = 6


class Failing:
    """Counts the transactions of this process, and fails from one of them on."""

    def __init__(self, monkeypatch):
        self.count = 0
        self.first = None
        write = Store.write

        def counted(store, *told, **room):
            self.count += 1
            if self.first is not None and self.count >= self.first:
                what = "The journal cannot be used: the disk is full."
                raise JournalError(what, remedy=" ".join(("Free space.", *told)).strip())
            return write(store, *told, **room)

        monkeypatch.setattr(Store, "write", counted)

    @contextmanager
    def from_transaction(self, number):
        self.count, self.first = 0, number
        yield
        self.first = None


@pytest.fixture
def cell(tmp_path, monkeypatch):
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        assert cell.run("status").code == 0  # which stores the controller's identity
        yield cell, Failing(monkeypatch)


def check(cell, failing, number):
    with failing.from_transaction(number):
        shown = cell.run(*cell.calibration)
    assert cell.selected_tool == 1, number
    cell.check_settings_are_those_of_before()
    if shown.code != DOUBT:
        # Everything is as before, or the new value was tested and recorded; at most the marker of
        # the procedure could not be removed, and a journal that failed at its first record has none
        # of a controller that has a backup.
        assert shown.code == USAGE
        left = {marker.kind for marker in cell.open_markers()}
        assert left <= {MarkerKind.SELECTION, MarkerKind.HISTORY}
        if cell.tool_1 != OLD_TIP:
            assert "Tool 1 now holds" in shown.err
            assert cell.run("journal", "list", "--kind", "done").out.count(" done ") == 1
        return
    assert "cannot be used: the disk is full" in shown.err
    said = shown.err
    assert ("Tool 1 is selected." in said) or ("not confirmed" in said), said
    kept = cell.tool_1 != OLD_TIP
    if kept:
        # It was measured, verified and recorded before.
        assert "change of tool 1" not in [marker.request for marker in cell.open_markers()]
        assert "Tool 1 now holds" in said
    assert cell.open_markers() != ()
    # Its lease could not be released either; here the process lives on.
    assert cell.run("recover", "--take-over", "it has ended").code in (0, DOUBT)
    assert cell.selected_tool == 1
    assert (cell.tool_1 != OLD_TIP) == kept


@pytest.mark.parametrize(
    "number",
    [
        *(1, 17, 30, 37, 55),
        *(pytest.param(number, marks=pytest.mark.soak) for number in (4, 18, 28, 36, 53)),
    ],
)
def test_what_was_in_force_is_put_back_without_a_record(cell, number):
    nozzle_cell, failing = cell
    check(nozzle_cell, failing, number)


@pytest.mark.soak
def test_so_it_is_at_each_transaction(cell, tmp_path, monkeypatch):
    cell, failing = cell
    with failing.from_transaction(None):
        assert cell.run(*cell.calibration).code == 0
        count = failing.count
    for number in range(1, count + 1):
        with served_cell(tmp_path / str(number), monkeypatch) as fresh:
            assert fresh.run("status").code == 0
            check(fresh, failing, number)
    assert count > 50
