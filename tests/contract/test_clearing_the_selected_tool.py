"""The selected tool is never cleared unnoticed, on any kind of controller.

The undetected fault would be a clear that is accepted, read back and recorded, leaves the machine
with Tool 0, and lets the next program crash a nozzle.
"""

from contextlib import ExitStack
from dataclasses import dataclass
from itertools import count
from typing import Any

import pytest

import robolink
from robolink.errors import RejectedError, SelectedToolError, ToolChangedError, UndefinedToolError
from robolink.journal import memory_journal
from robolink.model import ANY, Controller, MarkerKind, ToolOffset
from robolink.transaction import (
    Settler,
    ToolChange,
    Wanted,
    change_tools,
    plan_undo,
    undo,
)
from tests.unit._plc_bench import LEVEL, Bench

pytestmark = pytest.mark.simulator_only

FIRST, SECOND, EMPTY = ToolOffset(1.0, 2.0, 3.0), ToolOffset(4.0, 5.0, 6.0), 7
SELECTING = ("epson", "softmotion")

_names = count()


@dataclass
class Cell:
    """A controller with two tools, the first one selected, and one undefined tool."""

    controller: Controller
    first: int = 1
    second: int = 2

    @property
    def tools(self) -> Any:
        return self.controller.tools

    def state(self) -> tuple[object, object, object]:
        return (
            self.tools.read(self.first) is not None,
            self.tools.read(self.second) is not None,
            self.tools.selected(),
        )


@pytest.fixture
def cell(request, tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    with ExitStack() as stack:
        if request.param == "plc map":
            bench = Bench(LEVEL, identity=f"plc+clearing-{next(_names)}")
            controller = stack.enter_context(bench.connect())
            controller.tools.write(controller.tools.selected(), FIRST, expected=ANY)
        else:
            name = f"clearing-{next(_names)}"
            log = memory_journal(name).log(name)
            url = f"{request.param}+sim://{name}?seed=1"
            controller = stack.enter_context(robolink.connect(url, outcomes=log))
            if request.param == "softmotion":
                controller.motors(True)
            controller.tools.write(1, FIRST, expected=ANY)
            controller.tools.write(2, SECOND, expected=ANY)
            controller.tools.select(1)
        yield Cell(controller)


every = pytest.mark.parametrize("cell", [*SELECTING, "plc map"], indirect=True)
selecting = pytest.mark.parametrize("cell", SELECTING, indirect=True)


@every
@pytest.mark.parametrize("then_select", [None, "itself"])
def test_it_is_refused_unless_another_one_is_named(cell, then_select):
    tool = cell.tools.selected()
    before = cell.state()
    named = tool if then_select else None
    if not (named and cell.controller.capabilities.motion is False):
        with pytest.raises(SelectedToolError, match=f"Tool {tool} is selected"):
            cell.tools.clear(tool, expected=ANY, then_select=named)
    with pytest.raises(SelectedToolError):
        cell.tools.preview_clear(tool, then_select=named)
    with pytest.raises(SelectedToolError):
        change_tools(cell.controller, [Wanted(tool, None, ANY, then_select=named)])
    assert cell.state() == before
    assert cell.controller.outcomes.open_markers() == ()


@pytest.mark.parametrize("cell", ["plc map"], indirect=True)
def test_where_the_machine_selects_it_is_to_be_done_there(cell):
    tool = cell.tools.selected()
    with pytest.raises(RejectedError, match="does not select tools"):
        cell.tools.clear(tool, expected=ANY, then_select=0)
    assert cell.tools.read(tool) is not None


@selecting
@pytest.mark.parametrize("other", [0, 2])
def test_the_tool_that_is_named_is_selected_first(cell, other):
    requests = cell.tools.preview_clear(1, then_select=other)
    assert len(requests) == 2
    receipt = cell.tools.clear(1, expected=FIRST, then_select=other)
    assert receipt.read_back is None
    assert cell.state() == (False, True, other)


@selecting
def test_a_tool_that_is_not_selected_is_cleared_and_the_selection_stays(cell):
    cell.tools.clear(2, expected=SECOND, then_select=0)
    assert cell.state() == (True, False, 1)


@selecting
def test_what_is_refused_selects_nothing(cell):
    with pytest.raises((ToolChangedError, SelectedToolError)):
        cell.tools.clear(1, expected=SECOND, then_select=2)
    with pytest.raises(UndefinedToolError):
        cell.tools.clear(1, expected=FIRST, then_select=EMPTY)
    assert cell.state() == (True, True, 1)


@selecting
def test_a_roll_back_to_undefined_selects_the_earlier_tool_then_clears(cell):
    with (
        pytest.raises(RuntimeError),
        ToolChange(cell.controller, [Wanted(EMPTY, SECOND, None)], verify=True) as change,
    ):
        change.write()
        cell.tools.select(EMPTY)  # for its turn test
        raise RuntimeError
    assert cell.tools.read(EMPTY) is None
    assert cell.tools.selected() == 1
    assert cell.controller.outcomes.open_markers() == ()


@selecting
def test_recover_after_a_crash_does_the_same(cell):
    change = ToolChange(cell.controller, [Wanted(EMPTY, SECOND, None)], verify=True)
    change.__enter__()
    change.write()
    cell.tools.select(EMPTY)
    cell.controller.outcomes.change = ""  # the process is gone here
    settler = Settler(cell.controller)
    (marker,) = cell.controller.outcomes.open_markers()
    assert marker.kind is MarkerKind.CHANGE
    settler.settle(settler.examine(marker))
    assert cell.tools.read(EMPTY) is None
    assert cell.tools.selected() == 1


@selecting
def test_a_change_of_several_that_fails_selects_again_what_gave_way(cell):
    def write_and_fail():
        wanted = [Wanted(1, None, FIRST, then_select=2), Wanted(EMPTY, SECOND, None)]
        with ToolChange(cell.controller, wanted) as change:
            change.write()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_and_fail()
    assert cell.state() == (True, True, 1)
    assert cell.tools.read(EMPTY) is None


@selecting
def test_an_undo_to_undefined_is_refused_or_selects_what_is_named(cell):
    change_tools(cell.controller, [Wanted(EMPTY, SECOND, None)])
    cell.tools.select(EMPTY)
    plan = plan_undo(cell.controller, tool=EMPTY)
    with pytest.raises(SelectedToolError):
        undo(cell.controller, plan)
    assert cell.tools.selected() == EMPTY
    assert cell.tools.same(cell.tools.read(EMPTY), SECOND)
    undo(cell.controller, plan, then_select=2)
    assert cell.tools.read(EMPTY) is None
    assert cell.tools.selected() == 2


@selecting
def test_an_undo_to_a_value_leaves_the_selection_alone(cell):
    change_tools(cell.controller, [Wanted(1, SECOND, FIRST)])
    undo(cell.controller, plan_undo(cell.controller, tool=1))
    assert cell.tools.same(cell.tools.read(1), FIRST)
    assert cell.state() == (True, True, 1)
