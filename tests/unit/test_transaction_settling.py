"""What is left open is judged by reading the controller, and settled with what that says."""

import pytest
from robolink_simulators.faults import Fault, FaultAction

from robolink.errors import (
    ConfigError,
    LeaseHeldError,
    NotReadyError,
    RobolinkError,
    UnclearAnswerError,
)
from robolink.model import EntryKind, Marker, MarkerKind, Verdict, plain_offset
from robolink.transaction import Recovery, Settler, recover
from robolink.transaction._put_back import Step, put_back
from tests.unit._transaction_cell import NEW, OLD, OTHER, tool_cell


@pytest.fixture
def cell():
    with tool_cell() as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connected() as controller:
        yield controller


def leave_open(cell, kind=MarkerKind.CHANGE, **details):
    """Let a process that is gone have begun something."""
    values = {
        str(tool): {"before": plain_offset(OLD[tool]), "requested": plain_offset(NEW[tool])}
        for tool in OLD
    }
    given = {"tools": values, "verify": False, "change": "c-1", **details}
    marker = Marker(f"op-{kind}", kind, f"begun: {kind}", "then", given)
    log = cell.log("Gone")
    log.begin(marker)
    log.close()
    return marker


def leave_write_open(cell):
    values = {"before": plain_offset(OLD[1]), "requested": plain_offset(NEW[1])}
    marker = Marker("op-set", MarkerKind.SET, "TLSet 1", "then", {"tool": 1, **values})
    log = cell.log("Gone")
    log.begin(marker)
    log.close()


def test_nothing_that_took_is_not_applied(cell, controller):
    finding = Settler(controller).examine(leave_open(cell))
    assert finding.verdict is Verdict.NOT_APPLIED
    assert finding.sentence.endswith("Nothing of the change took effect.")
    Settler(controller).settle(finding)
    assert cell.story(1)[-1] == cell.story(2)[-1] == "not applied"
    assert cell.journal.open_markers() == ()
    assert cell.writes == 0


@pytest.mark.parametrize(("verify", "keep"), [(False, False), (True, True)])
def test_all_that_was_wanted_is_done_unless_it_was_to_be_verified(cell, controller, verify, keep):
    marker = leave_open(cell, verify=verify)
    for tool, offset in NEW.items():
        cell.put(tool, offset)
    settler = Settler(controller, keep=keep)
    finding = settler.examine(marker)
    assert finding.verdict is Verdict.DONE
    settler.settle(finding)
    done = cell.entries(EntryKind.DONE)
    assert {(entry.tool, entry.change) for entry in done} == {(1, "c-1"), (2, "c-1")}
    assert all(entry.details["found_later"] for entry in done)
    assert cell.tools == NEW
    assert controller.outcomes.change == ""


@pytest.mark.parametrize(("verify", "there"), [(False, (1,)), (False, (2,)), (True, (1, 2))])
def test_what_is_not_finished_is_put_back(cell, controller, verify, there):
    marker = leave_open(cell, verify=verify)
    for tool in there:
        cell.put(tool, NEW[tool])
    finding = Settler(controller).examine(marker)
    assert finding.verdict is Verdict.NOT_FINISHED
    assert not finding.verdict.needs_a_person
    numbers = ", ".join(map(str, there))
    assert finding.action == f"Put the old value of tool {numbers} back"
    why = "never tested" if verify else "the change is not complete"
    assert finding.sentence.endswith(f"Written, but {why}.")
    Settler(controller).settle(finding)
    assert cell.tools == OLD
    assert cell.writes == len(there)
    assert {entry.tool for entry in cell.entries(EntryKind.ROLLED_BACK)} == set(there)
    assert cell.journal.open_markers() == ()


def swapped(look, text):
    """Let the first two of some bytes that are printed of tool 2 change places on the way."""
    printed = '#Execute," X:  -12.000 Y:   -3.500 Z:  -21.000'
    at = printed.index(text)
    return Fault(FaultAction.SWAP_BYTES, look, match="TLSet(2)", position=at)


@pytest.mark.fault("F08")
def test_a_look_that_was_bent_on_its_way_is_no_conflict(cell, controller):
    """A checksum by XOR does not notice it: -21.000 is read as -12.000."""
    marker = leave_open(cell)
    cell.simulator.faults.add(swapped(0, "21.000"))
    assert Settler(controller).examine(marker).verdict is Verdict.NOT_APPLIED
    assert cell.simulator.faults.pending == ()


def test_looks_that_never_agree_settle_nothing(cell, controller):
    marker = leave_open(cell)
    for look, text in enumerate(("21.000", "12.000", "500")):
        cell.simulator.faults.add(swapped(look, text))
    with pytest.raises(UnclearAnswerError, match="reads back otherwise at each look") as refused:
        Settler(controller).examine(marker)
    assert "Check the cable" in refused.value.remedy
    assert cell.journal.open_markers() == ((controller.outcomes.identity, marker),)


def test_a_bent_look_does_not_leave_a_new_value_behind(cell, controller):
    """A roll-back that misreads the new value puts the old one back all the same."""
    cell.put(2, NEW[2])
    cell.simulator.faults.add(swapped(0, "21.000"))
    (done,) = put_back(controller, [Step(2, OLD[2], NEW[2])])
    assert done.restored
    assert cell.tools[2] == OLD[2]


@pytest.mark.fault("F59")
def test_what_is_neither_old_nor_new_is_a_conflict_that_takes_a_person(cell, controller):
    marker = leave_open(cell)
    cell.put(2, OTHER)
    told = []
    done = recover(controller, tell=lambda finding, settled: told.append((finding, settled)))
    (finding,) = done.left
    assert (finding.verdict, done.settled) == (Verdict.CONFLICT, ())
    assert told == [(finding, False)]
    assert "Tool 2 holds X 1.000 Y 2.000 Z 3.000 U 0.000; before the change" in finding.sentence
    assert cell.journal.open_markers() == ((controller.outcomes.identity, marker),)
    assert cell.writes == 0
    # A person who has looked says that it may stay.
    Settler(controller).settle(finding)
    assert cell.story(2)[-1] == "conflict"
    assert cell.journal.open_markers() == ()


def test_a_person_may_forget_a_marker_and_that_is_on_record(cell, controller):
    marker = leave_open(cell)
    Settler(controller).forget(marker)
    (decision,) = cell.entries(EntryKind.DECISION)
    assert decision.verdict == "forgotten without looking"
    assert decision.details["request"] == marker.request
    assert cell.journal.open_markers() == ()


@pytest.mark.parametrize("tools", [None, {"one": {}}, {"1": {"before": None}}])
def test_a_marker_that_makes_no_sense_is_left_to_a_person(cell, controller, tools):
    marker = leave_open(cell, tools=tools)
    with pytest.raises(ConfigError, match="cannot be read") as refused:
        Settler(controller).examine(marker)
    assert "Compare the tools with a backup" in refused.value.remedy


def test_a_value_that_cannot_be_put_back_stays_open_and_recover_may_run_again(cell, controller):
    leave_open(cell)
    cell.put(1, NEW[1])
    cell.simulator.faults.add(Fault(FaultAction.IGNORE_WRITE, match="TLSet 1"))
    with pytest.raises(RobolinkError, match="could not be written back") as failed:
        recover(controller)
    assert failed.value.remedy.endswith("'robolink recover' may be run again.")
    assert {marker.kind for _, marker in cell.journal.open_markers()} == {MarkerKind.CHANGE}
    assert recover(controller).left == ()
    assert cell.tools == OLD


def test_recover_judges_the_write_in_flight_before_the_change_around_it(cell, controller):
    leave_open(cell)
    leave_write_open(cell)
    cell.put(1, NEW[1])
    done = recover(controller)
    assert [finding.marker.kind for finding in done.settled] == [MarkerKind.SET, MarkerKind.CHANGE]
    assert [finding.verdict for finding in done.settled] == [Verdict.DONE, Verdict.NOT_FINISHED]
    assert cell.tools == OLD
    assert cell.writes == 1
    (began,) = cell.entries(EntryKind.RECONNECT)
    assert began.details["unsettled"] == ["TLSet 1", "begun: change"]


def test_recover_finds_nothing_where_nothing_is_open(cell, controller):
    assert recover(controller) == Recovery((), ())
    assert cell.story() == []


def test_recover_is_refused_while_somebody_else_is_at_it(cell, controller):
    begun = Marker("op", MarkerKind.SET, "TLSet 2", "then", {"tool": 2})
    cell.log("Bob").begin(begun)
    with pytest.raises(LeaseHeldError, match="Bob"):
        recover(controller)
    assert cell.writes == 0


def test_a_movement_is_not_settled_while_the_robot_moves(cell, controller):
    marker = leave_open(cell, MarkerKind.MOVE)
    cell.simulator.panel.start_production()
    with pytest.raises(NotReadyError):
        controller.resolver.examine(marker)
    assert [left.operation for _, left in cell.journal.open_markers()] == [marker.operation]
