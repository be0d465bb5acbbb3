"""An open change that is quiet lives: another computer is told, and takes nothing from it."""

from dataclasses import replace

import pytest

import robolink
from robolink.ambient import replaced
from robolink.errors import LeaseHeldError
from robolink.journal import LeaseHolder, open_journal
from robolink.model import ToolOffset
from robolink.transaction import ToolChange, Wanted, recover
from tests.contract._quiet_time import QuietTime
from tests.contract._softmotion_cell import served

OLD, NEW = ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.3, -3.7, -20.5)
QUIET_S = 30.0
ANN = LeaseHolder(os_user="ann", host="pc-1", pid=11, process_start="pids 1", boot="one")
BOB = replace(ANN, os_user="bob", host="pc-2", pid=22, boot="two")


class Plc:
    """A PLC, two computers that command it, and the time of all."""

    def __init__(self, cell, journal):
        self.cell = cell
        self.time = QuietTime(cell.clock)
        self.journal = journal

    def connect(self, holder, journal=None):
        log = (journal or self.journal).log(self.cell.url, holder=holder, clock=self.time)
        return robolink.connect(self.cell.url, outcomes=log, clock=self.cell.clock)

    @property
    def held(self):
        """What the slot holds, past the wire."""
        return self.cell.simulator.plc.memory.slot(1).tool[2]


@pytest.fixture(params=["sim", "modbus-tcp", "can-multicast"])
def plc(request, tmp_path):
    with served(request.param) as cell:
        made = Plc(cell, open_journal(str(tmp_path / "shared.db")))
        with replaced(made.time):
            yield made


def changed(controller):
    return ToolChange(controller, [Wanted(1, NEW, OLD)], verify=True)


def test_a_quiet_change_is_not_taken_back_by_a_second_pc(plc):
    with plc.connect(ANN) as first, changed(first) as change:
        change.write()
        plc.time.sleep(QUIET_S)
        with plc.connect(BOB) as second, pytest.raises(LeaseHeldError) as told:
            recover(second, confirm=lambda _: True)
        assert "ann (process 11 on pc-1) has been working on" in told.value.what
        assert plc.held == NEW.z_mm
        change.keep("parts were good")
    assert plc.held == NEW.z_mm
    assert plc.journal.open_markers() == ()
