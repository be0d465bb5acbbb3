"""What the record says about a tool before it is written again."""

import pytest

from robolink.model import EntryKind, NewEntry, ToolOffset, plain_offset
from robolink.timing import local_label
from robolink.transaction import (
    ChangedSince,
    ToolChange,
    Wanted,
    change_tools,
    changed_since,
    earlier_corrections,
    last_proof,
)
from tests.unit._transaction_cell import NEW, OLD, OTHER, UNDEFINED, tool_cell, wanted


@pytest.fixture
def cell():
    with tool_cell() as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connected(cell.log(nozzle="N-7")) as controller:
        yield controller


def test_a_tool_that_was_never_written_here_has_not_changed(controller):
    assert last_proof(controller, 1) is None
    assert changed_since(controller, 1, OTHER) is None


def test_a_tool_that_holds_what_was_proved_last_has_not_changed(cell, controller):
    change_tools(controller, wanted(1))
    assert changed_since(controller, 1, cell.tools[1]) is None
    # The other tool has a history of its own.
    assert changed_since(controller, 2, OTHER) is None


def test_a_tool_that_was_put_back_holds_its_old_value(cell, controller):
    with ToolChange(controller, wanted(1, 2), verify=True) as change:
        change.write()
    for tool, offset in cell.tools.items():
        assert changed_since(controller, tool, offset) is None
        assert changed_since(controller, tool, NEW[tool]) is not None


def test_a_tool_that_somebody_else_changed_is_shown_with_when_how_far_and_why(controller):
    change_tools(controller, wanted(1))
    moved = ToolOffset(12.25, -3.25 + 0.3, -20.0 - 0.4)
    found = changed_since(controller, 1, moved)
    assert found is not None
    assert (found.tool, found.recorded, found.now) == (1, NEW[1], moved)
    assert found.distance_mm == pytest.approx(0.5)
    proof = last_proof(controller, 1)
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


def test_an_entry_that_proves_nothing_is_passed_over(controller):
    change_tools(controller, wanted(1))
    controller.outcomes.append(
        NewEntry(EntryKind.ROLLED_BACK, tool=1),
        NewEntry(EntryKind.UNKNOWN, tool=1, details={"value": plain_offset(OTHER)}),
    )
    assert changed_since(controller, 1, NEW[1]) is None


def correct(controller, *steps_mm):
    """Move tool 1's tip along X by so much, one change after another."""
    for step_mm in steps_mm:
        before = controller.tools.read(1)
        after = ToolOffset(before.x_mm + step_mm, before.y_mm, before.z_mm)
        change_tools(controller, [Wanted(1, after, before)])


def test_corrections_of_one_nozzle_are_told_oldest_first(controller):
    correct(controller, 0.4, -0.2, 0.1)
    assert earlier_corrections(controller, 1) == pytest.approx((0.4, 0.2, 0.1))
    assert earlier_corrections(controller, 2) == ()


def test_a_write_of_z_alone_is_no_correction_that_x_and_y_could_have_grown_from(controller):
    before = controller.tools.read(1)
    longer = ToolOffset(before.x_mm, before.y_mm, before.z_mm - 0.7)
    change_tools(controller, [Wanted(1, longer, before)])
    correct(controller, 0.4)
    assert earlier_corrections(controller, 1) == pytest.approx((0.4,))


def test_corrections_of_the_nozzle_before_do_not_count(cell):
    for nozzle, steps_mm in (("N-6", (0.9,)), ("N-7", (0.3, 0.2))):
        with cell.connected(cell.log(nozzle=nozzle)) as controller:
            correct(controller, *steps_mm)
            assert earlier_corrections(controller, 1) == pytest.approx(steps_mm)
    with cell.connected(cell.log()) as controller:
        assert earlier_corrections(controller, 1) == (), "nobody said which nozzle it is"


def test_a_correction_that_was_taken_back_does_not_count(controller):
    correct(controller, 0.4)
    with (
        pytest.raises(KeyboardInterrupt),
        ToolChange(controller, wanted_from(controller)) as change,
    ):
        change.write()  # done, as one tool is that nobody verifies
        raise KeyboardInterrupt
    assert earlier_corrections(controller, 1) == pytest.approx((0.4,))


def wanted_from(controller):
    return [Wanted(1, OTHER, controller.tools.read(1))]


def test_the_first_definition_of_a_tool_is_no_correction(controller):
    change_tools(controller, [Wanted(UNDEFINED, OLD[1], None)])
    assert earlier_corrections(controller, UNDEFINED) == ()
    change_tools(controller, [Wanted(UNDEFINED, NEW[1], OLD[1])])
    assert earlier_corrections(controller, UNDEFINED) == pytest.approx((0.25 * 2**0.5,))
