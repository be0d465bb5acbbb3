"""How often an EPSON controller is asked whether a tool is defined, and what that may miss."""

import pytest
from robolink_simulators.epson.options import EpsonOptions

from robolink.errors import ToolChangedError
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


def test_a_write_takes_five_exchanges(cell, controller):
    controller.tools.write(2, NEW[2], expected=OLD[2])  # asks which robot it is, once
    cell.simulator.log.clear()
    controller.tools.write(1, NEW[1], expected=OLD[1])
    assert asked(cell) == [
        "$GetStatus",
        "Print TLDef(1)",
        "Print TLSet(1)",
        "TLSet 1, XY(12.250, -3.250, -20.000, 0.000)",
        "Print TLSet(1)",
    ]


def test_a_tool_that_was_cleared_here_is_asked_for_again(cell, controller):
    controller.tools.clear(1, expected=controller.tools.read(1))
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
        cell.simulator.machine.tools.clear(1)
        with pytest.raises(ToolChangedError, match="Tool 1 holds undefined"):
            controller.tools.write(1, NEW[1], expected=before)
        assert cell.writes == 1, "only that of the person who cleared it"
        assert not controller.status().fault
