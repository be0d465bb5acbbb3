"""An open block that is quiet keeps its lease, in a file and on PostgreSQL."""

from dataclasses import replace

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.ambient import replaced
from robolink.errors import LeaseHeldError, LeaseLostError
from robolink.journal import LEASE_S, LeaseHolder
from robolink.model import ToolOffset
from robolink.testing import MemoryController, MemoryMachine
from robolink.transaction import ToolChange, Wanted, recover
from tests.contract._quiet_time import QuietTime

NEW = ToolOffset(1.0, 2.0, -30.0)
ANN = LeaseHolder(os_user="ann", host="pc-1", pid=11, boot="one")
BOB = replace(ANN, os_user="bob", host="pc-2", pid=22, boot="two")


@pytest.fixture
def time():
    time = QuietTime(ManualClock())
    with replaced(time):
        yield time


@pytest.fixture
def connect(location, open_anew, time):
    """Connect another computer to a controller that both reach."""
    machine = MemoryMachine()

    def connected(holder):
        log = open_anew(location).log("acme+usb://cell", holder=holder, clock=time)
        return MemoryController(machine, outcomes=log)

    return connected


def test_who_watches_it_from_another_computer_sees_it_live(connect, time):
    first = connect(ANN)
    with ToolChange(first, [Wanted(1, NEW, first.tools.read(1))], verify=True) as change:
        change.write()
        time.sleep(3 * LEASE_S)
        with pytest.raises(LeaseHeldError, match=r"ann \(process 11 on pc-1\)"):
            recover(connect(BOB), confirm=lambda _: True)
        change.keep("parts were good")
    assert first.tools.read(1) == NEW


def test_who_insists_has_it_and_the_other_keeps_nothing(connect, time):
    first, second = connect(ANN), connect(BOB)
    with pytest.raises(LeaseLostError, match=r"bob \(process 22 on pc-2\) took over"):
        with ToolChange(first, [Wanted(1, NEW, first.tools.read(1))], verify=True) as change:
            change.write()
            time.sleep(3 * LEASE_S)
            second.take_over("ann went home")
            change.keep("parts were good")
    assert len(second.outcomes.open_markers()) == 1
