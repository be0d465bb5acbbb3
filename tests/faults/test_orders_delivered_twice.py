"""One order delivered twice, whatever happened to the first delivery: row F79.

``test_killed`` has the killed first deliveries.
"""

from itertools import count

import pytest
from robolink_cli.console.exit_codes import exit_code

from robolink.controllers import SimpleController, SimpleMachine
from robolink.errors import (
    BusyError,
    CalibrationError,
    ConfigError,
    ConnectError,
    ControllerError,
    DeclinedError,
    JournalError,
    LeaseHeldError,
    LeaseLostError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    RemoteProtocolError,
    StoppedError,
    ToolChangedError,
    ToolError,
    ToolIndexError,
    TransportBrokenError,
    VerifyError,
)
from robolink.journal import memory_journal
from robolink.model import ANY, EntryKind, Marker, MarkerKind, plain_offset
from robolink.transaction import Settler, ToolChange, Wanted, carrying_out, change_tools
from tests.faults._change_process import NEW, ORDER

_desks = count()


class Desk:
    """Several programs on one computer with one record."""

    def __init__(self) -> None:
        self.machine = SimpleMachine()
        self.journal = memory_journal(f"desk-{next(_desks)}")

    def connected(self) -> SimpleController:
        log = self.journal.log("memory://desk")
        return SimpleController(self.machine, identity="memory://desk", outcomes=log)


JOB = {"what": "tool 1"}


@pytest.mark.fault("F79")
def test_f79_of_two_at_once_one_is_let_in_and_the_other_then_sees_its_result():
    desk = Desk()
    with desk.connected() as one, desk.connected() as two:
        with carrying_out(one, ORDER, JOB) as order:
            with pytest.raises(BusyError), carrying_out(two, ORDER, JOB):
                pytest.fail("both were let in")
            change_tools(one, [Wanted(1, NEW[1], ANY)], order=order)
        with carrying_out(two, ORDER, JOB) as order:
            assert order.done is not None
            value = plain_offset(NEW[1])
            made = {"tool": 1, "before": None, "requested": value, "read_back": value}
            assert order.done.result == {"tools": [made]}
    for entry in desk.journal.entries(kinds=(EntryKind.INTENT, EntryKind.WRITE, EntryKind.DONE)):
        assert entry.details["order"] == ORDER


ENDS = {
    "declined": (DeclinedError("No."), DeclinedError),
    "stopped": (StoppedError("Somebody stopped it."), StoppedError),
    "interrupted": (KeyboardInterrupt(), StoppedError),
    "measured badly": (CalibrationError("rank_deficient", "Too alike."), CalibrationError),
    "put back": (VerifyError("Off.", code="large_drift"), VerifyError),
    "changed": (ToolChangedError("Changed."), ToolError),
    "no such tool": (ToolIndexError("There is no tool 16."), ToolIndexError),
    "guard": (NotReadyError("Open.", reason=NotReadyReason.GUARD_OPEN), ControllerError),
    "misspelt": (ConfigError("No such file."), ConfigError),
    "a defect": (RuntimeError("an index is out of range"), ConfigError),
}


@pytest.mark.fault("F79")
@pytest.mark.parametrize("end", ENDS)
def test_f79_an_order_that_ended_without_a_kept_change_ends_in_the_same_way_again(end):
    """Whoever said no to it is not overruled by the queue that delivers it again."""
    raised, again = ENDS[end]
    desk = Desk()
    with desk.connected() as controller:
        before = controller.tools.read(1)
        with pytest.raises(type(raised)), carrying_out(controller, ORDER, JOB) as order:
            with ToolChange(controller, [Wanted(1, NEW[1], ANY)], order=order) as change:
                change.write()
                raise raised
        assert controller.tools.read(1) == before
        entries = desk.journal.count()
        for _ in range(2):
            with pytest.raises(again, match=f"{ORDER} ended on .* without") as told:
                with carrying_out(controller, ORDER, JOB):
                    pytest.fail("it was run again")
            if end not in ("a defect", "interrupted"):  # 70 and 130 say how this process ended
                assert exit_code(told.value) == exit_code(raised)
        assert "Give a new order" in str(told.value)
        assert getattr(told.value, "code", "") == getattr(raised, "code", "")
        with pytest.raises(ConfigError, match="for another job"):
            with carrying_out(controller, ORDER, {"another": "job"}):
                pytest.fail("it was run")
        assert desk.journal.count() == entries
        with carrying_out(controller, "A-18", JOB) as order:
            assert order.done is None
        for _ in range(2):  # whatever it left open is another matter
            with pytest.raises(RemoteProtocolError), carrying_out(controller, "A-19", JOB):
                raise RemoteProtocolError("What?")


NOT_NOW = {
    "not reached": ConnectError("Nobody answers."),
    "cut": TransportBrokenError("The cable is out."),
    "busy": BusyError("Another operation is running."),
    "locked": LeaseHeldError("Ann has locked it."),
    "journal": JournalError("The disk is full."),
    "unknown": OutcomeUnknownError("No answer came."),
    "production": NotReadyError("A program runs.", reason=NotReadyReason.RUNNING),
}


@pytest.mark.fault("F79")
@pytest.mark.parametrize("moment", NOT_NOW)
def test_f79_an_order_for_which_only_the_moment_was_wrong_is_carried_out_later(moment):
    desk = Desk()
    with desk.connected() as controller:
        with pytest.raises(type(NOT_NOW[moment])), carrying_out(controller, ORDER, JOB):
            raise NOT_NOW[moment]
        with carrying_out(controller, ORDER, JOB) as order:
            assert order.done is None
            change_tools(controller, [Wanted(1, NEW[1], ANY)], order=order)
            kept = desk.journal.count()
        with pytest.raises(DeclinedError), carrying_out(controller, ORDER, JOB) as order:
            assert order.done is not None
            raise DeclinedError("after it was kept, so this ends nothing")
        assert desk.journal.count() == kept


@pytest.mark.fault("F79")
def test_f79_an_order_that_selects_counts_as_long_as_that_tool_is_selected():
    """Killed between its last write and the selection, it is found complete, and is not done."""
    desk = Desk()
    with desk.connected() as controller:
        change_tools(controller, [Wanted(2, NEW[2], ANY)])
        with carrying_out(controller, ORDER, JOB) as order:
            change_tools(controller, [Wanted(1, NEW[1], ANY)], order=order, select=2)
        assert controller.tools.selected() == 2
        with carrying_out(controller, ORDER, JOB) as order:
            assert order.done is not None
        controller.tools.select(1)
        with (
            pytest.raises(ToolChangedError, match="left tool 2 selected; tool 1 is"),
            carrying_out(controller, ORDER, JOB),
        ):
            pytest.fail("it was told as done")
        with carrying_out(controller, "A-18", JOB) as order:
            change = ToolChange(controller, [Wanted(1, NEW[2], ANY)], order=order, select=2)
            with pytest.raises(LeaseLostError), change:
                change.write()
                controller.tools.select(1)  # as if the process had died before it selected 2
                raise LeaseLostError("as if it had been killed here")
        (marker,) = controller.outcomes.open_markers()
        settler = Settler(controller)
        settler.settle(settler.examine(marker))
        with pytest.raises(ToolChangedError, match="2 selected"):
            with carrying_out(controller, "A-18", JOB):
                pytest.fail("it was told as done")


@pytest.mark.fault("F79")
def test_f79_what_cannot_be_written_after_all_leaves_the_tool_selected_that_was():
    desk = Desk()
    with desk.connected() as controller:
        change_tools(controller, [Wanted(1, NEW[1], ANY), Wanted(2, NEW[2], ANY)], select=1)
        change = ToolChange(controller, [Wanted(1, NEW[2], ANY)], select=2)
        with pytest.raises(DeclinedError), change:
            change.write()
            assert controller.tools.selected() == 2
            raise DeclinedError("no")
        assert controller.tools.selected() == 1
        assert controller.tools.read(1) == NEW[1]
        change_tools(controller, [], select=2)
        assert controller.tools.selected() == 2


@pytest.mark.fault("F79")
def test_f79_a_value_that_stood_already_makes_an_order_done_all_the_same():
    desk = Desk()
    with desk.connected() as controller:
        change_tools(controller, [Wanted(1, NEW[1], ANY)])
        with carrying_out(controller, ORDER, JOB) as order:
            (receipt,) = change_tools(controller, [Wanted(1, NEW[1], NEW[1])], order=order)
            assert receipt.skipped
        with carrying_out(controller, ORDER, JOB) as order:
            assert order.done is not None


@pytest.mark.fault("F79")
def test_f79_an_order_is_not_told_as_done_while_something_is_not_put_back():
    """Production started on it would run with the tool selected for the measurement."""
    desk = Desk()
    with desk.connected() as controller:
        with carrying_out(controller, ORDER, JOB) as order:
            change_tools(controller, [Wanted(1, NEW[1], ANY)], order=order)
        # As left by a process killed after the transaction that keeps the value.
        left = Marker("killed", MarkerKind.SELECTION, "calibrate tool 1", "then", {"tool": 1})
        controller.outcomes.begin(left)
        with (
            pytest.raises(OutcomeUnknownError, match="calibrate tool 1"),
            carrying_out(controller, ORDER, JOB),
        ):
            pytest.fail("it was told as done")
        controller.finish(left)
        with carrying_out(controller, ORDER, JOB) as order:
            assert order.done is not None


@pytest.mark.fault("F79")
def test_f79_a_first_order_begins_nothing_while_something_is_unsettled():
    """Its job may move before anything is written, and would find out only at its end."""
    desk = Desk()
    with desk.connected() as controller:
        left = Marker("killed", MarkerKind.SELECTION, "calibrate tool 1", "then", {"tool": 1})
        controller.outcomes.begin(left)
        with (
            pytest.raises(OutcomeUnknownError, match="calibrate tool 1"),
            carrying_out(controller, ORDER, JOB),
        ):
            pytest.fail("it was begun")


@pytest.mark.fault("F79")
def test_f79_an_order_that_was_closed_without_looking_is_not_run_again():
    desk = Desk()
    with desk.connected() as controller:
        with carrying_out(controller, ORDER, JOB) as order:
            change = ToolChange(controller, [Wanted(1, NEW[1], ANY)], order=order)
            with pytest.raises(LeaseLostError), change:
                change.write()
                raise LeaseLostError("as if it had been killed here")
        (marker,) = controller.outcomes.open_markers()
        Settler(controller).forget(marker)
        with (
            pytest.raises(ConfigError, match="closed without checking"),
            carrying_out(controller, ORDER, JOB),
        ):
            pytest.fail("it was run again")
