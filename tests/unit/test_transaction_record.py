"""The record of a tool change: its history, its turn tests, and the recovery of an open one."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest
from robolink_simulators.faults import Fault, FaultAction

from robolink.calibration_run import (
    AcceptanceCriteria,
    ChangePlan,
    Limits,
    NozzleChange,
    Proposal,
    ToolPlan,
)
from robolink.calibration_run import _open_turn_test as marking
from robolink.calibration_run._measurement import offer_of
from robolink.controllers import SimpleController
from robolink.errors import (
    ConfigError,
    LeaseHeldError,
    NotReadyError,
    RobolinkError,
    UnclearAnswerError,
)
from robolink.methods import TwoPoseSource, measure_two_pose
from robolink.model import (
    EntryKind,
    Marker,
    MarkerKind,
    NewEntry,
    Pose,
    ToolOffset,
    Verdict,
    WorkBox,
    plain_offset,
)
from robolink.procedures import MeasurementContext, TouchPlan
from robolink.testing import PaperCell
from robolink.timing import local_label
from robolink.transaction import (
    ChangedSince,
    Recovery,
    Settler,
    ToolChange,
    Wanted,
    change_tools,
    changed_since,
    earlier_corrections,
    last_proof,
    recover,
)
from robolink.transaction._put_back import Step, put_back
from tests._rows import each_row
from tests.unit._transaction_cell import NEW, OLD, OTHER, UNDEFINED, tool_cell, wanted

# An open job is judged by reading the controller, and finished or undone accordingly.


@pytest.fixture
def cell():
    with tool_cell() as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connected() as controller:
        yield controller


def leave_open(cell, kind=MarkerKind.CHANGE, **details):
    """Leave a job that a vanished process had begun."""
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
    assert finding.action == f"Restore the old value of tool {numbers}"
    why = "never tested" if verify else "the change is not complete"
    assert finding.sentence.endswith(f"Written, but {why}.")
    Settler(controller).settle(finding)
    assert cell.tools == OLD
    assert cell.writes == len(there)
    assert {entry.tool for entry in cell.entries(EntryKind.ROLLED_BACK)} == set(there)
    assert cell.journal.open_markers() == ()


def swapped(look, text):
    """Swap the first two of some bytes printed for tool 2 on their way."""
    printed = '#Execute," X:  -12.000 Y:   -3.500 Z:  -21.000'
    at = printed.index(text)
    return Fault(FaultAction.SWAP_BYTES, look, match="TLSet(2)", position=at)


@pytest.mark.fault("F08")
def test_a_look_that_was_bent_on_its_way_is_no_conflict(cell, controller):
    """A checksum by XOR does not detect it: -21.000 is read as -12.000."""
    marker = leave_open(cell)
    cell.simulator.faults.add(swapped(0, "21.000"))
    assert Settler(controller).examine(marker).verdict is Verdict.NOT_APPLIED
    assert cell.simulator.faults.pending == ()


def test_looks_that_never_agree_settle_nothing(cell, controller):
    marker = leave_open(cell)
    for look, text in enumerate(("21.000", "12.000", "500")):
        cell.simulator.faults.add(swapped(look, text))
    with pytest.raises(UnclearAnswerError, match="reads back differently each time") as refused:
        Settler(controller).examine(marker)
    assert "Check the cable" in refused.value.remedy
    assert cell.journal.open_markers() == ((controller.outcomes.identity, marker),)


def test_a_bent_look_does_not_leave_a_new_value_behind(cell, controller):
    """A roll-back that misreads the new value restores the old one all the same."""
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
    # A person who has looked confirms that it may stay.
    Settler(controller).settle(finding)
    assert cell.story(2)[-1] == "conflict"
    assert cell.journal.open_markers() == ()


def test_a_person_may_forget_a_marker_and_that_is_on_record(cell, controller):
    marker = leave_open(cell)
    Settler(controller).forget(marker)
    (decision,) = cell.entries(EntryKind.DECISION)
    assert decision.verdict == "dropped without a check"
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
    assert failed.value.remedy.endswith("You can run 'robolink recover' again.")
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


# The record's data about a tool before it is written again.


@pytest.fixture
def controller_on_record(cell):
    with cell.connected(cell.log(nozzle="N-7")) as controller:
        yield controller


def test_a_tool_that_was_never_written_here_has_not_changed(controller_on_record):
    assert last_proof(controller_on_record, 1) is None
    assert changed_since(controller_on_record, 1, OTHER) is None


def test_a_tool_that_holds_what_was_proved_last_has_not_changed(cell, controller_on_record):
    change_tools(controller_on_record, wanted(1))
    assert changed_since(controller_on_record, 1, cell.tools[1]) is None
    # The other tool has its own history.
    assert changed_since(controller_on_record, 2, OTHER) is None


def test_a_tool_that_was_put_back_holds_its_old_value(cell, controller_on_record):
    with ToolChange(controller_on_record, wanted(1, 2), verify=True) as change:
        change.write()
    for tool, offset in cell.tools.items():
        assert changed_since(controller_on_record, tool, offset) is None
        assert changed_since(controller_on_record, tool, NEW[tool]) is not None


def test_a_tool_that_somebody_else_changed_is_shown_with_when_how_far_and_why(controller_on_record):
    change_tools(controller_on_record, wanted(1))
    moved = ToolOffset(12.25, -3.25 + 0.3, -20.0 - 0.4)
    found = changed_since(controller_on_record, 1, moved)
    assert found is not None
    assert (found.tool, found.recorded, found.now) == (1, NEW[1], moved)
    assert found.distance_mm == pytest.approx(0.5)
    proof = last_proof(controller_on_record, 1)
    assert proof is not None
    assert found.sentence.startswith(
        f"Tool 1 holds X 12.250 Y -2.950 Z -20.400 U 0.000; on {local_label(proof.at)} it was left "
        "with X 12.250"
    )
    assert "That is 0.500 mm away." in found.sentence
    assert "TLSet at its start" in found.sentence


@pytest.mark.parametrize(("recorded", "now"), [(None, OTHER), (OTHER, None)])
def test_where_a_value_is_undefined_there_is_no_distance(recorded, now):
    found = ChangedSince(1, recorded, "then", now)
    assert found.distance_mm is None
    assert "undefined" in found.sentence
    assert "mm away" not in found.sentence


def test_an_entry_that_proves_nothing_is_passed_over(controller_on_record):
    change_tools(controller_on_record, wanted(1))
    controller_on_record.outcomes.append(
        NewEntry(EntryKind.ROLLED_BACK, tool=1),
        NewEntry(EntryKind.UNKNOWN, tool=1, details={"value": plain_offset(OTHER)}),
    )
    assert changed_since(controller_on_record, 1, NEW[1]) is None


def correct(controller, *steps_mm):
    """Move tool 1's tip along X by this much, one change after another."""
    for step_mm in steps_mm:
        before = controller.tools.read(1)
        after = ToolOffset(before.x_mm + step_mm, before.y_mm, before.z_mm)
        change_tools(controller, [Wanted(1, after, before)])


def test_corrections_of_one_nozzle_are_told_oldest_first(controller_on_record):
    correct(controller_on_record, 0.4, -0.2, 0.1)
    assert earlier_corrections(controller_on_record, 1) == pytest.approx((0.4, 0.2, 0.1))
    assert earlier_corrections(controller_on_record, 2) == ()


def test_a_write_of_z_alone_is_no_correction_that_x_and_y_could_have_grown_from(
    controller_on_record,
):
    before = controller_on_record.tools.read(1)
    longer = ToolOffset(before.x_mm, before.y_mm, before.z_mm - 0.7)
    change_tools(controller_on_record, [Wanted(1, longer, before)])
    correct(controller_on_record, 0.4)
    assert earlier_corrections(controller_on_record, 1) == pytest.approx((0.4,))


def test_corrections_of_the_nozzle_before_do_not_count(cell):
    for nozzle, steps_mm in (("N-6", (0.9,)), ("N-7", (0.3, 0.2))):
        with cell.connected(cell.log(nozzle=nozzle)) as controller:
            correct(controller, *steps_mm)
            assert earlier_corrections(controller, 1) == pytest.approx(steps_mm)
    with cell.connected(cell.log()) as controller:
        assert earlier_corrections(controller, 1) == (), "nobody said which nozzle it is"


def test_a_correction_that_was_taken_back_does_not_count(controller_on_record):
    correct(controller_on_record, 0.4)
    with (
        pytest.raises(KeyboardInterrupt),
        ToolChange(controller_on_record, wanted_from(controller_on_record)) as change,
    ):
        change.write()  # done, like one tool without verification
        raise KeyboardInterrupt
    assert earlier_corrections(controller_on_record, 1) == pytest.approx((0.4,))


def wanted_from(controller):
    return [Wanted(1, OTHER, controller.tools.read(1))]


def test_the_first_definition_of_a_tool_is_no_correction(controller_on_record):
    change_tools(controller_on_record, [Wanted(UNDEFINED, OLD[1], None)])
    assert earlier_corrections(controller_on_record, UNDEFINED) == ()
    change_tools(controller_on_record, [Wanted(UNDEFINED, NEW[1], OLD[1])])
    assert earlier_corrections(controller_on_record, UNDEFINED) == pytest.approx((0.25 * 2**0.5,))


# A change's marker keeps its turn tests; their data are read back from it.

START = Pose(300.0, 100.0, 20.0, 0.0, tool=0)
FOUND = ToolOffset(12.3, -3.9, -20.0)
WRITTEN = ToolOffset(13.8, -4.4, -20.0)
"""It differs from the found value: a difference to a reference."""

LIMITS = Limits(speed_mm_s=15.0)


def proposals(*tools, verify=True):
    """Return the values to write to some tools, each measured by two poses."""
    cell = PaperCell(START, FOUND, (310.0, 95.0, -40.0))
    result = cell.run(measure_two_pose(TouchPlan(), stored=FOUND))
    criteria = AcceptanceCriteria(drift_tolerance_mm=0.35)
    proposed = replace(result, offset=WRITTEN)
    return [
        (
            ToolPlan(tool, TwoPoseSource(), criteria, verify=verify),
            Proposal(tool, FOUND, proposed, measured=FOUND),
        )
        for tool in tools
    ]


def marked(*tools, limits=LIMITS, verify=True) -> Mapping[str, Any]:
    """Return the data of a marker after it was a line of the record."""
    nobody: Any = None
    context = MeasurementContext(SimpleController(), nobody, start=START, settings=limits.settings)
    kept = marking.marked_turn_tests(context, limits, proposals(*tools, verify=verify))
    read: Mapping[str, Any] = json.loads(json.dumps(kept))
    return read


def read_back(kept, *tools, kind=MarkerKind.CHANGE):
    details = {**kept, "tools": {str(tool): {} for tool in tools}}
    return marking.tests_of(Marker("a1", kind, "change of a tool", "2026-01-01T00:00:00Z", details))


def test_what_is_read_back_is_the_test_with_its_limits():
    one, other = read_back(marked(1, 2), 1, 2)
    assert (one.test.tool, other.test.tool) == (1, 2)
    assert (one.test.written, one.test.tip) == (WRITTEN, FOUND)
    assert one.test.tolerance_mm == 0.35
    assert one.settings == LIMITS.settings(START, WRITTEN), "about the tip, not the flange"
    assert one.settings.speed_mm_s == 15.0


@each_row(
    ("tools", "kind"),
    [((1, 2), MarkerKind.CHANGE), ((2,), MarkerKind.CHANGE), ((1,), MarkerKind.SET)],
)
def test_a_change_whose_tools_are_not_all_tested_by_it_has_no_test(tools, kind):
    kept = marked(1)
    assert read_back(kept, 1)
    assert read_back(kept, *tools, kind=kind) == ()


def test_touches_are_gone_back_to_where_one_tool_was_measured_and_no_other():
    """The others were measured already, with the nozzles then mounted."""
    assert offer_of(proposals(1))
    assert offer_of(proposals(1, 2)) is None


@pytest.mark.parametrize(("verified", "typed"), [((True, True), True), ((True, False), False)])
def test_poses_are_typed_only_where_a_test_by_touches_follows_for_each_tool(verified, typed):
    plans = [
        plan for tool, test in enumerate(verified, 1) for plan, _ in proposals(tool, verify=test)
    ]
    nobody: Any = None
    change = NozzleChange(SimpleController(), ChangePlan(tuple(plans)), operator=nobody)
    assert change._context(write=True).runner()._types is typed


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ({"verify": False}, "not_wanted"),
        ({"limits": Limits(box=WorkBox(x_max_mm=math.inf))}, "no_box"),
    ],
)
def test_a_test_that_was_not_wanted_or_knows_no_limits_is_not_kept(more, why):
    kept = marked(1, **more)
    assert kept == {"untested": {"1": {"method": "two-pose", "why": why}}}
    assert read_back(kept, 1) == ()
