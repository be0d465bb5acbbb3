"""One order delivered twice, whatever happened to the first delivery: row F79.

``test_killed`` has the killed first deliveries.
"""

from itertools import count

import pytest

from robolink.controllers import SimpleController, SimpleMachine
from robolink.errors import BusyError, ConfigError, LeaseLostError, OutcomeUnknownError
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


@pytest.mark.fault("F79")
def test_f79_an_order_whose_change_was_not_kept_may_be_run_again():
    desk = Desk()
    with desk.connected() as controller:
        before = controller.tools.read(1)
        with carrying_out(controller, ORDER, JOB) as order:
            change = ToolChange(
                controller, [Wanted(1, NEW[1], ANY)], order=order, describe=lambda _made: {}
            )
            with pytest.raises(ConfigError, match="no"), change:
                change.write()
                raise ConfigError("no")
        assert controller.tools.read(1) == before
        with carrying_out(controller, ORDER, JOB) as order:
            assert order.done is None


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
