"""A backup file is complete and read strictly; the differences from it."""

import json
import os
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.backup import (
    SCHEMA,
    TOOLS,
    Backup,
    ComparisonTolerance,
    RestoreChange,
    ToolState,
    backup_from_text,
    backup_to_text,
    compare,
    load,
    plan_restore,
    require_same_controller,
    save,
)
from robolink.errors import (
    ConfigError,
    ReservedToolError,
    ToolError,
    ToolIndexError,
    UndefinedToolError,
)
from robolink.files.named import require_free
from robolink.model import ControllerFacts, ToolOffset
from tests._rows import each_row

# A backup file is complete, is read strictly, and never replaces another one.

TIP = ToolOffset(12.345, -3.25, -20.002, 90.0)
AXES = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")


def backup_of(tools=None, *, selected=1, **facts):
    offsets = dict.fromkeys(TOOLS) | (tools or {1: TIP})
    return Backup(
        "epson+tcp://192.168.0.1:5000",
        "2026-01-01T00:00:00+00:00",
        "0.1.0",
        ControllerFacts(**facts),
        ToolState(offsets, selected),
    )


FULL = backup_of(
    {1: TIP, 15: ToolOffset(0, 0, 1e-7, -180, 5, 6)},
    controller_name="Zelle 5, Süd",
    controller_serial="7",
    firmware="7.5.4.0",
    robot_number=1,
    robot_models=("T6-602S",),
    robot_serials=("SIM00001", ""),
)

finite = st.floats(allow_nan=False, allow_infinity=False)
offsets = st.none() | st.builds(ToolOffset, finite, finite, finite, finite, finite, finite)


def test_everything_comes_back(tmp_path):
    path = tmp_path / "cell.json"
    save(FULL, path)
    assert load(path) == FULL


OF_0_1 = """{
  "schema": "robolink/backup/1",
  "saved_at": "2026-01-01T00:00:00+00:00",
  "robolink_version": "0.1.0",
  "controller": "epson+tcp://192.168.0.1:5000",
  "facts": {
    "controller_name": "Zelle 5, S\\u00fcd",
    "controller_type": null,
    "controller_serial": "7",
    "firmware": "7.5.4.0",
    "project": null,
    "robot_number": 1,
    "robot_models": ["T6-602S"],
    "robot_serials": ["SIM00001", ""]
  },
  "selected_tool": 1,
  "tools": {
    "1": {"x_mm": 12.345, "y_mm": -3.25, "z_mm": -20.002, "u_deg": 90.0,
          "v_deg": 0.0, "w_deg": 0.0},
    "2": null, "3": null, "4": null, "5": null, "6": null, "7": null, "8": null,
    "9": null, "10": null, "11": null, "12": null, "13": null, "14": null,
    "15": {"x_mm": 0, "y_mm": 0, "z_mm": 1e-07, "u_deg": -180, "v_deg": 5, "w_deg": 6}
  }
}
"""
"""A backup by robolink 0.1.0, never remade (docs/api.md)."""


def test_a_backup_of_an_earlier_version_is_read():
    assert backup_from_text(OF_0_1, source="golden.json") == FULL


@settings(max_examples=40, deadline=None)
@given(st.fixed_dictionaries(dict.fromkeys(TOOLS, offsets)), st.integers(0, 15))
def test_any_tools_come_back(tools, selected):
    whole = backup_of(tools, selected=selected)
    assert backup_from_text(backup_to_text(whole), source="it") == whole


def test_the_file_can_be_read_by_eye():
    lines = backup_to_text(FULL).splitlines()
    assert lines[1] == f'  "schema": "{SCHEMA}",'
    (first,) = (line for line in lines if line.lstrip().startswith('"1":'))
    for text in ('"x_mm": 12.345', '"z_mm": -20.002', '"u_deg": 90.0'):
        assert text in first
    assert '    "2": null,' in lines
    assert all(line.isascii() and len(line) < 120 for line in lines)


def document(change):
    found = json.loads(backup_to_text(FULL))
    change(found)
    return json.dumps(found)


WRONG = {
    "schema": lambda d: d.update(schema="robolink/tools/1"),
    "tools.7": lambda d: d["tools"].pop("7"),
    "tools.16": lambda d: d["tools"].update({"16": None}),
    "tools.1.z_mm": lambda d: d["tools"]["1"].pop("z_mm"),
    "tools.1.x_mm": lambda d: d["tools"]["1"].update(x_mm="12"),
    "tools.15.u_deg": lambda d: d["tools"]["15"].update(u_deg=True),
    "tools.2": lambda d: d["tools"].update({"2": []}),
    "selected_tool": lambda d: d.update(selected_tool=16),
    "facts": lambda d: d.update(facts=None),
    "facts.colour": lambda d: d["facts"].update(colour="red"),
    "facts.robot_number": lambda d: d["facts"].update(robot_number="1"),
    "facts.robot_serials": lambda d: d["facts"].update(robot_serials="SIM00001"),
    "facts.robot_models.0": lambda d: d["facts"].update(robot_models=[3]),
    "saved_at": lambda d: d.update(saved_at=5),
    "note": lambda d: d.update(note="golden"),
    "tools.3.v_deg": lambda d: d["tools"].update(
        {"3": dict.fromkeys(AXES, 1) | {"v_deg": 10**400}}
    ),
}


@each_row("place", WRONG)
def test_what_is_wrong_is_named_by_its_place(place):
    with pytest.raises(ConfigError) as caught:
        backup_from_text(document(WRONG[place]), source="golden.json")
    assert str(caught.value).startswith(f"golden.json: {place}: ")
    assert caught.value.remedy


@each_row("constant", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_what_is_no_finite_number_is_refused(constant):
    text = backup_to_text(FULL).replace("12.345", constant)
    with pytest.raises(ConfigError, match="number"):
        backup_from_text(text, source="golden.json")


def test_a_newer_form_says_that_a_newer_robolink_is_needed():
    text = backup_to_text(FULL).replace(SCHEMA, "robolink/backup/2")
    with pytest.raises(ConfigError, match="newer") as caught:
        backup_from_text(text, source="golden.json")
    assert "newer" in caught.value.remedy


def test_a_name_that_stands_twice_is_refused():
    text = backup_to_text(FULL).replace('"2": null', '"1": null')
    with pytest.raises(ConfigError, match="twice"):
        backup_from_text(text, source="golden.json")


@each_row("text", ["", "{", "[]", "null", '"x"', "[" * 100_000])
def test_what_is_no_document_is_refused(text):
    with pytest.raises(ConfigError, match=r"golden\.json"):
        backup_from_text(text, source="golden.json")


def test_a_file_that_is_missing_or_no_text_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="No such file"):
        load(tmp_path / "none.json")
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe{}")
    with pytest.raises(ConfigError, match="UTF-8"):
        load(tmp_path / "bytes.json")


def test_an_editor_s_byte_order_mark_does_no_harm(tmp_path):
    path = tmp_path / "cell.json"
    path.write_text(backup_to_text(FULL), encoding="utf-8-sig")
    assert load(path) == FULL


def test_a_file_that_exists_is_kept_unless_told(tmp_path):
    path = tmp_path / "cell.json"
    require_free(path)
    save(FULL, path)
    with pytest.raises(ConfigError, match="exists"):
        require_free(path)
    with pytest.raises(ConfigError, match="exists"):
        save(backup_of(), path)
    assert load(path) == FULL
    save(backup_of(), path, replace=True)
    assert load(path) == backup_of()
    assert [left.name for left in tmp_path.iterdir()] == ["cell.json"]


@pytest.mark.parametrize("step", ["fsync", "link"])
def test_a_full_disk_is_told_and_leaves_nothing_behind(tmp_path, monkeypatch, step):
    def fail(*arguments, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, step, fail)
    if step == "link":
        monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(ConfigError, match="No space left"):
        save(FULL, tmp_path / "cell.json")
    assert list(tmp_path.iterdir()) == []


def test_a_memory_stick_without_links_keeps_the_promise_too(tmp_path, monkeypatch):
    def fail(*arguments, **options):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", fail)
    path = tmp_path / "cell.json"
    save(FULL, path)
    with pytest.raises(ConfigError, match="exists"):
        save(backup_of(), path)
    assert load(path) == FULL
    assert [left.name for left in tmp_path.iterdir()] == ["cell.json"]


def test_a_folder_that_is_missing_is_told(tmp_path):
    with pytest.raises(ConfigError, match="No such file"):
        save(FULL, tmp_path / "none" / "cell.json")


# The differences from a backup, and the restore's treatment of each.

COMPARED_TIP = ToolOffset(12.0, -3.5, -20.0, 179.9999)
URL = "epson+tcp://192.168.0.1:5000"
FACTS = ControllerFacts(robot_number=1, robot_serials=("A1",))


def state(selected=1, **tools):
    given = {int(name[1:]): offset for name, offset in tools.items()}
    return ToolState(dict.fromkeys(TOOLS) | given, selected)


def backup_with(wanted, facts=FACTS):
    return Backup(URL, "2026-01-01T00:00:00+00:00", "0.1.0", facts, wanted)


def test_equal_tables_are_equal():
    assert compare(state(t1=COMPARED_TIP), state(t1=COMPARED_TIP)).equal


def test_a_difference_is_told_by_component_with_its_sign():
    found = replace(COMPARED_TIP, x_mm=12.25)
    (tool,) = compare(state(t1=COMPARED_TIP), state(t1=found)).differing
    assert tool.tool == 1
    assert [part.name for part in tool.components if not part.equal] == ["x_mm"]
    assert tool.components[0].delta == pytest.approx(0.25)


@pytest.mark.parametrize(("change_mm", "equal"), [(0.0005, True), (0.0006, False)])
def test_the_bound_itself_is_allowed(change_mm, equal):
    found = replace(COMPARED_TIP, y_mm=COMPARED_TIP.y_mm + change_mm)
    assert compare(state(t1=COMPARED_TIP), state(t1=found)).equal is equal


def test_lengths_and_angles_have_tolerances_of_their_own():
    found = replace(COMPARED_TIP, x_mm=12.3, u_deg=COMPARED_TIP.u_deg - 0.3)
    limits = ComparisonTolerance(length_mm=0.5)
    (tool,) = compare(state(t1=COMPARED_TIP), state(t1=found), limits).differing
    assert [part.name for part in tool.components if not part.equal] == ["u_deg"]
    assert compare(state(t1=COMPARED_TIP), state(t1=found), ComparisonTolerance(0.5, 0.5)).equal


def test_angles_are_compared_around_the_circle():
    found = replace(COMPARED_TIP, u_deg=-179.9999)
    assert compare(state(t1=COMPARED_TIP), state(t1=found)).equal


@pytest.mark.parametrize("turned", [False, True])
def test_a_tool_that_only_one_side_defines_differs_whatever_the_tolerance(turned):
    expected, found = state(), state(t4=ToolOffset())
    if turned:
        expected, found = found, expected
    (tool,) = compare(expected, found, ComparisonTolerance(1000, 180)).differing
    assert (tool.tool, tool.components) == (4, ())


def test_another_tool_in_force_is_a_difference_unless_told():
    sides = state(selected=1, t1=COMPARED_TIP), state(selected=0, t1=COMPARED_TIP)
    assert not compare(*sides).equal
    assert compare(*sides, selection_counts=False).equal
    assert not compare(*sides, selection_counts=False).same_selection


@each_row("bad", [-1.0, float("nan"), float("inf")])
def test_a_tolerance_is_a_number_from_0_up(bad):
    with pytest.raises(ConfigError, match="tolerance"):
        ComparisonTolerance(bad)
    with pytest.raises(ConfigError, match="tolerance"):
        ComparisonTolerance(angle_deg=bad)


def test_a_plan_writes_first_and_clears_last():
    wanted = state(t1=COMPARED_TIP, t9=COMPARED_TIP)
    now = state(t1=COMPARED_TIP, t2=COMPARED_TIP, t9=ToolOffset(1))
    plan = plan_restore(backup_with(wanted), now)
    assert plan.changes == (
        RestoreChange(9, ToolOffset(1), COMPARED_TIP),
        RestoreChange(2, COMPARED_TIP, None),
    )
    assert plan.select is None


def test_only_named_tools_are_planned():
    wanted = state(t1=COMPARED_TIP, t9=COMPARED_TIP)
    plan = plan_restore(
        backup_with(wanted), state(t1=COMPARED_TIP, t2=COMPARED_TIP), tools=[9, 9, 1]
    )
    assert [change.tool for change in plan.changes] == [9]


def test_nothing_is_planned_where_nothing_differs():
    assert plan_restore(
        backup_with(state(t1=COMPARED_TIP)), state(selected=0, t1=COMPARED_TIP)
    ).empty


def test_the_selection_is_planned_only_when_asked():
    wanted = backup_with(state(selected=2, t2=COMPARED_TIP))
    now = state(selected=0)
    assert plan_restore(wanted, now).select is None
    assert plan_restore(wanted, now, selected=True).select == 2
    assert plan_restore(wanted, state(selected=2, t2=COMPARED_TIP), selected=True).empty


def test_a_tool_that_would_not_be_defined_is_not_selected():
    with pytest.raises(UndefinedToolError, match="tool 2"):
        plan_restore(
            backup_with(state(selected=2, t2=COMPARED_TIP)),
            state(selected=0),
            tools=[1],
            selected=True,
        )


def test_the_tool_in_force_is_never_cleared():
    wanted = backup_with(state(selected=2, t2=COMPARED_TIP))
    now = state(selected=1, t1=COMPARED_TIP, t2=COMPARED_TIP)
    with pytest.raises(ToolError, match="Tool 1 is selected"):
        plan_restore(wanted, now)
    plan = plan_restore(wanted, now, selected=True)
    assert (plan.select, plan.clears) == (2, (RestoreChange(1, COMPARED_TIP, None),))


@pytest.mark.parametrize(("tool", "error"), [(0, ReservedToolError), (16, ToolIndexError)])
def test_a_tool_that_cannot_be_written_is_refused(tool, error):
    with pytest.raises(error) as caught:
        plan_restore(backup_with(state()), state(), tools=[tool])
    assert caught.value.remedy.endswith(" from 1 to 15." if tool == 0 else " tools 1 to 15.")
    assert "EPSON" not in caught.value.remedy  # a PLC has tools too


OTHERS = {
    "robot serials": replace(FACTS, robot_serials=("B2",)),
    "selected robot": replace(FACTS, robot_number=2),
}


@pytest.mark.parametrize("what", OTHERS)
def test_another_controller_is_refused_by_what_it_says(what):
    with pytest.raises(ConfigError, match=what) as caught:
        require_same_controller(backup_with(state()), URL, OTHERS[what])
    assert "require_same_controller" in caught.value.remedy


def test_the_same_robot_at_another_address_is_the_same():
    require_same_controller(backup_with(state()), "epson+tcp://10.0.0.9:5000", FACTS)


def test_without_serial_numbers_the_address_decides():
    unknown = ControllerFacts()
    require_same_controller(backup_with(state(), unknown), URL, unknown)
    with pytest.raises(ConfigError, match="no serial number"):
        require_same_controller(backup_with(state(), unknown), "epson+tcp://10.0.0.9:5000", FACTS)
