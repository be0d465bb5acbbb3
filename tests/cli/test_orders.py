"""--order on clear, restore, undo and backup: once, however often delivered (row F79).

``test_serve`` has it on ``tool set``, tests/faults what ends an order otherwise.
"""

import json
from pathlib import Path

import pytest

import robolink
from robolink.journal import open_journal
from robolink.model import EntryKind, ToolOffset
from robolink.transaction import Wanted, change_tools

OLD, OTHER = ToolOffset(12.0, -3.5, -20.0), ToolOffset(13.0, -3.5, -20.0)
ORDER = ("--order", "A-17", "--yes")
SAVE = ("tool", "backup", "kept.json", "--order", "A-17")


def soak(job):
    return pytest.param(job, marks=pytest.mark.soak)


@pytest.fixture
def cell(run, simulator):
    """A cell with a backup, and three tools changed since by a change each."""
    simulator.machine.tools.set(1, OLD)
    simulator.machine.tools.select(1)
    assert run("tool", "backup", "golden.json")[0] == 0
    with robolink.connect(simulator.url) as controller:
        for tool, offset in ((2, ToolOffset(1)), (1, OTHER), (3, ToolOffset(3))):
            change_tools(controller, [Wanted(tool, offset, controller.tools.read(tool))])
        controller.tools.select(2)
    simulator.machine.motors_on = True
    return simulator


JOBS = {
    "clear": ("tool", "clear", "3", *ORDER),
    "clear the selected": ("tool", "clear", "2", "--then-select", "1", *ORDER),
    "restore": ("tool", "restore", "golden.json", "--selected", *ORDER),
    "restore one": ("tool", "restore", "golden.json", "--tool", "1", *ORDER),
    "undo": ("undo", *ORDER),
}


def state(simulator):
    tools = simulator.machine.tools
    return (
        [tools.get(number) for number in range(1, 4)],
        tools.selected,
        simulator.machine.flash_writes,
    )


@pytest.mark.fault("F79")
@pytest.mark.parametrize("job", [soak("clear"), "clear the selected", "restore", "undo"])
def test_f79_a_second_delivery_writes_nothing_and_reports_the_first_result(run, cell, job):
    before = state(cell)
    code, out, err = run(*JOBS[job], "--json")
    assert code == 0, err
    first, left, entries = json.loads(out), state(cell), open_journal().count()
    assert left != before
    assert (first["order"], first["already_done"]) == ("A-17", False)
    code, out, err = run(*JOBS[job], "--json")
    assert (code, json.loads(out)) == (0, {**first, "already_done": True}), err
    assert "Nothing was moved or written now" in run(*JOBS[job])[1]
    assert (state(cell), open_journal().count()) == (left, entries)


@pytest.mark.fault("F79")
def test_f79_an_undo_that_is_delivered_again_does_not_undo_the_change_before(run, cell):
    """The newest change is another one by then."""
    for _ in range(3):
        assert run(*JOBS["undo"])[0] == 0
    assert state(cell)[0] == [OTHER, ToolOffset(1), None]
    assert run("undo", "--order", "A-18", "--yes")[0] == 0
    assert state(cell)[0][2] == ToolOffset(3), "an undo can be undone, by an order of its own"
    code, _, err = run(*JOBS["undo"])
    assert (code, "Order A-17 was undone" in err) == (2, True)


@pytest.mark.fault("F79")
def test_f79_where_nothing_differs_an_order_is_carried_out_too(run, cell):
    restore = ("tool", "restore", "golden.json", "--tool", "4")
    written = state(cell)
    for already in (False, True):
        code, out, err = run(*restore, *ORDER, "--json")
        assert (code, json.loads(out)["already_done"]) == (0, already), err
    assert state(cell) == written
    assert run("undo", "--yes")[0] == run("undo", "--yes")[0] == 0
    back = next(e.number for e in open_journal().entries(kinds=(EntryKind.DONE,)))
    for already in (False, True):
        code, out, err = run("undo", "--to", str(back), "--order", "A-19", "--yes", "--json")
        assert (code, json.loads(out)["already_done"]) == (0, already), err


@pytest.mark.fault("F79")
def test_f79_a_restore_that_only_selects_is_an_order_too(run, cell):
    assert run("tool", "set", "1", "--x", "12", "--yes")[0] == 0
    select = ("tool", "restore", "golden.json", "--tool", "1", "--selected", *ORDER)
    code, _, err = run(*select)
    assert code == 0, err
    assert state(cell)[1] == 1
    assert run(*select)[0] == 0
    assert run("tool", "select", "2", "--yes")[0] == 0
    code, _, err = run(*select)
    assert (code, "left tool 1 selected; tool 2 is" in " ".join(err.split())) == (5, True), err


@pytest.mark.fault("F79")
def test_f79_the_same_name_with_other_values_in_it_is_another_job(run, cell):
    assert run(*JOBS["restore one"])[0] == 0
    file = Path("golden.json")
    file.write_text(file.read_text().replace('"x_mm": 12.0', '"x_mm": 14.0'))
    held = state(cell)
    code, _, err = run(*JOBS["restore one"])
    assert (code, "for another job" in err) == (2, True)
    assert state(cell) == held


@pytest.mark.fault("F79")
def test_f79_a_restore_is_one_change_and_one_undo_takes_it_back(run, cell):
    before = state(cell)
    assert run("tool", "restore", "golden.json", "--yes", "--selected")[0] == 0
    assert state(cell)[0] == [OLD, None, None]
    assert run("undo", "--yes")[0] == 0
    assert state(cell)[0] == before[0]


@pytest.mark.fault("F79")
def test_f79_a_backup_is_saved_once(run, cell):
    code, out, err = run(*SAVE, "--json")
    assert code == 0, err
    first, saved = json.loads(out), Path("kept.json").read_bytes()
    assert run("tool", "set", "1", "--x", "14", "--yes")[0] == 0
    code, out, err = run(*SAVE, "--json")
    assert (code, json.loads(out)) == (0, {**first, "already_done": True}), err
    assert Path("kept.json").read_bytes() == saved
    assert run("tool", "compare", "kept.json")[0] == 1


@pytest.mark.fault("F79")
@pytest.mark.parametrize("change", [soak("gone"), "changed"])
def test_f79_a_backup_whose_file_is_not_there_as_it_was_is_refused_by_name(run, cell, change):
    assert run(*SAVE)[0] == 0
    file = Path("kept.json").absolute()
    content = file.read_bytes()
    file.unlink()
    if change == "changed":
        file.write_bytes(content.replace(b"13.0", b"13.5"))
    code, _, err = run(*SAVE)
    assert (code, str(file) in err.replace("\n  ", " ")) == (2, True), err
    assert "Give a new order" in " ".join(err.split())
    assert run("tool", "backup", "other.json", "--order", "A-18")[0] == 0


@pytest.mark.fault("F79")
def test_f79_a_backup_that_could_not_be_saved_is_not_saved_by_a_second_delivery(run, cell):
    """Its file was another's; once that is away, nobody has asked for it anew."""
    Path("kept.json").write_text("mine")
    assert run(*SAVE)[0] == 2
    Path("kept.json").unlink()
    code, _, err = run(*SAVE)
    assert (code, "exists already" in " ".join(err.split())) == (2, True), err
    assert not Path("kept.json").exists()


@pytest.mark.fault("F79")
@pytest.mark.parametrize("job", [soak("clear"), "restore", soak("undo")])
def test_f79_what_was_refused_is_not_carried_out_by_a_second_delivery(run, cell, job):
    cell.panel.open_guard()
    held = state(cell)
    assert run(*JOBS[job])[0] == 5
    cell.panel.close_guard()
    code, _, err = run(*JOBS[job])
    assert (code, "Order A-17 ended on" in err) == (5, True), err
    assert state(cell) == held


@pytest.mark.fault("F79")
@pytest.mark.parametrize("job", [soak("clear"), "restore", soak("undo")])
def test_f79_a_dry_run_carries_out_no_order(run, cell, job):
    code, _, err = run(*JOBS[job][:-1], "--dry-run")
    assert (code, "A dry run carries out no order" in err) == (2, True)
    assert not list(open_journal().entries(kinds=(EntryKind.ORDER,)))
