"""An undo is a change of its own: it expects the tested values, and writes all tools or none."""

import pytest

from robolink.errors import (
    ConfigError,
    NotAllowedError,
    OutcomeUnknownError,
    ToolChangedError,
    ToolError,
)
from robolink.model import EntryKind, Marker, MarkerKind, PersonRole, ToolOffset
from robolink.timing import local_label
from robolink.transaction import ToolChange, Wanted, change_tools, plan_undo, undo
from tests.unit._transaction_cell import NEW, OLD, OTHER, UNDEFINED, tool_cell, wanted

THIRD = ToolOffset(12.5, -3.0, -20.0)


@pytest.fixture
def cell():
    with tool_cell() as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connected() as controller:
        yield controller
        assert controller.outcomes.change == ""


def test_without_a_name_the_newest_change_is_undone_with_all_its_tools(cell, controller):
    change_tools(controller, wanted(1, 2))
    plan = plan_undo(controller)
    assert cell.writes == 2
    done = undo(controller, plan)
    assert cell.tools == OLD
    assert [receipt.tool for receipt in done.receipts] == [1, 2]
    ends = cell.entries(EntryKind.DONE)
    assert {entry.change for entry in ends[-2:]} == {done.change}


def test_an_undo_can_itself_be_undone(cell, controller):
    change_tools(controller, wanted(1))
    undo(controller, plan_undo(controller))
    undo(controller, plan_undo(controller))
    assert cell.tools == {1: NEW[1], 2: OLD[2]}


def test_a_tool_that_was_undefined_is_cleared_again(cell, controller):
    change_tools(controller, [Wanted(UNDEFINED, OTHER, None)])
    plan = plan_undo(controller)
    assert plan.steps[0].requested is None
    undo(controller, plan)
    assert cell.simulator.machine.tools.get(UNDEFINED) is None
    undo(controller, plan_undo(controller))
    assert cell.simulator.machine.tools.get(UNDEFINED) == OTHER


def test_one_tool_of_a_change_can_be_chosen(cell, controller):
    change_tools(controller, wanted(1, 2))
    undo(controller, plan_undo(controller, tool=2))
    assert cell.tools == {1: NEW[1], 2: OLD[2]}
    undo(controller, plan_undo(controller, tool=1))
    assert cell.tools == OLD


def test_undoing_an_older_change_says_that_later_ones_go_too(cell, controller):
    change_tools(controller, wanted(1))
    first = cell.entries()[-1].change
    change_tools(controller, [Wanted(1, THIRD, NEW[1])])
    plan = plan_undo(controller, change=first)
    assert ["changed again later" in remark for remark in plan.remarks] == [True]
    assert plan_undo(controller).remarks == ()
    undo(controller, plan)
    assert cell.tools == OLD


def test_any_value_that_was_proved_can_come_back(cell, controller):
    change_tools(controller, wanted(1))
    proof = cell.entries(EntryKind.READ_BACK)[0].number
    change_tools(controller, [Wanted(1, THIRD, NEW[1])])
    undo(controller, plan_undo(controller, to=proof))
    assert cell.tools[1] == NEW[1]
    assert cell.entries(EntryKind.DECISION)[-1].details["back_to_entry"] == proof


def test_a_value_that_somebody_else_wrote_is_left_alone_and_told_with_time_and_distance(
    cell, controller
):
    change_tools(controller, wanted(1))
    cell.put(1, OTHER)
    with pytest.raises(ToolChangedError) as caught:
        plan_undo(controller)
    left_at = cell.entries(EntryKind.DONE)[-1].at
    assert local_label(left_at) in caught.value.what
    assert "mm away" in caught.value.what
    assert "TLSet" in caught.value.what
    assert cell.tools[1] == OTHER


def test_a_value_that_changes_after_the_question_stops_all_of_it(cell, controller):
    change_tools(controller, wanted(1, 2))
    plan = plan_undo(controller)
    cell.put(2, OTHER)
    written = cell.writes
    with pytest.raises(ToolChangedError):
        undo(controller, plan)
    assert cell.tools == {1: NEW[1], 2: OTHER}
    assert cell.writes == written


def test_what_holds_the_old_value_already_is_not_written(cell, controller):
    change_tools(controller, wanted(1))
    cell.put(1, OLD[1])
    plan = plan_undo(controller)
    assert (plan.steps, plan.unchanged) == ((), (1,))
    before = len(cell.entries())
    assert undo(controller, plan).receipts == ()
    assert len(cell.entries()) == before


def test_a_change_that_was_taken_back_is_not_undone_again(cell, controller):
    change_tools(controller, wanted(1))
    kept = cell.entries()[-1].change
    with pytest.raises(ToolError), ToolChange(controller, wanted(2), verify=True) as change:
        change.write()
        raise ToolError("it drifts")
    taken_back = cell.entries(EntryKind.ROLLED_BACK)[-1].change
    assert plan_undo(controller).details["undone_change"] == kept
    with pytest.raises(ConfigError, match="undone"):
        plan_undo(controller, change=taken_back)


def test_without_a_finished_change_there_is_nothing_to_undo(controller):
    with pytest.raises(ConfigError, match="No finished change") as caught:
        plan_undo(controller)
    assert "EntryKind.DONE" in caught.value.remedy


@pytest.mark.parametrize("number", [1, 10**9])
def test_an_entry_that_proves_nothing_cannot_come_back(cell, controller, number):
    change_tools(controller, wanted(1))
    with pytest.raises(ConfigError, match="has no value read"):
        plan_undo(controller, to=number)


def test_an_entry_of_another_tool_is_refused(cell, controller):
    change_tools(controller, wanted(1))
    number = cell.entries(EntryKind.DONE)[-1].number
    with pytest.raises(ConfigError, match="is about tool 1"):
        plan_undo(controller, to=number, tool=2)


def test_an_operator_may_look_but_not_undo(cell):
    with cell.connected(cell.log(role=PersonRole.OPERATOR)) as controller:
        change_tools(controller, wanted(1))
        plan = plan_undo(controller)
        written = cell.writes
        with pytest.raises(NotAllowedError):
            undo(controller, plan)
    assert cell.writes == written
    assert cell.tools[1] == NEW[1]


def test_what_was_undone_and_by_whom_is_on_record(cell, controller):
    change_tools(controller, wanted(1))
    first = cell.entries()[-1]
    done = undo(controller, plan_undo(controller))
    engineer, decision = cell.entries(EntryKind.DECISION)
    assert engineer.details == {"engineer": True}
    assert decision.details == {"undone_change": first.change, "entries": [first.number]}
    assert (decision.change, decision.signature.operator) == (done.change, "Ann")
    assert first.change[:8] in decision.verdict


def test_a_single_write_outside_of_a_change_is_undone_by_its_operation(cell, controller):
    controller.tools.write(1, NEW[1], expected=OLD[1])
    entry = cell.entries(EntryKind.DONE)[-1]
    assert entry.change == ""
    undo(controller, plan_undo(controller, change=entry.operation))
    assert cell.tools == OLD


def test_nothing_is_undone_while_something_is_unsettled(cell, controller):
    change_tools(controller, wanted(1))
    plan = plan_undo(controller)
    marker = Marker("begun", MarkerKind.SET, "TLSet 2, XY(1, 2, 3, 4)", "2026-01-01", {"tool": 2})
    controller.outcomes.begin(marker)
    before = len(cell.entries())
    with pytest.raises(OutcomeUnknownError):
        undo(controller, plan)
    assert cell.tools[1] == NEW[1]
    assert len(cell.entries()) == before
