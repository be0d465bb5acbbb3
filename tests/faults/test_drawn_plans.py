"""Tools are read and written during a random plan of faults: writes reported as done are stored.

One change in twelve exchanges meets a fault that the link can have. An unknown outcome ends in one
of our errors; every report is true. There is one exception: text has no checksum, so an altered
digit is another digit (docs/reference/faults.md F07, F08); a write finds it.
"""

from collections import Counter

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.faults import (
    FaultAction,
    FaultRates,
    LinkKind,
    drawn_faults,
    drawn_plc_faults,
)
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink.errors import RemoteProtocolError, RobolinkError
from robolink.model import ToolOffset

RATES = FaultRates(rate=0.08, exchanges=80)
CHANGES = 6
BENT = (FaultAction.GARBLE_REPLY, FaultAction.SWAP_BYTES)


def epson_cell(seed):
    faults = drawn_faults(seed, LinkKind.EPSON_SIM, RATES)
    simulator = EpsonSimulator(seed=seed, faults=faults)
    return simulator, lambda: simulator.machine.tools.get(3)


def softmotion_cell(seed):
    faults = drawn_plc_faults(seed, LinkKind.MAILBOX_SIM, RATES)
    simulator = SoftMotionSimulator(seed=seed, faults=faults)

    def stored():
        slot = simulator.plc.memory.defined().get(3)
        return slot and ToolOffset(*slot.tool[:4])

    return simulator, stored


CELLS = {"epson": epson_cell, "softmotion": softmotion_cell}


def bent(simulator):
    """Return whether text was altered on its way."""
    return any(fault.action in BENT for fault in simulator.faults.fired)


def changed(cell, seed):
    """Change a tool a few times; return the number of changes reported done, and the faults."""
    simulator, stored = CELLS[cell](seed)
    done = 0
    try:
        with served(simulator) as url, robolink.connect(url) as controller:
            for number in range(CHANGES):
                wanted = ToolOffset(10.5 + number, -3.25, -50)
                before = controller.tools.read(3)
                assert before == stored() or bent(simulator), seed
                controller.tools.write(3, wanted, expected=before)
                assert stored() == wanted, seed
                done += 1
    except RobolinkError:
        pass
    return done, [fault.action.name for fault in simulator.faults.fired]


def run(cell, seeds):
    done, fired = 0, Counter[str]()
    for seed in seeds:
        count, actions = changed(cell, seed)
        done += count
        fired.update(actions)
    return done, fired


@pytest.mark.parametrize("cell", CELLS)
def test_what_is_reported_done_is_done(cell, robolink_state):
    done, fired = run(cell, range(8))
    assert done > 6  # otherwise it would be no surprise
    assert len(fired) > 4


@pytest.mark.soak
@pytest.mark.parametrize("cell", CELLS)
def test_what_is_reported_done_is_done_with_each_kind_of_fault(cell, robolink_state):
    done, fired = run(cell, range(25))
    assert done > 20
    assert len(fired) > 10


@pytest.mark.soak
@pytest.mark.parametrize("cell", CELLS)
def test_what_is_reported_done_is_done_with_thousands_of_plans(cell, robolink_state):
    done, fired = run(cell, range(1000, 4000))
    assert done > 2000
    assert len(fired) > 20


@pytest.mark.parametrize("order", ["high_first", "pairs_swapped", "halves_swapped"])
def test_a_slot_in_another_order_is_no_tool(order, robolink_state):
    """A program that was changed while running has the same boot number, and a right checksum."""
    simulator = SoftMotionSimulator()
    with served(simulator) as url, robolink.connect(url) as controller:
        controller.tools.write(3, ToolOffset(10.5, -3.25, -50), expected=None)
        simulator.panel.lay_words(order)
        with pytest.raises(RemoteProtocolError, match="word order"):
            controller.tools.read(3)
