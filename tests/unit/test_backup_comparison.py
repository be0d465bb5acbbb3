"""What counts as a difference, and what a restore would do about it."""

from dataclasses import replace

import pytest

from robolink.backup import (
    TOOLS,
    Backup,
    ComparisonTolerance,
    RestoreChange,
    ToolState,
    compare,
    plan_restore,
    require_same_controller,
)
from robolink.errors import (
    ConfigError,
    ReservedToolError,
    ToolError,
    ToolIndexError,
    UndefinedToolError,
)
from robolink.model import ControllerFacts, ToolOffset

TIP = ToolOffset(12.0, -3.5, -20.0, 179.9999)
URL = "epson+tcp://192.168.0.1:5000"
FACTS = ControllerFacts(robot_number=1, robot_serials=("A1",))


def state(selected=1, **tools):
    given = {int(name[1:]): offset for name, offset in tools.items()}
    return ToolState(dict.fromkeys(TOOLS) | given, selected)


def backup_of(wanted, facts=FACTS):
    return Backup(URL, "2026-01-01T00:00:00+00:00", "0.1.0", facts, wanted)


def test_equal_tables_are_equal():
    assert compare(state(t1=TIP), state(t1=TIP)).equal


def test_a_difference_is_told_by_component_with_its_sign():
    found = replace(TIP, x_mm=12.25)
    (tool,) = compare(state(t1=TIP), state(t1=found)).differing
    assert tool.tool == 1
    assert [part.name for part in tool.components if not part.equal] == ["x_mm"]
    assert tool.components[0].delta == pytest.approx(0.25)


@pytest.mark.parametrize(("change_mm", "equal"), [(0.0005, True), (0.0006, False)])
def test_the_bound_itself_is_allowed(change_mm, equal):
    found = replace(TIP, y_mm=TIP.y_mm + change_mm)
    assert compare(state(t1=TIP), state(t1=found)).equal is equal


def test_lengths_and_angles_have_tolerances_of_their_own():
    found = replace(TIP, x_mm=12.3, u_deg=TIP.u_deg - 0.3)
    limits = ComparisonTolerance(length_mm=0.5)
    (tool,) = compare(state(t1=TIP), state(t1=found), limits).differing
    assert [part.name for part in tool.components if not part.equal] == ["u_deg"]
    assert compare(state(t1=TIP), state(t1=found), ComparisonTolerance(0.5, 0.5)).equal


def test_angles_are_compared_around_the_circle():
    found = replace(TIP, u_deg=-179.9999)
    assert compare(state(t1=TIP), state(t1=found)).equal


@pytest.mark.parametrize("turned", [False, True])
def test_a_tool_that_only_one_side_defines_differs_whatever_the_tolerance(turned):
    expected, found = state(), state(t4=ToolOffset())
    if turned:
        expected, found = found, expected
    (tool,) = compare(expected, found, ComparisonTolerance(1000, 180)).differing
    assert (tool.tool, tool.components) == (4, ())


def test_another_tool_in_force_is_a_difference_unless_told():
    sides = state(selected=1, t1=TIP), state(selected=0, t1=TIP)
    assert not compare(*sides).equal
    assert compare(*sides, selection_counts=False).equal
    assert not compare(*sides, selection_counts=False).same_selection


@pytest.mark.parametrize("bad", [-1.0, float("nan"), float("inf")])
def test_a_tolerance_is_a_number_from_0_up(bad):
    with pytest.raises(ConfigError, match="tolerance"):
        ComparisonTolerance(bad)
    with pytest.raises(ConfigError, match="tolerance"):
        ComparisonTolerance(angle_deg=bad)


def test_a_plan_writes_first_and_clears_last():
    wanted = state(t1=TIP, t9=TIP)
    now = state(t1=TIP, t2=TIP, t9=ToolOffset(1))
    plan = plan_restore(backup_of(wanted), now)
    assert plan.changes == (RestoreChange(9, ToolOffset(1), TIP), RestoreChange(2, TIP, None))
    assert plan.select is None


def test_only_named_tools_are_planned():
    wanted = state(t1=TIP, t9=TIP)
    plan = plan_restore(backup_of(wanted), state(t1=TIP, t2=TIP), tools=[9, 9, 1])
    assert [change.tool for change in plan.changes] == [9]


def test_nothing_is_planned_where_nothing_differs():
    assert plan_restore(backup_of(state(t1=TIP)), state(selected=0, t1=TIP)).empty


def test_the_selection_is_planned_only_when_asked():
    wanted = backup_of(state(selected=2, t2=TIP))
    now = state(selected=0)
    assert plan_restore(wanted, now).select is None
    assert plan_restore(wanted, now, selected=True).select == 2
    assert plan_restore(wanted, state(selected=2, t2=TIP), selected=True).empty


def test_a_tool_that_would_not_be_defined_is_not_selected():
    with pytest.raises(UndefinedToolError, match="tool 2"):
        plan_restore(
            backup_of(state(selected=2, t2=TIP)), state(selected=0), tools=[1], selected=True
        )


def test_the_tool_in_force_is_never_cleared():
    wanted = backup_of(state(selected=2, t2=TIP))
    now = state(selected=1, t1=TIP, t2=TIP)
    with pytest.raises(ToolError, match="Tool 1 is selected"):
        plan_restore(wanted, now)
    plan = plan_restore(wanted, now, selected=True)
    assert (plan.select, plan.clears) == (2, (RestoreChange(1, TIP, None),))


@pytest.mark.parametrize(("tool", "error"), [(0, ReservedToolError), (16, ToolIndexError)])
def test_a_tool_that_cannot_be_written_is_refused(tool, error):
    with pytest.raises(error) as caught:
        plan_restore(backup_of(state()), state(), tools=[tool])
    assert caught.value.remedy.endswith(" from 1 to 15." if tool == 0 else " tools 1 to 15.")
    assert "EPSON" not in caught.value.remedy  # a PLC has tools too


OTHERS = {
    "robot serials": replace(FACTS, robot_serials=("B2",)),
    "selected robot": replace(FACTS, robot_number=2),
}


@pytest.mark.parametrize("what", OTHERS)
def test_another_controller_is_refused_by_what_it_says(what):
    with pytest.raises(ConfigError, match=what) as caught:
        require_same_controller(backup_of(state()), URL, OTHERS[what])
    assert "require_same_controller" in caught.value.remedy


def test_the_same_robot_at_another_address_is_the_same():
    require_same_controller(backup_of(state()), "epson+tcp://10.0.0.9:5000", FACTS)


def test_without_serial_numbers_the_address_decides():
    unknown = ControllerFacts()
    require_same_controller(backup_of(state(), unknown), URL, unknown)
    with pytest.raises(ConfigError, match="no serial number"):
        require_same_controller(backup_of(state(), unknown), "epson+tcp://10.0.0.9:5000", FACTS)
