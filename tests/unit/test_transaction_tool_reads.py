"""What an EPSON controller is asked before a tool is written, and what that may miss."""

import pytest
from robolink_simulators.epson.options import EpsonOptions

from robolink.errors import NotReadyError, ToolChangedError
from tests.unit._transaction_cell import NEW, OLD, OTHER, tool_cell


@pytest.fixture
def cell():
    with tool_cell() as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connected() as controller:
        yield controller


def asked(cell):
    """Return the exchanges that changed nothing but the login, in short."""
    texts = [
        text.strip('"').rpartition('"')[2] for _, way, text in cell.simulator.log if way == ">"
    ]
    return [text for text in texts if text.startswith(("$Get", "Print TL", "TL"))]


WRITTEN = ["TLSet 1, XY(12.250, -3.250, -20.000, 0.000)", "Print TLSet(1)"]
ONE_BY_ONE = ["Print TLDef(1)", "Print TLSet(1)"]


def test_a_write_of_what_was_expected_takes_three_exchanges(cell, controller):
    controller.tools.write(2, NEW[2], expected=OLD[2])  # asks which robot it is, once
    cell.simulator.log.clear()
    controller.tools.write(1, NEW[1], expected=OLD[1])
    assert asked(cell) == ["TLSet", *WRITTEN]


def test_the_first_write_of_a_session_looks_at_the_state_before_it_sends_anything(cell, controller):
    controller.tools.write(1, NEW[1], expected=OLD[1])
    assert asked(cell)[0] == "$GetStatus"


def test_a_state_that_changed_since_is_named_although_it_was_not_looked_at(cell, controller):
    controller.tools.write(2, NEW[2], expected=OLD[2])
    cell.simulator.panel.open_guard()
    written = cell.simulator.machine.flash_writes
    cell.simulator.log.clear()
    for _ in range(2):
        with pytest.raises(NotReadyError, match="guard"):
            controller.tools.write(1, NEW[1], expected=OLD[1])
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
    cell, controller, monkeypatch, listing
):
    controller.tools.write(2, NEW[2], expected=OLD[2])
    monkeypatch.setattr(controller.tools, "_listing", lambda: listing)
    cell.simulator.log.clear()
    controller.tools.write(1, NEW[1], expected=OLD[1])
    assert asked(cell) == [*ONE_BY_ONE, *WRITTEN]


def test_what_is_stored_already_is_asked_for_by_itself_before_the_write_is_left_out(
    cell, controller
):
    controller.tools.write(2, NEW[2], expected=OLD[2])
    cell.simulator.log.clear()
    assert controller.tools.write(1, OLD[1], expected=OLD[1]).skipped
    assert asked(cell) == ["TLSet", *ONE_BY_ONE]


def test_a_tool_that_was_cleared_here_is_asked_for_again(cell, controller):
    controller.tools.clear(1, expected=controller.tools.read(1), then_select=0)
    assert controller.tools.read(1) is None
    controller.tools.write(1, OTHER, expected=None)
    assert controller.tools.read(1) == OTHER


def test_a_tool_of_zeros_is_told_from_an_undefined_one(cell, controller):
    zeros = type(OTHER)()
    controller.tools.write(1, zeros, expected=OLD[1])
    assert controller.tools.read(1) == zeros
    assert controller.tools.read(3) is None


def test_a_tool_that_somebody_cleared_is_undefined_even_where_asking_for_it_is_an_error():
    options = EpsonOptions(tlset_of_undefined="error")
    with tool_cell(options) as cell, cell.connected() as controller:
        before = controller.tools.read(1)
        cell.simulator.machine.tools.clear(1, in_force="selects_zero")
        with pytest.raises(ToolChangedError, match="Tool 1 holds undefined"):
            controller.tools.write(1, NEW[1], expected=before)
        assert cell.writes == 1, "only that of the person who cleared it"
        assert not controller.status().fault
