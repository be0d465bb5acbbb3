"""A tool change is complete or undone: the reading before it, and Ctrl-C at each point."""

import signal
from itertools import count

import pytest
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.faults import Fault, FaultAction

from robolink.controllers import EpsonController
from robolink.errors import (
    ControllerFaultError,
    JournalError,
    LeaseLostError,
    NotAllowedError,
    NotReadyError,
    OutcomeUnknownError,
    ReadBackError,
    ToolChangedError,
    ToolError,
    VerifyError,
)
from robolink.model import ANY, EntryKind, MarkerKind, PersonRole, ToolOffset, read_offset
from robolink.protocols import spel
from robolink.transaction import ToolChange, Wanted, change_tools, recover
from tests.unit._transaction_cell import NEW, OLD, OTHER, UNDEFINED, tool_cell, wanted

# A tool change is complete or undone; the record has its end.

ONE_WRITE = ["intent", "write", "read back", "done"]


@pytest.fixture
def cell():
    with tool_cell() as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connected() as controller:
        yield controller
        assert controller.outcomes.change == ""


def test_one_tool_is_one_intent_one_write_and_one_end(cell, controller):
    (receipt,) = change_tools(controller, wanted(1))
    assert (receipt.before, receipt.read_back, receipt.skipped) == (OLD[1], NEW[1], False)
    assert cell.tools == {1: NEW[1], 2: OLD[2]}
    assert cell.story() == ONE_WRITE
    changes = {entry.change for entry in cell.entries()}
    assert len(changes) == 1
    assert changes != {""}
    assert cell.journal.open_markers() == ()


def test_several_tools_are_done_when_all_are(cell, controller):
    change_tools(controller, wanted(1, 2))
    assert cell.tools == NEW
    each = ["intent", "write", "read back"]
    assert cell.story() == ["intent", *each, *each, "done", "done"]
    assert cell.journal.open_markers() == ()


def test_a_value_that_is_there_already_is_not_written(cell, controller):
    receipts = change_tools(controller, [Wanted(1, OLD[1], OTHER), Wanted(2, OLD[2], OLD[2])])
    assert all(receipt.skipped for receipt in receipts)
    assert cell.writes == 0
    assert cell.story() == []


def test_an_undefined_tool_is_defined_and_a_defined_one_cleared(cell, controller):
    change_tools(controller, [Wanted(UNDEFINED, OTHER, None), Wanted(2, None, OLD[2])])
    assert controller.tools.read(UNDEFINED) == OTHER
    assert cell.tools[2] is None


@pytest.mark.parametrize("place", [1, 2])
def test_nothing_is_written_when_a_tool_holds_something_else(cell, controller, place):
    cell.put(place, OTHER)
    with pytest.raises(ToolChangedError, match=r"holds X 1\.000 .* as expected") as refused:
        change_tools(controller, wanted(1, 2))
    assert "Read the tool again" in refused.value.remedy
    assert cell.writes == 0
    assert cell.story() == []


def test_a_value_that_changes_between_the_comparison_and_the_write_is_not_overwritten(
    cell, controller
):
    cell.after_answer_to("Print TLSet(2)", 1, OTHER)
    with pytest.raises(ToolChangedError):
        change_tools(controller, wanted(1, 2))
    assert cell.writes == 0
    assert cell.tools == {1: OTHER, 2: OLD[2]}
    assert cell.journal.open_markers() == ()


def test_what_is_not_kept_is_put_back(cell, controller):
    told: list[str] = []
    with ToolChange(controller, wanted(1, 2), verify=True, tell=told.append) as change:
        change.write()
        assert cell.tools == NEW
    assert cell.tools == OLD
    assert cell.writes == 4
    assert told == [f"The old value of tool {tool} is back." for tool in (2, 1)]
    assert cell.story(1)[-1] == cell.story(2)[-1] == "rolled back"
    assert "done" not in cell.story()
    assert cell.journal.open_markers() == ()


def test_what_is_kept_stays_whatever_comes_then(cell, controller):
    with pytest.raises(VerifyError):
        with ToolChange(controller, wanted(1), verify=True) as change:
            change.write()
            change.keep("looked at")
            raise VerifyError("too late")
    assert cell.tools[1] == NEW[1]
    (done,) = cell.entries(EntryKind.DONE)
    assert done.verdict == "looked at"
    assert read_offset(done.details["value"]) == NEW[1]


def test_an_error_says_that_the_old_value_is_back(cell, controller):
    with pytest.raises(VerifyError) as failed:
        with ToolChange(controller, wanted(1), verify=True) as change:
            change.write()
            raise VerifyError("It drifts.", remedy="Measure again.")
    assert failed.value.what == "It drifts.\n    The old value of tool 1 is back."
    assert failed.value.remedy == "Measure again."
    assert cell.tools == OLD


def test_a_second_tool_that_is_refused_takes_the_first_one_back(cell, controller):
    tilted = ToolOffset(1, 2, 3, v_deg=5)
    with pytest.raises(ToolError, match="four axes"):
        change_tools(controller, [*wanted(1), Wanted(2, tilted, OLD[2])])
    assert cell.tools == OLD
    assert cell.writes == 2
    assert cell.journal.open_markers() == ()


def test_a_write_that_did_not_take_takes_the_others_back(cell, controller):
    cell.simulator.faults.add(Fault(FaultAction.IGNORE_WRITE, match="TLSet 2"))
    with pytest.raises(ReadBackError) as failed:
        change_tools(controller, wanted(1, 2))
    assert "Tool 2 holds its old value.\n    The old value of tool 1 is" in failed.value.what
    assert cell.tools == OLD
    assert cell.writes == 2
    assert cell.journal.open_markers() == ()


def test_a_value_that_was_stored_as_another_is_put_back_once(cell, controller):
    cell.after_answer_to("TLSet 1", 1, OTHER)
    with pytest.raises(ReadBackError, match=r"reads back as X 1\.000"):
        change_tools(controller, wanted(1))
    assert cell.tools == OLD
    assert cell.writes == 2
    assert cell.story()[:4] == ["intent", "write", "read back", "conflict"]
    assert cell.story()[-1] == "rolled back"


def test_what_somebody_else_wrote_is_left_alone_and_stays_open(cell, controller):
    with pytest.raises(VerifyError) as failed:
        with ToolChange(controller, wanted(1, 2), verify=True) as change:
            change.write()
            cell.put(1, OTHER)
            raise VerifyError("It drifts.")
    assert "It was left as it is." in failed.value.what
    assert cell.tools == {1: OTHER, 2: OLD[2]}
    assert cell.story(1)[-1] == "conflict"
    ((_, marker),) = cell.journal.open_markers()
    assert marker.kind is MarkerKind.CHANGE
    with pytest.raises(OutcomeUnknownError, match="did not finish"):
        change_tools(controller, [Wanted(1, NEW[1], OTHER)])


def test_a_controller_in_error_keeps_the_change_open(cell, controller):
    fault = Fault(FaultAction.DEVICE_FAULT, match="TLSet 2", code=4000)
    cell.simulator.faults.add(fault)
    with pytest.raises(ControllerFaultError) as failed:
        change_tools(controller, wanted(1, 2))
    assert failed.value.what.count("could not be written back") == 2
    assert cell.tools == {1: NEW[1], 2: OLD[2]}
    controller.reset_fault()
    assert recover(controller).left == ()
    assert cell.tools == OLD


def test_a_link_that_is_gone_leaves_the_change_to_recover(cell):
    cell.simulator.faults.add(Fault(FaultAction.DISCONNECT, match="TLSet 2"))
    told: list[str] = []
    with cell.connected() as controller:
        with pytest.raises(OutcomeUnknownError) as lost:
            change_tools(controller, wanted(1, 2), tell=told.append)
    sentence = (
        "Tool 1, 2 may hold the new value, which was never tested; 'robolink recover' restores"
    )
    assert sentence in lost.value.what
    assert sentence in told[0]
    kinds = {marker.kind for _, marker in cell.journal.open_markers()}
    assert kinds == {MarkerKind.SET, MarkerKind.CHANGE}


def test_a_change_that_another_recovered_meanwhile_is_neither_kept_nor_taken_back(cell):
    with cell.connected() as controller:
        with pytest.raises(LeaseLostError, match=r"Bob .* took over"):
            with ToolChange(controller, wanted(1), verify=True) as change:
                change.write()
                # He is silent for so long that another may take over.
                cell.clock.advance(11)
                cell.simulator._slot.free()
                with cell.connected(cell.log("Bob")) as other:
                    assert recover(other, keep=True).left == ()
                    change_tools(other, [Wanted(1, OTHER, NEW[1])])
                cell.simulator._slot.admit(cell.simulator._links._links[0], cell.simulator.now_ns)
                change.keep("verified")
    assert cell.tools[1] == OTHER
    assert "verified" not in {entry.verdict for entry in cell.entries(EntryKind.DONE)}


def test_an_operator_may_not_write_blindly(cell):
    with cell.connected(cell.log("Ann", role=PersonRole.OPERATOR)) as controller:
        with pytest.raises(NotAllowedError, match="Ann may not write tool 2 without comparing"):
            change_tools(controller, [*wanted(1), Wanted(2, NEW[2], ANY)])
    assert cell.tools == OLD
    assert cell.journal.open_markers() == ()


def test_an_engineer_who_writes_blindly_is_on_record(cell):
    cell.put(1, OTHER)
    with cell.connected(cell.log("Bob", role=PersonRole.ENGINEER)) as controller:
        (receipt,) = change_tools(controller, [Wanted(1, NEW[1], ANY)])
    assert receipt.unconditional
    decision, intent, *_ = cell.entries()
    assert decision.kind is EntryKind.DECISION
    assert decision.signature.operator == intent.signature.operator == "Bob"
    assert intent.details["unconditional"] is True
    assert read_offset(intent.details["before"]) == OTHER


def test_an_end_that_cannot_be_recorded_leaves_the_change_open(cell, controller, monkeypatch):
    def full(*_given):
        raise JournalError("The disk is full.")

    with ToolChange(controller, wanted(1), verify=True) as change:
        change.write()
        with monkeypatch.context() as broken:
            broken.setattr(controller.outcomes, "clear", full)
            with pytest.raises(JournalError):
                change.keep("verified")
    # Not kept, so undone.
    assert cell.tools == OLD
    assert cell.journal.open_markers() == ()


# Ctrl-C at each point of a tool change: all of it is kept, or all of it is undone.


def verified(controller, kept):
    with ToolChange(controller, wanted(1, 2), verify=True) as change:
        change.write()
        controller.status()
        try:
            change.keep("verified")
        finally:
            kept.append(change.kept)


def unverified(controller, kept):
    change_tools(controller, wanted(1, 2))


class Interrupted:
    """Presses Ctrl-C at the ``at``-th instant: at an exchange or after a durable transaction."""

    def __init__(self, cell, log, at):
        self.instants = 0
        self.at = at
        cell.simulator.on_request = cell.simulator.on_reply = self.pass_by
        for name in ("begin", "clear", "append"):
            setattr(log, name, self.passing(getattr(log, name)))

    def passing(self, act):
        def done(*given):
            act(*given)
            self.pass_by()

        return done

    def pass_by(self, *_seen):
        self.instants += 1
        if self.instants == self.at:
            signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("program", [unverified, verified])
def test_ctrl_c_leaves_all_or_nothing_of_a_change(program):
    for at in count(1):
        kept: list[bool] = []
        with tool_cell() as cell:
            log = cell.log()
            with cell.connected(log) as controller:
                interrupted = Interrupted(cell, log, at)
                try:
                    program(controller, kept)
                except KeyboardInterrupt:
                    pass
                else:
                    break
                finally:
                    interrupted.at = 0
            assert cell.tools in (OLD, NEW), at
            assert (cell.tools == NEW) is (kept == [True] or "done" in cell.story()), at
            assert cell.journal.open_markers() == (), at
            # At most one write, and one to undo it.
            assert cell.writes in (0, 2, 4), at
    assert cell.tools == NEW
    assert at > 30


def test_ctrl_c_while_an_output_is_switched_leaves_nothing_in_doubt():
    for at in count(1):
        with tool_cell() as cell:
            log = cell.log()
            with cell.connected(log) as controller:
                assert isinstance(controller, EpsonController)
                interrupted = Interrupted(cell, log, at)
                try:
                    controller.io.set_output(8, True)
                except KeyboardInterrupt:
                    pass
                else:
                    break
                finally:
                    interrupted.at = 0
            assert cell.journal.open_markers() == (), at
    assert cell.simulator.machine.outputs.get(8)
    assert at > 10


# The requests to an EPSON controller before a tool is written, and possible gaps.


@pytest.fixture
def controller_as_asked(cell):
    with cell.connected() as controller:
        yield controller


def asked(cell):
    """Return the exchanges that changed nothing but the login, in short form."""
    texts = [
        text.strip('"').rpartition('"')[2] for _, way, text in cell.simulator.log if way == ">"
    ]
    return [text for text in texts if text.startswith(("$Get", "Print TL", "TL"))]


WRITTEN = ["TLSet 1, XY(12.250, -3.250, -20.000, 0.000)", "Print TLSet(1)"]
ONE_BY_ONE = ["Print TLDef(1)", "Print TLSet(1)"]


def test_a_write_of_what_was_expected_takes_three_exchanges(cell, controller_as_asked):
    controller_as_asked.tools.write(2, NEW[2], expected=OLD[2])  # asks which robot it is, once
    cell.simulator.log.clear()
    controller_as_asked.tools.write(1, NEW[1], expected=OLD[1])
    assert asked(cell) == ["TLSet", *WRITTEN]


def test_the_first_write_of_a_session_looks_at_the_state_before_it_sends_anything(
    cell, controller_as_asked
):
    controller_as_asked.tools.write(1, NEW[1], expected=OLD[1])
    assert asked(cell)[0] == "$GetStatus"


def test_a_state_that_changed_since_is_named_although_it_was_not_looked_at(
    cell, controller_as_asked
):
    controller_as_asked.tools.write(2, NEW[2], expected=OLD[2])
    cell.simulator.panel.open_guard()
    written = cell.simulator.machine.flash_writes
    cell.simulator.log.clear()
    for _ in range(2):
        with pytest.raises(NotReadyError, match="guard"):
            controller_as_asked.tools.write(1, NEW[1], expected=OLD[1])
    assert asked(cell) == ["TLSet", "$GetStatus", "$GetStatus", "$GetStatus"]
    assert cell.simulator.machine.flash_writes == written


@pytest.mark.parametrize("layout", ["padded", "four"])
def test_the_list_is_believed_however_wide_its_columns_are(layout):
    with tool_cell(EpsonOptions(tool_listing=layout)) as cell, cell.connected() as controller:
        controller.tools.write(2, NEW[2], expected=OLD[2])
        cell.simulator.log.clear()
        controller.tools.write(1, NEW[1], expected=OLD[1])
        assert asked(cell) == ["TLSet", *WRITTEN]


@pytest.mark.parametrize(
    "listing", ["Tool 1: 12, -4, -20, 0", "1: 12.000 -3.500 -20.000 0.000", "Werkzeug?"]
)
def test_a_list_that_does_not_confirm_what_was_expected_is_not_believed(
    cell, controller_as_asked, monkeypatch, listing
):
    controller_as_asked.tools.write(2, NEW[2], expected=OLD[2])
    parsed = spel.parse_tool_listing
    monkeypatch.setattr(spel, "parse_tool_listing", lambda _printed: parsed(listing))
    cell.simulator.log.clear()
    controller_as_asked.tools.write(1, NEW[1], expected=OLD[1])
    assert asked(cell) == ["TLSet", *ONE_BY_ONE, *WRITTEN]


def test_what_is_stored_already_is_asked_for_by_itself_before_the_write_is_left_out(
    cell, controller_as_asked
):
    controller_as_asked.tools.write(2, NEW[2], expected=OLD[2])
    cell.simulator.log.clear()
    assert controller_as_asked.tools.write(1, OLD[1], expected=OLD[1]).skipped
    assert asked(cell) == ["TLSet", *ONE_BY_ONE]


def test_a_tool_that_was_cleared_here_is_asked_for_again(cell, controller_as_asked):
    controller_as_asked.tools.clear(1, expected=controller_as_asked.tools.read(1), then_select=0)
    assert controller_as_asked.tools.read(1) is None
    controller_as_asked.tools.write(1, OTHER, expected=None)
    assert controller_as_asked.tools.read(1) == OTHER


def test_a_tool_of_zeros_is_told_from_an_undefined_one(cell, controller_as_asked):
    zeros = type(OTHER)()
    controller_as_asked.tools.write(1, zeros, expected=OLD[1])
    assert controller_as_asked.tools.read(1) == zeros
    assert controller_as_asked.tools.read(3) is None


def test_a_tool_that_somebody_cleared_is_undefined_even_where_asking_for_it_is_an_error():
    options = EpsonOptions(tlset_of_undefined="error")
    with tool_cell(options) as cell, cell.connected() as controller:
        before = controller.tools.read(1)
        cell.simulator.machine.tools.clear(1, in_force="selects_zero")
        with pytest.raises(ToolChangedError, match="Tool 1 holds undefined"):
            controller.tools.write(1, NEW[1], expected=before)
        assert cell.writes == 1, "only that of the person who cleared it"
        assert not controller.status().fault
